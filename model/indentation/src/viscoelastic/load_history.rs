//! The history that relaxes, for any law of contact.

use super::contact::PowerLaw;
use super::history::{DepthHistory, HistoryError};
use crate::document::{Indenter, Specimen};
use crate::load_curve::{LoadCurve, load_at};
use crate::validity::{ContactError, ContactLaw};
use thiserror::Error;

/// Depths without a history of a law.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LoadHistoryError {
    #[error(transparent)]
    Contact(#[from] ContactError),
    #[error(transparent)]
    History(#[from] HistoryError),
}

/// A press as Lee and Radok take it: what relaxes, and its power law. Depths in mm at times in s.
///
/// Their integral is linear in the force of an elastic specimen. Where that is no power of the depth the history is the force over
/// the shear modulus itself, in mm², straight between the samples.
pub fn load_history(
    law: ContactLaw,
    indenter: &Indenter,
    specimen: &Specimen,
    times_secs: &[f64],
    depths_mm: &[f64],
) -> Result<(PowerLaw, DepthHistory), LoadHistoryError> {
    // Refuses what is no depth before the law is asked.
    let history = DepthHistory::new(times_secs, depths_mm)?;
    let deepest = depths_mm.iter().copied().fold(0.0, f64::max);
    // Young's modulus is 2 (1 + nu) G.
    let young_over_shear = 2.0 * (1.0 + specimen.poisson_ratio.value);
    match LoadCurve::new(law, indenter, specimen, deepest)? {
        LoadCurve::Power { coefficient, exponent } => {
            Ok((PowerLaw::of_curve(young_over_shear * coefficient, exponent), history))
        }
        curve @ LoadCurve::Table(_) => {
            let loads: Vec<f64> = depths_mm.iter().map(|depth| curve.at(*depth)[0]).collect();
            let history = DepthHistory::new(times_secs, &loads)?;
            Ok((PowerLaw::of_curve(young_over_shear, 1.0), history))
        }
    }
}

/// Force over Young's modulus at a depth in mm, in mm², and its slope, in mm, which is what small motions about the depth feel.
pub fn load_and_slope(
    law: ContactLaw,
    indenter: &Indenter,
    specimen: &Specimen,
    depth_mm: f64,
) -> Result<[f64; 2], ContactError> {
    load_at(law, indenter, specimen, depth_mm)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::{PoissonBasis, Quantity};
    use crate::layer::Base;
    use crate::viscoelastic::{RelaxationMode, RelaxationModulus, lee_radok_force};

    fn exact(value: f64) -> Quantity {
        Quantity { value, standard_uncertainty: 0.0 }
    }

    fn specimen(thickness_mm: f64) -> Specimen {
        Specimen {
            thickness_mm: exact(thickness_mm),
            base: Base::Bonded,
            poisson_ratio: exact(0.45),
            poisson_basis: PoissonBasis::Assumed,
        }
    }

    /// A sphere on a half-space, deep: Sneddon's closed form over the contact radius, whose relaxation is summed here step by step.
    #[test]
    fn a_law_that_is_no_power_relaxes_by_its_own_force() {
        let (tip, modulus, time) = (4.0f64, 0.02, 0.5);
        let body = RelaxationModulus {
            equilibrium_mpa: 0.0,
            terms: vec![RelaxationMode { modulus_mpa: modulus, time_secs: time }],
            exponent: 1.0,
        };
        let steps = 20_000;
        let log = |radius: f64| ((tip + radius) / (tip - radius)).ln();
        let radius = |k: i32| 1.2 * f64::from(k) / f64::from(steps);
        let depths: Vec<f64> = (0..=steps).map(|k| 0.5 * radius(k) * log(radius(k))).collect();
        let times: Vec<f64> = (0..=steps).map(|k| 2e-4 * f64::from(k)).collect();
        let sphere = Indenter::Sphere { radius_mm: exact(tip) };
        let specimen = specimen(500.0);
        let (law, history) =
            load_history(ContactLaw::Sneddon, &sphere, &specimen, &times, &depths).unwrap();
        let forces = lee_radok_force(law, &body, &history).unwrap();
        let elastic = |k: i32| {
            let a = radius(k);
            // Over the shear modulus: twice 1 + nu over 1 - nu squared.
            2.0 / (1.0 - 0.45) * (0.5 * (a * a + tip * tip) * log(a) - a * tip)
        };
        let mut expected = 0.0;
        for k in 1..=steps {
            // The force that has come within a step has relaxed for half of it.
            expected *= (-2e-4 / time).exp();
            expected += modulus * (elastic(k) - elastic(k - 1)) * (-1e-4 / time).exp();
            if k % 4000 == 0 {
                let off = (forces[k as usize] / expected - 1.0).abs();
                assert!(off < 1e-5, "{k}: {off:e}");
            }
        }
    }

    /// Of a punch `4 R / (1 - nu)` over the shear modulus, at any depth.
    #[test]
    fn a_power_stays_one_and_its_slope_is_its_own() {
        let punch = Indenter::FlatPunch { radius_mm: exact(2.0) };
        let thick = specimen(600.0);
        let (law, _) =
            load_history(ContactLaw::Sneddon, &punch, &thick, &[0.0, 1.0], &[0.0, 0.1]).unwrap();
        assert_eq!(law.exponent(), 1.0);
        assert!((law.coefficient() / (8.0 / 0.55) - 1.0).abs() < 1e-12);
        let cone = Indenter::Cone { half_angle_degrees: exact(70.0) };
        let [_, slope] = load_and_slope(ContactLaw::Sneddon, &cone, &thick, 0.2).unwrap();
        let tangent = 70f64.to_radians().tan();
        let expected = 4.0 / std::f64::consts::PI * tangent * 0.2 / (1.0 - 0.45 * 0.45);
        assert!((slope / expected - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_the_law_does_not_describe_is_refused() {
        let sphere = Indenter::Sphere { radius_mm: exact(1.0) };
        let history = |depths: &[f64]| {
            let times: Vec<f64> = (0..depths.len()).map(|k| k as f64).collect();
            load_history(ContactLaw::Hertz, &sphere, &specimen(500.0), &times, depths).unwrap_err()
        };
        assert!(matches!(history(&[0.0, 0.3]), LoadHistoryError::Contact(_)));
        assert!(matches!(history(&[0.0, 0.0]), LoadHistoryError::Contact(_)));
        assert!(matches!(history(&[0.0, -0.1]), LoadHistoryError::History(_)));
    }
}
