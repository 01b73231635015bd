//! Where to start: the sum of squares over a grid of all outer parameters, on the thinned records and
//! with a coarse member of the family where it has one.

use super::descent::{GAIN_THIN, GAIN_VALLEY, Place, descend, place};
use super::nonnegative::grown;
use super::problem::{Problem, Rows};
use crate::families::OuterRange;

/// Valleys followed.
const VALLEYS: usize = 4;
/// Grid values of a relaxation time when it is the only outer parameter, and beside others: two and
/// one in a factor of ten over a long record.
const TIMES: (usize, usize) = (32, 14);
/// Grid values of a curvature, of a ratio and of a share.
const OTHERS: [usize; 3] = [7, 4, 6];

/// The best place on the thinned records, or `None` where the family has no finite force at all.
pub(super) fn search(problem: &Problem<'_>) -> Option<Place> {
    let start = match problem.family.coarse() {
        Some(coarse) => place(problem, &valley(&problem.with(&*coarse))?.z, Rows::Thin)?,
        None => valley(problem)?,
    };
    Some(descend(problem, start, Rows::Thin, GAIN_THIN))
}

/// The deepest valley, not followed to its very floor.
fn valley(problem: &Problem<'_>) -> Option<Place> {
    let family = problem.family.outer();
    let times = family
        .iter()
        .filter(|one| one.range == OuterRange::Time)
        .count();
    // Several relaxation times would need a grid of their own each; they start from one dense series,
    // and evenly spread.
    if times > 1 {
        let &(low, high) = problem.ranges.first()?;
        let share = |i: usize| (i as f64 + 0.5) / times as f64;
        let even = (0..times).map(|i| low + (high - low) * share(i)).collect();
        let starts = grown(problem, times).into_iter().chain([even]);
        let starts = starts.filter_map(|z| place(problem, &z, Rows::Thin));
        return deepest(problem, starts);
    }
    let alone = family.len() == 1;
    let axes: Vec<Vec<f64>> = family
        .iter()
        .zip(&problem.ranges)
        .map(|(one, &(low, high))| {
            let count = match one.range {
                OuterRange::Time if alone => TIMES.0,
                OuterRange::Time => TIMES.1,
                OuterRange::PerDepth(..) => OTHERS[0],
                OuterRange::Ratio(..) => OTHERS[1],
                OuterRange::Share(..) => OTHERS[2],
            };
            (0..count)
                .map(|i| low + (high - low) * i as f64 / (count - 1) as f64)
                .collect()
        })
        .collect();
    let cells: usize = axes.iter().map(Vec::len).product();
    let at = |cell: usize| -> Vec<usize> {
        let mut rest = cell;
        axes.iter()
            .map(|axis| {
                let index = rest % axis.len();
                rest /= axis.len();
                index
            })
            .collect()
    };
    let places: Vec<Option<Place>> = (0..cells)
        .map(|cell| {
            let z: Vec<f64> = at(cell)
                .iter()
                .zip(&axes)
                .map(|(&index, axis)| axis[index])
                .collect();
            place(problem, &z, Rows::Thin)
        })
        .collect();
    let sum = |cell: usize| places[cell].as_ref().map_or(f64::INFINITY, |one| one.sum);
    // Cells that no neighbour along any axis undercuts.
    let mut valleys: Vec<usize> = (0..cells)
        .filter(|&cell| {
            let mut stride = 1;
            let index = at(cell);
            sum(cell).is_finite()
                && axes.iter().zip(index).all(|(axis, index)| {
                    let below = index == 0 || sum(cell) <= sum(cell - stride);
                    let above = index + 1 == axis.len() || sum(cell) <= sum(cell + stride);
                    stride *= axis.len();
                    below && above
                })
        })
        .collect();
    valleys.sort_by(|&a, &b| sum(a).total_cmp(&sum(b)));
    let starts = valleys.into_iter().take(VALLEYS);
    deepest(problem, starts.filter_map(|cell| places[cell].clone()))
}

/// The deepest floor below these starts; one whose coefficients the family allows, if there is any.
fn deepest(problem: &Problem<'_>, starts: impl Iterator<Item = Place>) -> Option<Place> {
    let is_refused = |place: &Place| {
        let mut coefficients = place.solution[..problem.coefficients].iter().enumerate();
        coefficients.any(|(k, &value)| value <= 0.0 && problem.family.is_non_negative(k))
    };
    starts
        .map(|start| descend(problem, start, Rows::Thin, GAIN_VALLEY))
        .min_by(|a, b| {
            let refused = is_refused(a).cmp(&is_refused(b));
            refused.then(a.sum.total_cmp(&b.sum))
        })
}
