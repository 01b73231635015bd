//! Indenters on a half-space, in closed form.

use crate::shape::{Contact, IndenterShape};
use std::f64::consts::{FRAC_PI_2, PI};

impl IndenterShape {
    /// The contact on a half-space at a depth in mm; `None` outside the law: a depth that is not above zero, or a sphere or a
    /// chamfer that touches beyond its end.
    #[must_use]
    pub fn on_half_space(&self, depth_mm: f64, poisson: f64) -> Option<Contact> {
        if depth_mm.is_nan() || depth_mm <= 0.0 {
            return None;
        }
        let plane = 1.0 / (1.0 - poisson * poisson);
        let (radius_mm, force) = match *self {
            Self::FlatPunch { radius_mm } => (radius_mm, 2.0 * radius_mm * depth_mm),
            Self::Parabola { radius_mm } => {
                let contact = (radius_mm * depth_mm).sqrt();
                (contact, 4.0 / 3.0 * contact * depth_mm)
            }
            Self::Cone { half_angle_rad } => {
                let tangent = half_angle_rad.tan();
                (depth_mm * tangent / FRAC_PI_2, 2.0 / PI * tangent * depth_mm * depth_mm)
            }
            Self::Sphere { .. } | Self::RoundedCone { .. } | Self::ChamferedPunch { .. } => {
                let contact = self.half_space_radius(depth_mm)?;
                (contact, self.half_space_force(contact))
            }
        };
        Some(Contact { radius_mm, force_over_modulus: plane * force })
    }

    /// The contact radius in mm, by halving, for the depth grows with it.
    fn half_space_radius(&self, depth: f64) -> Option<f64> {
        let [mut low, end] = self.contact_radii();
        // So near to the equator of a sphere the depth is beyond 18 radii.
        let mut high = if end.is_finite() { end * (1.0 - 1e-15) } else { depth };
        while self.taken(high) < depth {
            if end.is_finite() {
                return None;
            }
            high *= 2.0;
        }
        // A NaN has no contact either.
        if !(low < high && self.taken(high).is_finite()) {
            return None;
        }
        loop {
            let middle = 0.5 * (low + high);
            if middle == low || middle == high {
                return Some(middle);
            }
            if self.taken(middle) < depth { low = middle } else { high = middle }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_by_hand() {
        let at = |shape: IndenterShape, depth| shape.on_half_space(depth, 0.5).unwrap();
        // 1 / (1 - 0.25) = 4 / 3.
        let punch = at(IndenterShape::FlatPunch { radius_mm: 6.0 }, 2.0);
        assert!((punch.force_over_modulus - 32.0).abs() < 1e-12, "{punch:?}");
        let hertz = at(IndenterShape::Parabola { radius_mm: 4.0 }, 1.0);
        assert_eq!(hertz.radius_mm, 2.0);
        assert!((hertz.force_over_modulus - 32.0 / 9.0).abs() < 1e-12, "{hertz:?}");
        let cone = at(IndenterShape::Cone { half_angle_rad: 45f64.to_radians() }, 3.0);
        assert!((cone.force_over_modulus - 24.0 / PI).abs() < 1e-12, "{cone:?}");
        assert_eq!(IndenterShape::Parabola { radius_mm: 4.0 }.on_half_space(0.0, 0.5), None);
        assert_eq!(IndenterShape::Parabola { radius_mm: 4.0 }.on_half_space(f64::NAN, 0.5), None);
    }

    /// A shallow sphere is a parabola; the next term of the force is one tenth of the depth over the radius less.
    #[test]
    fn a_shallow_sphere_is_a_parabola() {
        for depth in [1e-2, 1e-3, 1e-4] {
            let sphere =
                IndenterShape::Sphere { radius_mm: 1.0 }.on_half_space(depth, 0.3).unwrap();
            let parabola = IndenterShape::Parabola { radius_mm: 1.0 };
            let parabola = parabola.on_half_space(depth, 0.3).unwrap();
            let share = sphere.force_over_modulus / parabola.force_over_modulus - 1.0;
            assert!((share / depth + 0.1).abs() < 0.01, "{depth}: {}", share / depth);
        }
    }

    /// The slope of the force over the depth is `2 E a / (1 - nu^2)` for every shape (Bulychev et al. 1975; Pharr, Oliver and
    /// Brotzen, J. Mater. Res. 7 (1992) 613-617).
    #[test]
    fn stiffness_is_that_of_the_contact_radius() {
        for shape in [
            IndenterShape::FlatPunch { radius_mm: 2.0 },
            IndenterShape::Parabola { radius_mm: 2.0 },
            IndenterShape::Sphere { radius_mm: 2.0 },
            IndenterShape::Cone { half_angle_rad: 1.2 },
            IndenterShape::RoundedCone { half_angle_rad: 1.2, tip_radius_mm: 0.8 },
            IndenterShape::RoundedCone { half_angle_rad: 1.2, tip_radius_mm: 20.0 },
            IndenterShape::ChamferedPunch { flat_radius_mm: 2.0, radius_mm: 4.0 },
        ] {
            let (depth, step) = (0.7, 1e-5);
            let force = |depth| shape.on_half_space(depth, 0.4).unwrap().force_over_modulus;
            let slope = (force(depth + step) - force(depth - step)) / (2.0 * step);
            let radius = shape.on_half_space(depth, 0.4).unwrap().radius_mm;
            let expected = 2.0 * radius / (1.0 - 0.4 * 0.4);
            // A central difference of a smooth law over 1e-5 mm, and the rounding of a force of about 3 over it.
            assert!((slope / expected - 1.0).abs() < 1e-8, "{shape:?}: {slope} {expected}");
        }
    }

    /// Sneddon's integrals of the profile's slope, by Gauss's rule over the sine of an angle, in pieces up to the corner.
    #[test]
    fn corners_are_those_of_the_integrals() {
        let slope_of = |shape: IndenterShape, s: f64| match shape {
            IndenterShape::RoundedCone { half_angle_rad, tip_radius_mm } => {
                (s / tip_radius_mm).min(1.0 / half_angle_rad.tan())
            }
            IndenterShape::ChamferedPunch { flat_radius_mm, .. } => {
                if s > flat_radius_mm {
                    1.0
                } else {
                    0.0
                }
            }
            other => panic!("{other:?} has no corner"),
        };
        for (shape, corner) in [
            (
                IndenterShape::RoundedCone { half_angle_rad: 1.1, tip_radius_mm: 0.8 },
                0.8 / 1.1f64.tan(),
            ),
            (IndenterShape::ChamferedPunch { flat_radius_mm: 1.5, radius_mm: 3.0 }, 1.5),
        ] {
            for radius in [1.6, 1.9, 2.7] {
                let turn = (corner / radius).asin();
                let pieces = [(0.0, turn), (turn, FRAC_PI_2)];
                let integral = |of: &dyn Fn(f64) -> f64| -> f64 {
                    let piece = |(from, to): (f64, f64)| -> f64 {
                        let nodes = crate::quadrature::gauss_legendre(40, to - from);
                        nodes
                            .iter()
                            .map(|(at, weight)| weight * of(radius * (from + at).sin()))
                            .sum()
                    };
                    pieces.into_iter().map(piece).sum()
                };
                let depth = radius * integral(&|s| slope_of(shape, s));
                let force = 2.0 * integral(&|s| s * s * slope_of(shape, s));
                assert!((shape.taken(radius) / depth - 1.0).abs() < 1e-12, "{shape:?} {radius}");
                let found = shape.half_space_force(radius);
                assert!((found / force - 1.0).abs() < 1e-12, "{shape:?} {radius}");
                let contact = shape.on_half_space(depth, 0.0).unwrap();
                assert!((contact.radius_mm - radius).abs() < 1e-9, "{shape:?} {contact:?}");
            }
        }
    }

    /// A tip without radius is a cone, one as wide as the contact a parabola, and a chamfer without a flat a cone of 45 degrees.
    #[test]
    fn corners_at_an_end_are_the_simple_shapes() {
        let force =
            |shape: IndenterShape| shape.on_half_space(0.3, 0.4).unwrap().force_over_modulus;
        let cone = IndenterShape::Cone { half_angle_rad: 1.2 };
        let sharp = IndenterShape::RoundedCone { half_angle_rad: 1.2, tip_radius_mm: 1e-9 };
        assert!((force(sharp) / force(cone) - 1.0).abs() < 1e-8);
        let blunt = IndenterShape::RoundedCone { half_angle_rad: 1.2, tip_radius_mm: 5.0 };
        let parabola = IndenterShape::Parabola { radius_mm: 5.0 };
        assert!((force(blunt) / force(parabola) - 1.0).abs() < 1e-12);
        let pointed = IndenterShape::ChamferedPunch { flat_radius_mm: 1e-9, radius_mm: 3.0 };
        let steep = IndenterShape::Cone { half_angle_rad: 45f64.to_radians() };
        assert!((force(pointed) / force(steep) - 1.0).abs() < 1e-8);
        let narrow = IndenterShape::ChamferedPunch { flat_radius_mm: 2.0, radius_mm: 2.01 };
        assert_eq!(narrow.on_half_space(0.3, 0.4), None);
    }
}
