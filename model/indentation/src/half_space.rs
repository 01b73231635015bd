//! Indenters on a half-space, in closed form.

use crate::shape::{Contact, IndenterShape};
use std::f64::consts::{FRAC_PI_2, PI};

impl IndenterShape {
    /// The contact on a half-space at a depth in mm; `None` outside the law: a depth that is not above zero, or a sphere that
    /// touches beyond its equator.
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
            Self::Sphere { radius_mm } => {
                let contact = sphere_contact(radius_mm, depth_mm)?;
                let (a, r) = (contact, radius_mm);
                let log = ((r + a) / (r - a)).ln();
                (contact, 0.5 * (a * a + r * r) * log - a * r)
            }
            Self::Cone { half_angle_rad } => {
                let tangent = half_angle_rad.tan();
                (depth_mm * tangent / FRAC_PI_2, 2.0 / PI * tangent * depth_mm * depth_mm)
            }
        };
        Some(Contact { radius_mm, force_over_modulus: plane * force })
    }
}

/// The contact radius of a sphere: `depth = a / 2 ln((R + a) / (R - a))`, solved by halving, for it grows with `a`.
fn sphere_contact(radius: f64, depth: f64) -> Option<f64> {
    let depth_of = |a: f64| 0.5 * a * ((radius + a) / (radius - a)).ln();
    // So near to the equator the depth is beyond 18 radii.
    let mut high = radius * (1.0 - 1e-15);
    if radius.is_nan() || radius <= 0.0 || depth_of(high) < depth {
        return None;
    }
    let mut low = 0.0;
    while high - low > 1e-15 * radius {
        let middle = 0.5 * (low + high);
        if middle == low || middle == high {
            break;
        }
        if depth_of(middle) < depth { low = middle } else { high = middle }
    }
    Some(0.5 * (low + high))
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
}
