//! Shapes of indenters.

use std::f64::consts::{FRAC_PI_2, PI};

/// A rigid indenter with an axis of symmetry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum IndenterShape {
    /// The flat end of a cylinder.
    FlatPunch { radius_mm: f64 },
    /// A sphere that is large against the contact: its surface counts as a parabola (Hertz 1882).
    Parabola { radius_mm: f64 },
    /// A sphere at any depth up to its radius (Sneddon, Int. J. Eng. Sci. 3 (1965) 47-57).
    Sphere { radius_mm: f64 },
    /// A cone whose flank stands at this angle from its axis.
    Cone { half_angle_rad: f64 },
    /// A cone whose tip is a parabola of this radius, up to where that is as steep as the flank (Briscoe, Sebastian and Adams,
    /// J. Phys. D 27 (1994) 1156-1162).
    RoundedCone { half_angle_rad: f64, tip_radius_mm: f64 },
    /// The flat end of a cylinder of which a chamfer of 45 degrees has left a flat of the smaller radius.
    ChamferedPunch { flat_radius_mm: f64, radius_mm: f64 },
}

/// A contact at a depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Radius in mm of the circle in which indenter and specimen touch.
    pub radius_mm: f64,
    /// Force over Young's modulus, in mm².
    pub force_over_modulus: f64,
}

/// A flank that begins at a corner, seen from a radius beyond it.
struct Flank {
    /// Along the chord from the corner: the root of the difference of both radii's squares.
    chord: f64,
    /// Angle of the corner's radius.
    angle: f64,
}

impl Flank {
    fn at(radius: f64, corner: f64) -> Self {
        match radius > corner {
            true => Self {
                chord: (radius * radius - corner * corner).sqrt(),
                angle: (corner / radius).acos(),
            },
            false => Self { chord: 0.0, angle: 0.0 },
        }
    }
}

impl IndenterShape {
    /// What Abel's transform makes of the shape at a radius in mm, the depth of a half-space at that contact radius:
    /// `x` times the integral of `f'(s) / sqrt(x^2 - s^2)` from 0 to `x`, for a surface `f` above the tip (Sneddon, Int. J. Eng.
    /// Sci. 3 (1965) 47-57).
    pub(crate) fn taken(&self, radius: f64) -> f64 {
        let x = radius;
        match *self {
            Self::FlatPunch { .. } => 0.0,
            Self::Parabola { radius_mm } => x * x / radius_mm,
            Self::Sphere { radius_mm } => x * (x / radius_mm).atanh(),
            Self::Cone { half_angle_rad } => FRAC_PI_2 * x / half_angle_rad.tan(),
            Self::RoundedCone { half_angle_rad, tip_radius_mm } => {
                let slope = 1.0 / half_angle_rad.tan();
                let Flank { chord, angle } = Flank::at(x, tip_radius_mm * slope);
                x * ((x - chord) / tip_radius_mm + slope * angle)
            }
            Self::ChamferedPunch { flat_radius_mm, .. } => x * Flank::at(x, flat_radius_mm).angle,
        }
    }

    /// Force on a half-space at a contact radius in mm, over `E / (1 - nu^2)`, in mm²: twice the integral of
    /// `s^2 f'(s) / sqrt(a^2 - s^2)`. Not of a flat punch, whose force is in proportion to its depth.
    pub(crate) fn half_space_force(&self, radius: f64) -> f64 {
        let a = radius;
        match *self {
            Self::FlatPunch { .. } => f64::NAN,
            Self::Parabola { radius_mm } => 4.0 / 3.0 * a * a * a / radius_mm,
            Self::Sphere { radius_mm } => {
                (a * a + radius_mm * radius_mm) * (a / radius_mm).atanh() - a * radius_mm
            }
            Self::Cone { half_angle_rad } => FRAC_PI_2 * a * a / half_angle_rad.tan(),
            Self::RoundedCone { half_angle_rad, tip_radius_mm } => {
                let slope = 1.0 / half_angle_rad.tan();
                let corner = tip_radius_mm * slope;
                let Flank { chord, angle } = Flank::at(a, corner);
                let tip = 2.0 / 3.0 * a.powi(3) - a * a * chord + chord.powi(3) / 3.0;
                2.0 * tip / tip_radius_mm + slope * (a * a * angle + corner * chord)
            }
            Self::ChamferedPunch { flat_radius_mm, .. } => {
                let Flank { chord, angle } = Flank::at(a, flat_radius_mm);
                a * a * angle + flat_radius_mm * chord
            }
        }
    }

    /// Area in mm² of the shape at a height in mm above its tip; `None` above the equator of a sphere or a chamfer.
    pub(crate) fn area_at(&self, height: f64) -> Option<f64> {
        if height.is_nan() || height <= 0.0 {
            return None;
        }
        let radius = match *self {
            Self::FlatPunch { radius_mm } => radius_mm,
            Self::Parabola { radius_mm } => (2.0 * radius_mm * height).sqrt(),
            Self::Sphere { radius_mm } if height <= radius_mm => {
                (height * (2.0 * radius_mm - height)).sqrt()
            }
            Self::Sphere { .. } => return None,
            Self::Cone { half_angle_rad } => height * half_angle_rad.tan(),
            Self::RoundedCone { half_angle_rad, tip_radius_mm } => {
                let corner = tip_radius_mm / half_angle_rad.tan();
                match height < corner * corner / (2.0 * tip_radius_mm) {
                    true => (2.0 * tip_radius_mm * height).sqrt(),
                    false => 0.5 * corner + height * half_angle_rad.tan(),
                }
            }
            Self::ChamferedPunch { flat_radius_mm, radius_mm } => {
                Some(flat_radius_mm + height).filter(|radius| *radius <= radius_mm)?
            }
        };
        Some(PI * radius * radius)
    }

    /// The radius in mm behind which a flank begins.
    pub(crate) fn corner(&self) -> Option<f64> {
        match *self {
            Self::RoundedCone { half_angle_rad, tip_radius_mm } => {
                Some(tip_radius_mm / half_angle_rad.tan())
            }
            Self::ChamferedPunch { flat_radius_mm, .. } => Some(flat_radius_mm),
            _ => None,
        }
    }

    /// Contact radii in mm: the one at which the contact begins, and the one beyond which the shape ends.
    pub(crate) fn contact_radii(&self) -> [f64; 2] {
        match *self {
            Self::FlatPunch { radius_mm } => [radius_mm; 2],
            Self::Sphere { radius_mm } => [0.0, radius_mm],
            Self::ChamferedPunch { flat_radius_mm, radius_mm } => [flat_radius_mm, radius_mm],
            Self::Parabola { .. } | Self::Cone { .. } | Self::RoundedCone { .. } => {
                [0.0, f64::INFINITY]
            }
        }
    }
}
