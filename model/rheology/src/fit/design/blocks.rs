//! The columns of [`super`] over the blocks of a thinned record.

use super::super::thin::Block;
use super::super::triangle::{Factor, Triangle};
use super::{Coefficients, Columns, LINEAR_COUNT, Scale};

/// The six columns and the mean force over each block of a thinned record as one triangle, for one relaxation time. The
/// mean of a filtered column needs no samples: integrating `f + tau f' = x^k` gives
/// `mean f = mean x^k - tau (f_end - f_start) / dt`.
pub(in super::super) fn thin_factor(blocks: &[Block], scale: Scale, tau: f64) -> Factor {
    let mut triangle = Triangle::new(LINEAR_COUNT + 1);
    let Some(first) = blocks.first() else {
        return triangle.finish();
    };
    let mut from = scale.of(first.depth);
    let mut columns = Columns::<false>::new(tau, from);
    let mut before = columns.row();
    for block in blocks {
        let to = scale.of(block.depth);
        if block.dt > 0.0 {
            columns.advance(to, block.dt);
        }
        let after = columns.row();
        let row = if block.count == 1 {
            after
        } else {
            mean([from.max(0.0), to.max(0.0)], [&before, &after], block, tau)
        };
        (before, from) = (after, to);
        if block.weight > 0.0 {
            let [f1, f2, f3, g, e, one] = row;
            let (second, third) = (2.0 * f2 - f1, 6.0 * (f3 - f2) + f1);
            triangle.push(&[f1, second, third, g, e, one, block.force], block.weight);
        }
    }
    triangle.finish()
}

/// Means over a block of the bare columns, from their values before and at its end. The sum over
/// samples is at the end of every interval, hence half a difference more than the integral.
fn mean([x0, x1]: [f64; 2], [before, after]: [&[f64; 6]; 2], block: &Block, tau: f64) -> [f64; 6] {
    let settled = [
        (x0 + x1) / 2.0,
        (x0 * x0 + x0 * x1 + x1 * x1) / 3.0,
        (x0 + x1) * (x0 * x0 + x1 * x1) / 4.0,
        (x1 + x0) * (x1 - x0) / (2.0 * block.dt),
        0.0,
    ];
    let share = 0.5 / block.count as f64 - tau / block.dt;
    let mut row = [1.0; 6];
    for (k, settled) in settled.into_iter().enumerate() {
        row[k] = settled + share * (after[k] - before[k]);
    }
    row
}

/// Visits the ends of blocks on the redrawn path with bare columns and the slope by `log tau`.
pub(in super::super) fn visit_redrawn(
    blocks: &[Block],
    scale: Scale,
    tau: f64,
    at: &Coefficients,
    visit: &mut impl FnMut(&Block, &[f64]),
) {
    let Some(first) = blocks.first() else { return };
    let mut columns = Columns::<true>::new(tau, scale.of(first.redrawn));
    let mut row = [0.0; LINEAR_COUNT + 1];
    for block in blocks {
        if block.dt > 0.0 {
            columns.advance(scale.of(block.redrawn), block.dt);
        }
        row[..LINEAR_COUNT].copy_from_slice(&columns.row());
        row[LINEAR_COUNT] = columns.tau_slope(at);
        visit(block, &row);
    }
}
