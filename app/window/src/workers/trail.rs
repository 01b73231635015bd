//! The past of a loop as it was seen, for plots and for looks at how it keeps its time.

use std::collections::VecDeque;

/// How much of the past is kept for the plots, in s.
pub const PAST_S: f64 = 10.0;

/// Between two looks at how a loop keeps its time, in s: numbers that change faster cannot be read.
pub(super) const LOOK_S: f64 = 0.5;

/// Forgets the points, in order of their times in s, that are older at `now` than is kept.
pub(super) fn forget_old<T>(trail: &mut VecDeque<T>, now: f64, time: impl Fn(&T) -> f64) {
    let kept = trail.partition_point(|point| time(point) < now - PAST_S);
    trail.drain(..kept);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_as_old_as_is_kept_stays_and_what_is_older_goes() {
        let mut trail: VecDeque<f64> = (0..40).map(f64::from).collect();
        forget_old(&mut trail, 35.0, |t| *t);
        assert!(trail.iter().copied().eq((25..40).map(f64::from)));
        forget_old(&mut trail, 35.0, |t| *t);
        assert_eq!(trail.len(), 15);
        forget_old(&mut trail, 1e9, |t| *t);
        assert!(trail.is_empty());
    }
}
