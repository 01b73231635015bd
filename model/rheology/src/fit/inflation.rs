//! By how much autocorrelated residuals widen a standard error.

use super::triangle::{Factor, Triangle};
use palpate_model::autocorrelation::{BlockedResiduals, Memory};

/// The triangle of the block columns, for the influence of blocks on a parameter.
pub(super) fn triangle<'b>(
    blocks: impl Iterator<Item = &'b BlockedResiduals>,
    unknowns: usize,
) -> Triangle {
    let mut triangle = Triangle::new(unknowns + 1);
    let mut row = vec![0.0; unknowns + 1];
    for blocks in blocks {
        for b in 0..blocks.residuals.len() {
            for (slot, column) in row.iter_mut().zip(&blocks.columns) {
                *slot = column[b];
            }
            row[unknowns] = blocks.residuals[b];
            triangle.push(&row, 1.0);
        }
    }
    triangle
}

/// Degrees of freedom of a variance whose logarithm has this variance, no more than there are spare samples.
pub(super) fn freedom(spare: f64, uncertainty: f64) -> f64 {
    if uncertainty > 0.0 { spare.min((2.0 / uncertainty).max(1.0)) } else { spare }
}

/// Variance of a combination of unknowns under the memories found over that under independent
/// noise of variance `white`, and the variance of its logarithm; `factor` is the [`triangle`].
pub(super) fn inflation(
    records: &[(BlockedResiduals, Option<Memory>, f64)],
    factor: &Factor,
    combination: &[f64],
    white: f64,
) -> (f64, f64) {
    let influence = factor.influence(combination);
    let (mut with, mut without, mut uncertain) = (0.0, 0.0, 0.0);
    for (blocks, memory, own) in records {
        let weights: Vec<f64> = (0..blocks.residuals.len())
            .map(|b| {
                let shares = influence.iter().zip(&blocks.columns);
                shares.map(|(share, column)| share * column[b]).sum()
            })
            .collect();
        let memory = memory.unwrap_or_else(|| Memory::none(*own));
        let part = memory.quadratic(&weights, &blocks.places);
        with += part;
        without += white * weights.iter().map(|z| z * z).sum::<f64>();
        uncertain += memory.uncertainty * part * part;
    }
    let inflation = with / without;
    if inflation.is_finite() { (inflation.max(1.0), uncertain / (with * with)) } else { (1.0, 0.0) }
}
