//! The tissue the probe meets: a surface somewhere, and behind it the thesis's viscoelastic body.
//!
//! Depth is taken as straight between two ticks, for which the body's step is exact, also in the
//! tick of first contact. Tissue pushes and cannot pull: where the body's force would be negative
//! the probe has lifted off and the cell feels nothing, while the body goes on relaxing.

use super::random::Random;
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_model::{Depth, Newtons, Position, Seconds};

/// Where the surface is on average, in mm from home; the specimen box stands there.
const SURFACE_MM: f64 = 41.0;
/// The specimen is clipped by hand: its surface is up to this far from [`SURFACE_MM`].
const SURFACE_SPREAD_MM: f64 = 2.0;
/// Standard deviation of stiffness between specimens, relative.
const STIFFNESS_SPREAD: f64 = 0.05;
/// Standard deviation of the two time constants between specimens, relative.
const TIME_SPREAD: f64 = 0.03;

/// One specimen.
#[derive(Clone, Debug)]
pub struct Tissue {
    surface: Position,
    body: ModifiedKelvin,
    state: KelvinState,
    force: Newtons,
}

impl Tissue {
    /// A specimen drawn around the thesis's identified body (its equation 3.5).
    pub fn new(random: &mut Random) -> Self {
        let surface = SURFACE_MM + random.between(-SURFACE_SPREAD_MM, SURFACE_SPREAD_MM);
        let stiffness = random.around_one(STIFFNESS_SPREAD);
        let (relaxation, viscosity) = (
            random.around_one(TIME_SPREAD),
            random.around_one(TIME_SPREAD),
        );
        let thesis = ModifiedKelvin::THESIS;
        Self {
            surface: Position(surface),
            body: ModifiedKelvin {
                tau_eps: thesis.tau_eps * relaxation,
                mu: thesis.mu.map(|mu| mu * stiffness),
                // N*s/mm^2: a force coefficient with a time constant in it.
                tau_sig: thesis.tau_sig * stiffness * viscosity,
            },
            // The probe powers up far outside; the first step places it.
            state: KelvinState::at_rest_from(Depth(-SURFACE_MM)),
            force: Newtons(0.0),
        }
    }

    /// True position of the surface.
    pub fn surface(&self) -> Position {
        self.surface
    }

    /// The body's true parameters.
    pub fn body(&self) -> ModifiedKelvin {
        self.body
    }

    /// Force on the probe at the newest tick; never negative.
    pub fn force(&self) -> Newtons {
        self.force
    }

    /// The probe has moved straight to a true position in a time step; returns the force there.
    pub fn advance(&mut self, probe: Position, dt: Seconds) -> Newtons {
        let force = self
            .state
            .step(&self.body, probe.depth_from(self.surface), dt);
        self.force = Newtons(force.0.max(0.0));
        self.force
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::Cause;
    use super::*;

    #[test]
    fn specimens_differ_within_their_spread() {
        let mut surfaces = Vec::new();
        let mut stiffness = Vec::new();
        for seed in 0..400 {
            let tissue = Tissue::new(&mut Random::new(seed, Cause::Tissue));
            assert!((39.0..=43.0).contains(&tissue.surface().0));
            surfaces.push(tissue.surface().0);
            stiffness.push(tissue.body().mu[0] / ModifiedKelvin::THESIS.mu[0] - 1.0);
        }
        let spread = |values: &[f64]| {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
        };
        // Uniform over 4 mm: 4 / sqrt(12). Tolerances are about four standard errors of 400 draws.
        assert!((spread(&surfaces) - 4.0 / 12f64.sqrt()).abs() < 0.11);
        assert!((spread(&stiffness) - 0.05).abs() < 0.008);
    }

    #[test]
    fn a_fast_retreat_lifts_off_and_never_pulls() {
        let mut tissue = Tissue::new(&mut Random::new(1, Cause::Tissue));
        let surface = tissue.surface();
        let dt = Seconds(0.001);
        let mut deepest: f64 = 0.0;
        for i in 0..10_000 {
            let force = tissue.advance(surface.moved_by(0.001 * f64::from(i)), dt);
            deepest = deepest.max(force.0);
        }
        assert!(deepest > 0.1);
        let mut lifted_off_in_depth = false;
        for i in (0..500).rev() {
            let force = tissue.advance(surface.moved_by(0.02 * f64::from(i)), dt);
            assert!(force.0 >= 0.0);
            lifted_off_in_depth |= i > 0 && force.0 == 0.0;
        }
        assert!(lifted_off_in_depth);
        assert_eq!(tissue.advance(Position(0.0), dt), Newtons(0.0));
    }
}
