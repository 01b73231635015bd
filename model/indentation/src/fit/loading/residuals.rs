//! What residuals that depend on each other do to a modulus.
//!
//! A law that misses a press leaves residuals that last over many samples, and the more samples are taken the less does the
//! textbook's error say of it. The residuals are described as white noise and a part that is forgotten over some time, as
//! those of every fit of palpate are.

use super::problem::{Found, LoadingProblem, UNKNOWNS};
use palpate_model::autocorrelation::{BlockedResiduals, memory};

/// About the largest number of blocks in which the residuals are summed.
const BLOCKS: usize = 400;

/// The noise of a modulus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ModulusNoise {
    pub mpa: f64,
    /// Degrees of freedom, for Student's t.
    pub freedom: f64,
}

/// The standard error that independent noise of a variance gives, or that of the residuals where they last and give more.
pub(super) fn modulus_noise(
    problem: &LoadingProblem<'_>,
    found: &Found,
    (variance, freedom): (f64, f64),
) -> ModulusNoise {
    let influence = problem.influence(found);
    let independent = variance * influence.iter().map(|one| one * one).sum::<f64>();
    let white = ModulusNoise { mpa: independent.sqrt(), freedom };
    let residuals = problem.residuals(found);
    let square = residuals.iter().map(|one| one * one).sum::<f64>() / residuals.len() as f64;
    // Residuals of rounding mean nothing.
    let forces = problem.samples.iter().map(|one| one.force_newtons * one.force_newtons);
    if square <= 1e-24 * forces.sum::<f64>() / residuals.len() as f64 {
        return white;
    }
    let length = residuals.len().div_ceil(BLOCKS);
    let over_root = 1.0 / (length as f64).sqrt();
    let sums = |values: &mut dyn Iterator<Item = f64>| -> Vec<f64> {
        let values: Vec<f64> = values.collect();
        values.chunks_exact(length).map(|block| over_root * block.iter().sum::<f64>()).collect()
    };
    let rows: Vec<[f64; UNKNOWNS]> =
        problem.samples.iter().map(|one| problem.row(&found.at, one.depth_mm).0).collect();
    let free = (0..UNKNOWNS).filter(|unknown| problem.is_free[*unknown]);
    let columns: Vec<Vec<f64>> =
        free.map(|unknown| sums(&mut rows.iter().map(|row| row[unknown]))).collect();
    let known = vec![true; columns.len()];
    let residuals = sums(&mut residuals.iter().copied());
    let blocks = BlockedResiduals {
        places: (0..residuals.len()).collect(),
        residuals,
        columns,
        length: length as f64,
    };
    let weights = sums(&mut influence.iter().copied());
    match memory(&blocks, &known, square) {
        Some(memory) if memory.neighbour > 0.0 => {
            let lasting = memory.quadratic(&weights, &blocks.places);
            if lasting <= independent {
                return white;
            }
            let freedom = freedom.min((2.0 / memory.uncertainty).max(1.0));
            ModulusNoise { mpa: lasting.sqrt(), freedom }
        }
        _ => white,
    }
}
