//! Thickness of a specimen, from the positions of its surface and of the base behind it.

use crate::units::Position;
use thiserror::Error;

/// A position with its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchPosition {
    /// Position from home.
    pub position: Position,
    /// Standard error in mm.
    pub std_error_mm: f64,
}

/// Thickness of a specimen as it is mounted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thickness {
    /// From its surface to the base, in mm.
    pub mm: f64,
    /// Standard error in mm.
    pub std_error_mm: f64,
    /// 95 % interval in mm.
    pub ci95_mm: [f64; 2],
}

/// Two positions that are no thickness.
#[derive(Clone, Debug, PartialEq, Error)]
#[error(
    "the base at {base:.3} is not clearly beyond the tissue at {tissue:.3}; touch both again without homing in between"
)]
pub struct ThicknessError {
    pub base: Position,
    pub tissue: Position,
}

/// The distance from tissue to base. Both positions must come from one homing; their errors are independent.
pub fn thickness(tissue: TouchPosition, base: TouchPosition) -> Result<Thickness, ThicknessError> {
    let mm = base.position.distance_from(tissue.position);
    let std_error_mm = base.std_error_mm.hypot(tissue.std_error_mm);
    let is_known = mm.is_finite() && std_error_mm.is_finite();
    // Less than three standard errors may be nothing at all.
    if !(is_known && mm > 3.0 * std_error_mm) {
        return Err(ThicknessError { base: base.position, tissue: tissue.position });
    }
    let half = 1.96 * std_error_mm;
    Ok(Thickness { mm, std_error_mm, ci95_mm: [mm - half, mm + half] })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn touched(position: f64, std_error_mm: f64) -> TouchPosition {
        TouchPosition { position: Position(position), std_error_mm }
    }

    #[test]
    fn errors_of_both_touches_add_in_quadrature() {
        let found = thickness(touched(41.2, 0.003), touched(45.2, 0.004)).unwrap();
        assert!((found.mm - 4.0).abs() < 1e-12);
        assert!((found.std_error_mm - 0.005).abs() < 1e-15);
        assert!((found.ci95_mm[0] - 3.9902).abs() < 1e-12);
    }

    #[test]
    fn a_base_before_the_tissue_is_refused() {
        for base in [41.0, 41.21, f64::NAN] {
            let err = thickness(touched(41.2, 0.02), touched(base, 0.001)).unwrap_err();
            assert!(err.to_string().contains("touch both again"), "{err}");
        }
    }
}
