//! What the fitted model says at the depth that the loop computed: numbers for colours.

use crate::legend::GrowingRange;

/// What colours of the model stand for.
///
/// There is no stress among them: a nominal stress needs the area of a contact, and the loop's stylus is a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelQuantity {
    /// The force in N at which a contact settles that stays at this depth.
    Force,
    /// How much that force grows for each mm, in N/mm.
    Stiffness,
}

impl ModelQuantity {
    /// What stands above the legend.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Force => "relaxed force at this depth (N)",
            Self::Stiffness => "stiffness at this depth (N/mm)",
        }
    }

    /// Of colours, before anything is touched: to a thousandth of the unit, so that a scene at rest has a legend.
    #[must_use]
    pub fn first_range(self) -> GrowingRange {
        GrowingRange::to(0.001)
    }
}

/// The relaxed force of a fitted model over depth `d` in mm: `mu1 d + mu2 d^2 + mu3 d^3` in N, none without contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ElasticModel {
    /// In N/mm, N/mm^2 and N/mm^3.
    pub mu: [f64; 3],
}

impl ElasticModel {
    /// Of several materials by their shares, as the loop blends their forces. Forces are linear in the coefficients, so the
    /// blend of coefficients is the blend of forces.
    #[must_use]
    pub fn blended(models: &[Self], shares: &[f64]) -> Self {
        let mut mu = [0.0; 3];
        for (model, share) in models.iter().zip(shares) {
            mu = [0, 1, 2].map(|power| mu[power] + share * model.mu[power]);
        }
        Self { mu }
    }

    /// At a depth in mm. Above the surface there is no force, and the stiffness is that of the first touch.
    #[must_use]
    pub fn at(&self, quantity: ModelQuantity, depth_mm: f64) -> f64 {
        let d = depth_mm.max(0.0);
        let [mu1, mu2, mu3] = self.mu;
        match quantity {
            ModelQuantity::Force => d * (mu1 + d * (mu2 + d * mu3)),
            ModelQuantity::Stiffness => mu1 + d * (2.0 * mu2 + 3.0 * d * mu3),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pig stomach, equation 3.5 of the thesis that this project implements.
    const STOMACH: ElasticModel = ElasticModel { mu: [0.05333, -0.0086, 0.0004345] };

    #[test]
    fn stiffness_is_the_slope_of_force() {
        for depth in [0.5, 3.0, 9.0, 20.0] {
            let step = 1e-4;
            let [low, high] = [-step, step].map(|by| STOMACH.at(ModelQuantity::Force, depth + by));
            let slope = (high - low) / (2.0 * step);
            // A central difference of a cubic errs by mu3 step^2, which is 4e-12.
            assert!((STOMACH.at(ModelQuantity::Stiffness, depth) - slope).abs() < 1e-10);
        }
        assert_eq!(STOMACH.at(ModelQuantity::Force, -2.0), 0.0);
        assert_eq!(STOMACH.at(ModelQuantity::Stiffness, -2.0), 0.05333);
        // By hand: 0.5333 - 0.86 + 0.4345.
        assert!((STOMACH.at(ModelQuantity::Force, 10.0) - 0.1078).abs() < 1e-12);
    }

    #[test]
    fn the_blend_of_models_is_the_blend_of_their_forces() {
        let hard = ElasticModel { mu: [0.4, 0.02, 0.0] };
        let blend = ElasticModel::blended(&[STOMACH, hard], &[0.3, 0.7]);
        for quantity in [ModelQuantity::Force, ModelQuantity::Stiffness] {
            let wanted = 0.3 * STOMACH.at(quantity, 4.0) + 0.7 * hard.at(quantity, 4.0);
            // Roundings of numbers around one.
            assert!((blend.at(quantity, 4.0) - wanted).abs() < 1e-15);
        }
    }
}
