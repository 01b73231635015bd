//! A record in a few hundred rows, for searching and judging; nothing is reported from it.
//!
//! Blocks of samples grow geometrically from every corner of the path, because every relaxation
//! begins at a corner: so the shortest and the longest relaxation time stay visible. The mean of a column over a
//! block needs no samples, since a relaxation is known from its ends.

use super::sample::FitSample;

/// Long blocks in a record, about.
const BLOCKS: usize = 250;
/// Rows that may be spent on refinement at corners.
const CORNER_ROWS: usize = 1500;
/// Blocks of one length after a corner before the length doubles.
const PER_OCTAVE: usize = 6;
/// Tolerance of redrawing, as a share of the greatest depth.
const TOLERANCE_SHARE: f64 = 0.002;
/// The tolerance grows to the height of measured stairs, but not beyond this share.
const TOLERANCE_SHARE_MAX: f64 = 0.01;
/// Median size of the second difference of independent noise, in its standard deviations
/// (0.6745 times the root of six).
const BEND_MEDIAN: f64 = 1.65;
/// Standard deviations of depth noise that the redrawn path may cut off: those of a stray sample and of
/// the one a piece begins at.
const NOISES: f64 = 8.0;
/// Moves looked at to find the height of stairs.
const MOVES: usize = 4000;

/// Samples that are taken together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Block {
    pub count: usize,
    /// Time from the sample before the block to its last sample, in s.
    pub dt: f64,
    /// Depth at its last sample, in mm.
    pub depth: f64,
    /// The same on the redrawn path.
    pub redrawn: f64,
    /// Mean force in N by weight, and the root of the sum of weights.
    pub force: f64,
    pub weight: f64,
}

/// The thinned record. The first block is the first sample alone and takes no time.
#[derive(Clone, Debug)]
pub(super) struct Thin {
    pub blocks: Vec<Block>,
}

impl Thin {
    /// Thins a record whose forces weigh by their sigma over `sigma_scale`.
    pub fn new(samples: &[FitSample], depth_mm: f64, sigma_scale: f64) -> Self {
        let knots = redraw(samples, tolerance(samples, depth_mm));
        let corners = corners(samples, &knots);
        let longest = samples.len().div_ceil(BLOCKS);
        let octaves = longest.ilog2() as usize + 1;
        let per_octave = (CORNER_ROWS / (knots.len() * octaves)).min(PER_OCTAVE);
        let mut blocks = Vec::with_capacity(BLOCKS + CORNER_ROWS);
        let mut start = 0;
        let mut piece = 0;
        for &corner in &corners {
            let (mut length, mut of_length) = (if per_octave == 0 { longest } else { 1 }, 0);
            // Block after block from the sample after a corner up to the next corner.
            while start <= corner {
                let end = if start == 0 { 1 } else { start + length };
                let end = end.min(corner + 1);
                while knots[piece + 1].index + 1 < end {
                    piece += 1;
                }
                let line = (&knots[piece], &knots[piece + 1]);
                blocks.push(block(samples, start..end, sigma_scale, line));
                start = end;
                of_length += 1;
                if of_length == per_octave {
                    (length, of_length) = ((2 * length).min(longest), 0);
                }
            }
        }
        Self { blocks }
    }
}

fn block(
    samples: &[FitSample],
    range: std::ops::Range<usize>,
    sigma_scale: f64,
    (knot, next): (&Knot, &Knot),
) -> Block {
    let last = &samples[range.end - 1];
    let before = &samples[range.start.saturating_sub(1)];
    let count = range.len();
    let (mut sum, mut weights) = (0.0, 0.0);
    for sample in &samples[range] {
        if sample.is_measured() {
            let weight = (sigma_scale / sample.sigma.0).powi(2);
            sum += weight * sample.force.0;
            weights += weight;
        }
    }
    let share = (last.t.0 - knot.t) / (next.t - knot.t);
    Block {
        count,
        dt: last.t.0 - before.t.0,
        depth: last.depth.0,
        redrawn: knot.depth + share * (next.depth - knot.depth),
        force: if weights > 0.0 { sum / weights } else { 0.0 },
        weight: weights.sqrt(),
    }
}

/// A corner of the redrawn path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Knot {
    pub index: usize,
    pub t: f64,
    pub depth: f64,
}

/// The path in few straight pieces, each as long as all its samples stay within `tolerance` mm: a
/// cone of slopes from its start, narrowed sample by sample. Stairs and noise vanish; ramps, holds
/// and corners stay. At least two knots for at least two samples.
pub(super) fn redraw(samples: &[FitSample], tolerance: f64) -> Vec<Knot> {
    let knot = |index: usize, depth: f64| Knot { index, t: samples[index].t.0, depth };
    let mut knots = vec![knot(0, samples[0].depth.0)];
    let mut anchor = knots[0];
    let mut cone = (f64::NEG_INFINITY, f64::INFINITY);
    let mut index = 1;
    while index < samples.len() {
        let over_run = 1.0 / (samples[index].t.0 - anchor.t);
        let rise = samples[index].depth.0 - anchor.depth;
        let narrowed =
            (cone.0.max((rise - tolerance) * over_run), cone.1.min((rise + tolerance) * over_run));
        let is_last = index + 1 == samples.len();
        if narrowed.0 <= narrowed.1 {
            cone = narrowed;
            index += 1;
            if !is_last {
                continue;
            }
        }
        // The piece ends at the sample before `index`.
        let end = index - 1;
        let slope = 0.5 * (cone.0 + cone.1);
        anchor = knot(end, anchor.depth + slope * (samples[end].t.0 - anchor.t));
        knots.push(anchor);
        cone = (f64::NEG_INFINITY, f64::INFINITY);
    }
    knots
}

/// Where the path bends, more exactly than the knots of the redrawn path, which come late: the
/// sample farthest from the chord between the neighbouring bends (Douglas & Peucker, Cartographica
/// 10 (1973) 112-122). The last sample ends the list.
fn corners(samples: &[FitSample], knots: &[Knot]) -> Vec<usize> {
    let mut corners = Vec::with_capacity(knots.len());
    let mut from = 0;
    for pair in knots[1..].windows(2) {
        let to = pair[1].index;
        let (a, b) = (&samples[from], &samples[to]);
        let slope = (b.depth.0 - a.depth.0) / (b.t.0 - a.t.0);
        let mut farthest = (0.0, pair[0].index);
        for (index, sample) in samples[..to].iter().enumerate().skip(from + 1) {
            let off = (sample.depth.0 - a.depth.0 - slope * (sample.t.0 - a.t.0)).abs();
            if off > farthest.0 {
                farthest = (off, index);
            }
        }
        from = farthest.1;
        corners.push(from);
    }
    corners.push(samples.len() - 1);
    corners
}

/// How far the redrawn path may leave the measured one, in mm.
pub(super) fn tolerance(samples: &[FitSample], depth_mm: f64) -> f64 {
    let stride = samples.len().div_ceil(MOVES);
    let mut moves: Vec<f64> = samples
        .windows(2)
        .step_by(stride)
        .map(|pair| (pair[1].depth.0 - pair[0].depth.0).abs())
        .filter(|&step| step > 0.0)
        .collect();
    let stair = if moves.is_empty() {
        0.0
    } else {
        let middle = moves.len() / 2;
        *moves.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let mut bends: Vec<f64> = samples
        .windows(3)
        .step_by(stride)
        .map(|three| (three[2].depth.0 - 2.0 * three[1].depth.0 + three[0].depth.0).abs())
        .collect();
    let noise = if bends.is_empty() {
        0.0
    } else {
        let middle = bends.len() / 2;
        *bends.select_nth_unstable_by(middle, f64::total_cmp).1 / BEND_MEDIAN
    };
    (1.5 * stair)
        .max(NOISES * noise)
        .max(TOLERANCE_SHARE * depth_mm)
        .min(TOLERANCE_SHARE_MAX * depth_mm)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::units::{Depth, Newtons, Seconds};

    fn stairs() -> Vec<FitSample> {
        (0..=6000)
            .map(|i| {
                let t = f64::from(i) * 1e-2;
                let path = (0.75 * t).min(30.0);
                FitSample {
                    t: Seconds(t),
                    depth: Depth((path / 0.015).floor() * 0.015),
                    force: Newtons(f64::from(i)),
                    sigma: Newtons(1.0),
                }
            })
            .collect()
    }

    #[test]
    fn stairs_become_a_ramp_and_corners_stay() {
        let samples = stairs();
        let knots = redraw(&samples, tolerance(&samples, 30.0));
        assert!((3..=5).contains(&knots.len()), "{knots:?}");
        let inner = &knots[1..knots.len() - 1];
        assert!(inner.iter().any(|knot| (knot.t - 40.0).abs() < 0.3), "{knots:?}");
        for block in Thin::new(&samples, 30.0, 1.0).blocks {
            // Eight times what the second differences of such stairs look like as noise.
            assert!((block.depth - block.redrawn).abs() < 0.075);
        }
    }

    #[test]
    fn no_sample_is_lost_or_counted_twice() {
        let samples = stairs();
        let thin = Thin::new(&samples, 30.0, 1.0);
        let count: usize = thin.blocks.iter().map(|block| block.count).sum();
        assert_eq!(count, samples.len());
        let force: f64 = thin.blocks.iter().map(|b| b.force * b.weight * b.weight).sum();
        assert!((force - 6000.0 * 6001.0 / 2.0).abs() < 1e-6);
        let time: f64 = thin.blocks.iter().map(|block| block.dt).sum();
        assert!((time - 60.0).abs() < 1e-9);
        assert!(thin.blocks.len() < 1200, "{}", thin.blocks.len());
    }
}
