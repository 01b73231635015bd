//! The past of a loop for plots.

use std::collections::VecDeque;

/// Past of a loop on the plots, in s.
pub const PAST_S: f64 = 10.0;

/// Between two readings of a loop's timing, in s: numbers that change faster cannot be read.
pub(super) const TIMING_S: f64 = 0.5;

/// Forgets the points, in order of their times in s, that are older at `now`.
pub(super) fn forget_old<T>(trail: &mut VecDeque<T>, now: f64, time: impl Fn(&T) -> f64) {
    let old = trail.partition_point(|point| time(point) < now - PAST_S);
    trail.drain(..old);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_older_than_the_past_are_dropped() {
        let mut trail: VecDeque<f64> = (0..40).map(f64::from).collect();
        forget_old(&mut trail, 35.0, |t| *t);
        assert!(trail.iter().copied().eq((25..40).map(f64::from)));
        forget_old(&mut trail, 35.0, |t| *t);
        assert_eq!(trail.len(), 15);
        forget_old(&mut trail, 1e9, |t| *t);
        assert!(trail.is_empty());
    }
}
