//! The factor of Hayes, Keer, Herrmann and Mockros (J. Biomech. 5 (1972) 541-551) for a layer on a rigid base.

use crate::layer::{Layer, LayerError};
use std::f64::consts::PI;

/// What a layer adds to the contact of a given radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HayesFactor {
    /// `kappa` of `force = 2 E a kappa depth / (1 - nu^2)`. On a thick layer it is 1 for a flat punch and 2/3 for a sphere.
    pub kappa: f64,
    /// Depth times tip radius over the square of the contact radius: 1 for a sphere on a thick layer, `None` for a punch, whose
    /// contact radius is its own.
    pub depth_ratio: Option<f64>,
}

impl Layer {
    /// The factor of a flat punch of this radius in mm, to 1e-6 of the integral equation.
    pub fn punch_factor(&self, radius_mm: f64) -> Result<HayesFactor, LayerError> {
        self.check()?;
        self.check_radius(radius_mm)?;
        Ok(self.factor_of_punch(1, radius_mm / self.thickness_mm))
    }

    /// The factor of a sphere, taken as a parabola, that touches within this contact radius in mm, to 1e-6 of the integral
    /// equation.
    pub fn sphere_factor(&self, contact_radius_mm: f64) -> Result<HayesFactor, LayerError> {
        self.check()?;
        self.check_radius(contact_radius_mm)?;
        Ok(self.factor_of_sphere(1, contact_radius_mm / self.thickness_mm))
    }

    // The equation is one for a half-space where the integral of its solution is 2 / pi.
    fn factor_of_punch(&self, finer: usize, ratio: f64) -> HayesFactor {
        let solved = self.solve(finer, ratio, 0.0, |_| 0.0);
        HayesFactor { kappa: 0.5 * PI * solved.depth[0], depth_ratio: None }
    }

    fn factor_of_sphere(&self, finer: usize, ratio: f64) -> HayesFactor {
        let solved = self.solve(finer, ratio, 0.0, |x| x * x);
        // The edge without pressure fixes the depth of this radius.
        let depth_ratio = solved.shape[1] / solved.depth[1];
        let kappa = 0.5 * PI * (solved.depth[0] - solved.shape[0] / depth_ratio);
        HayesFactor { kappa, depth_ratio: Some(depth_ratio) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layer::Base;

    fn layer(poisson: f64) -> Layer {
        Layer { thickness_mm: 1.0, poisson, base: Base::Bonded }
    }

    fn kappa(ratio: f64, poisson: f64) -> f64 {
        layer(poisson).punch_factor(ratio).unwrap().kappa
    }

    const RATIOS: [f64; 15] =
        [0.2, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0];

    /// The two columns of the authors' table for a flat punch that public reprints carry; the others were not to be found and
    /// are not judged. The authors solved the equation with few nodes: what they miss grows with the radius over the thickness.
    #[test]
    fn published_table_is_met_where_the_contact_is_no_wider_than_the_layer_is_thick() {
        let half = [
            1.281, 1.683, 2.211, 2.855, 3.609, 5.970, 9.069, 13.00, 17.86, 23.74, 30.75, 48.47,
            71.75, 101.27, 137.7,
        ];
        let less = [
            1.252, 1.599, 2.031, 2.532, 3.085, 4.638, 6.380, 8.265, 10.26, 12.32, 14.45, 18.80,
            23.23, 27.69, 32.15,
        ];
        for (poisson, column) in [(0.5, half), (0.45, less)] {
            for (ratio, published) in RATIOS.into_iter().zip(column) {
                let excess = kappa(ratio, poisson) / published - 1.0;
                let (low, high) = if ratio <= 1.0 { (-5e-4, 3e-3) } else { (0.0, 0.065) };
                assert!((low..high).contains(&excess), "{poisson} {ratio}: {excess}");
            }
        }
    }

    /// A thin incompressible layer flows aside: lubrication theory gives `kappa = 3 pi / 64 (a / h)^3`, and the edge adds a
    /// multiple of the thickness to the radius, which is of the fourth power in the force. It shows who is right where the
    /// table and the equation part: with the table's values the multiple falls again.
    #[test]
    fn wide_punch_on_an_incompressible_layer_follows_lubrication_theory() {
        let edge = |ratio: f64, kappa: f64| {
            ratio * ((kappa / (3.0 * PI / 64.0 * ratio.powi(3))).powf(0.25) - 1.0)
        };
        let [two, four, eight] = [2.0, 4.0, 8.0].map(|ratio| edge(ratio, kappa(ratio, 0.5)));
        assert!(two < four && four < eight, "{two} {four} {eight}");
        // What is left halves with the thickness.
        assert!((eight - four) / (four - two) < 0.6, "{two} {four} {eight}");
        assert!(edge(8.0, 137.7) < edge(4.0, 30.75));
    }

    #[test]
    fn twice_the_nodes_change_less_than_one_part_in_a_million() {
        for poisson in [0.0, 0.3, 0.49, 0.5] {
            for ratio in [0.2, 1.0, 3.0, 8.0] {
                let layer = layer(poisson);
                let both = [
                    [layer.factor_of_punch(1, ratio), layer.factor_of_punch(2, ratio)],
                    [layer.factor_of_sphere(1, ratio), layer.factor_of_sphere(2, ratio)],
                ];
                for [one, two] in both {
                    assert!((one.kappa / two.kappa - 1.0).abs() < 1e-8, "{one:?} {two:?}");
                }
            }
        }
    }

    #[test]
    fn thick_layer_has_the_factors_of_a_half_space() {
        let punch = layer(0.3).punch_factor(1e-7).unwrap();
        assert!((punch.kappa - 1.0).abs() < 1e-6, "{punch:?}");
        let sphere = layer(0.3).sphere_factor(1e-7).unwrap();
        assert!((sphere.kappa - 2.0 / 3.0).abs() < 1e-6, "{sphere:?}");
        assert!((sphere.depth_ratio.unwrap() - 1.0).abs() < 1e-6, "{sphere:?}");
    }

    /// The contact that is solved for its depth has the factors of its radius.
    #[test]
    fn factor_of_a_sphere_is_that_of_its_contact() {
        use crate::shape::IndenterShape;
        let (layer, radius_mm) = (layer(0.4), 20.0);
        let contact = layer.contact(IndenterShape::Parabola { radius_mm }, 0.05).unwrap();
        let factor = layer.sphere_factor(contact.radius_mm).unwrap();
        let depth = factor.depth_ratio.unwrap() * contact.radius_mm.powi(2) / radius_mm;
        assert!((depth / 0.05 - 1.0).abs() < 1e-9, "{depth}");
        let force = 2.0 / (1.0 - 0.16) * contact.radius_mm * factor.kappa * depth;
        assert!((force / contact.force_over_modulus - 1.0).abs() < 1e-9, "{force}");
    }

    #[test]
    fn radius_outside_of_the_equation_is_refused_in_words() {
        let message = |radius| layer(0.5).punch_factor(radius).unwrap_err().to_string();
        assert_eq!(message(0.0), "the radius is 0; give a length above 0 mm");
        assert_eq!(message(f64::INFINITY), "the radius is inf; give a length above 0 mm");
        assert!(message(9.0).contains("8 times the thickness"), "{}", message(9.0));
        assert!(layer(f64::NAN).sphere_factor(1.0).is_err());
    }
}
