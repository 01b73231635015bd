//! Cycles and phases of a record without phase labels, from its depth alone.

use super::CycleSample;
use palpate_model::rig::Phase;
use palpate_model::units::{Depth, Newtons, Seconds};

/// The depth has to come below and above these shares of its range for a cycle to count.
const LOW: f64 = 0.3;
const HIGH: f64 = 0.7;
/// Within this share of the range of its greatest depth a cycle holds.
const HOLD: f64 = 0.005;

/// Divides a record into cycles, each of loading, a hold where the depth stays within half a percent of its greatest, and
/// unloading. A cycle begins where the depth is least before it rises through most of its range.
#[must_use]
pub fn split_by_depth(t: &[f64], depth: &[f64], force: &[f64]) -> Vec<CycleSample> {
    let low = depth.iter().copied().fold(f64::INFINITY, f64::min);
    let high = depth.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let range = high - low;
    let starts = starts(depth, low + LOW * range, low + HIGH * range);
    let mut all = Vec::with_capacity(depth.len());
    for (k, &start) in starts.iter().enumerate() {
        let end = starts.get(k + 1).copied().unwrap_or(depth.len());
        let part = &depth[start..end];
        let top = part.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let is_held = |x: &f64| *x >= top - HOLD * range;
        // Loading ends at the greatest depth it reaches, not where the band of the hold begins.
        let arrival = part.iter().position(is_held).unwrap_or(0);
        let late = part.iter().rposition(is_held).unwrap_or(0);
        let turn = (arrival..=late)
            .take_while(|&i| i == arrival || part[i] > part[i - 1])
            .last()
            .unwrap_or(arrival);
        // Nor does unloading begin where it leaves the band.
        let leaving = (turn + 1..=late).rev().find(|&i| part[i] >= part[i - 1]).unwrap_or(turn);
        for (i, &x) in part.iter().enumerate() {
            let phase = match i {
                _ if i <= turn => Phase::Ramp,
                _ if i <= leaving => Phase::Hold,
                _ => Phase::Unload,
            };
            all.push(CycleSample {
                t: Seconds(t[start + i]),
                depth: Depth(x),
                force: Newtons(force[start + i]),
                phase,
                cycle: k as u32 + 1,
                step: 0,
            });
        }
    }
    all
}

fn starts(depth: &[f64], low: f64, high: f64) -> Vec<usize> {
    let mut starts = Vec::new();
    // The least depth since the last cycle was deep.
    let mut least = 0;
    let mut is_deep = false;
    for (i, &x) in depth.iter().enumerate() {
        if is_deep {
            if x < low {
                is_deep = false;
                least = i;
            }
        } else if x >= high {
            is_deep = true;
            starts.push(least);
        } else if x <= depth[least] {
            least = i;
        }
    }
    starts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_and_holds_are_split_into_phases() {
        // In to 10 mm, hold, back, rest, in to 10 mm and back at once.
        let mut depth: Vec<f64> = (0..=100).map(|i| 0.1 * f64::from(i)).collect();
        depth.extend([10.0; 50]);
        depth.extend((0..100).map(|i| 9.9 - 0.1 * f64::from(i)));
        depth.extend([0.0; 30]);
        depth.extend((1..=100).map(|i| 0.1 * f64::from(i)));
        depth.extend((0..100).map(|i| 9.9 - 0.1 * f64::from(i)));
        let t: Vec<f64> = (0..depth.len()).map(|i| i as f64).collect();
        let all = split_by_depth(&t, &depth, &depth);
        let count = |cycle: u32, phase: Phase| {
            all.iter().filter(|one| one.cycle == cycle && one.phase == phase).count()
        };
        assert_eq!(all.len(), depth.len());
        assert_eq!([count(1, Phase::Ramp), count(1, Phase::Hold)], [101, 50]);
        // The rest belongs to the cycle before, up to the last of the least depths.
        assert_eq!(count(1, Phase::Unload), 129);
        assert_eq!([count(2, Phase::Ramp), count(2, Phase::Hold)], [101, 0]);
        assert_eq!(count(2, Phase::Unload), 100);
        assert!(split_by_depth(&[], &[], &[]).is_empty());
        assert!(split_by_depth(&[0.0, 1.0], &[f64::NAN; 2], &[0.0; 2]).is_empty());
    }
}
