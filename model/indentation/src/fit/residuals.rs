//! What residuals that depend on each other do to a modulus.
//!
//! A law that misses a press leaves residuals that last over many samples, and the more samples are taken the less does the
//! textbook's error say of it. The residuals are described as white noise and a part that is forgotten over some time, as
//! those of every fit of palpate are.

use palpate_model::autocorrelation::{BlockedResiduals, block_sums, memory};

/// Mean square of residuals over that of the forces that is rounding: 1e-12 of a force.
const ROUNDING: f64 = 1e-24;

/// The noise of a modulus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ModulusNoise {
    pub mpa: f64,
    /// Degrees of freedom, for Student's t.
    pub freedom: f64,
}

/// A fit around its solution, sample by sample.
pub(super) struct FittedSamples<'a> {
    pub forces: &'a [f64],
    pub residuals: &'a [f64],
    /// How a force changes with each unknown.
    pub columns: &'a [Vec<f64>],
    /// By how much the modulus rises with each force.
    pub influence: &'a [f64],
}

impl FittedSamples<'_> {
    /// The standard error that independent noise of a variance gives, or that of the residuals where they last and give more.
    pub fn modulus_noise(&self, (variance, freedom): (f64, f64)) -> ModulusNoise {
        let square_sum = |values: &[f64]| values.iter().map(|one| one * one).sum::<f64>();
        let independent = variance * square_sum(self.influence);
        let white = ModulusNoise { mpa: independent.sqrt(), freedom };
        if square_sum(self.residuals) <= ROUNDING * square_sum(self.forces) {
            return white;
        }
        let blocks = BlockedResiduals::of(self.residuals, self.columns);
        let alone = vec![true; self.columns.len()];
        let mean_square = square_sum(self.residuals) / self.residuals.len() as f64;
        match memory(&blocks, &alone, mean_square) {
            Some(memory) if memory.neighbour > 0.0 => {
                let lasting = memory.quadratic(&block_sums(self.influence), &blocks.places);
                if lasting <= independent {
                    return white;
                }
                let freedom = freedom.min((2.0 / memory.uncertainty).max(1.0));
                ModulusNoise { mpa: lasting.sqrt(), freedom }
            }
            _ => white,
        }
    }
}
