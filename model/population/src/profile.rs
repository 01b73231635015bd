//! Ends of intervals, where the lowest criterion at a coordinate has risen so far.

use crate::search::{Criterion, Optimum};
use nalgebra::{Cholesky, DVector};

/// Places that are tried for an end: as many threefold steps lead beyond any scale.
const TRIALS_MAX: usize = 60;
/// An end is right to this share of itself: three digits are printed.
const END_TOLERANCE: f64 = 1e-3;
/// The next place is this many times as far from the best, at least and at most, until the criterion has risen enough.
const GROWTH: (f64, f64) = (1.1, 3.0);
/// How far the first place is from the best, in logarithms, at least and at most.
const FIRST: (f64, f64) = (0.01, 2.0);
/// The smallest first place of an upper end, over the scale of the coordinate.
const FIRST_MIN: f64 = 0.1;
/// A coordinate below this share of its scale is tried as zero.
const ZERO: f64 = 1e-4;

/// The lowest criterion over one coordinate, the others being found at each of its values.
pub(crate) struct Profile<'a> {
    criterion: &'a Criterion<'a>,
    optimum: &'a Optimum,
    kept: usize,
    /// Root of the rise at the ends. Near the best the root of a rise grows evenly, so that secants of it soon end.
    root_limit: f64,
    /// How the coordinates follow the kept one near the best.
    tangent: Vec<f64>,
    /// Half of the interval by the curvature at the best.
    half: f64,
}

impl<'a> Profile<'a> {
    pub fn of(criterion: &'a Criterion<'a>, optimum: &'a Optimum, kept: usize, limit: f64) -> Self {
        let curvature = &optimum.curvature;
        let unit = DVector::from_fn(curvature.nrows(), |k, _| f64::from(u8::from(k == kept)));
        let column = Cholesky::new(curvature.clone()).map(|factor| factor.solve(&unit));
        let column = column.unwrap_or(unit);
        let tangent = (&column / column[kept]).iter().copied().collect();
        let half = (2.0 * limit * column[kept]).sqrt();
        Self { criterion, optimum, kept, root_limit: limit.sqrt(), tangent, half }
    }

    /// The places below and above the best where the criterion has risen by the limit: zero where it has not risen so far
    /// there, none where it never does.
    pub fn ends(&self) -> [Option<f64>; 2] {
        let best = self.optimum.at[self.kept].abs();
        // The logarithm of a standard deviation is nearer to a normal distribution.
        let apart = (self.half / best.max(ZERO)).clamp(FIRST.0, FIRST.1);
        [self.end(best, best * (-apart).exp()), self.end(best, best.max(FIRST_MIN) * apart.exp())]
    }

    /// The end towards `first`, by secants of the root of the rise, where the end that stays counts half (the Illinois method of
    /// Dowell & Jarratt, BIT 11 (1971) 168-174).
    fn end(&self, best: f64, first: f64) -> Option<f64> {
        let mut places = self.optimum.at.clone();
        let (mut inside, mut outside) = ((best, -self.root_limit), None::<(f64, f64)>);
        let (mut at, mut side) = (first, None);
        for _ in 0..TRIALS_MAX {
            if at < ZERO {
                if outside.is_some_and(|(place, _)| place == 0.0) {
                    return Some(0.0);
                }
                at = 0.0;
            }
            let value = self.root_rise(at, &mut places) - self.root_limit;
            if at == 0.0 && value <= 0.0 {
                return Some(0.0);
            }
            let is_outside = value > 0.0;
            let share = if side == Some(is_outside) { 0.5 } else { 1.0 };
            side = Some(is_outside);
            match &mut outside {
                Some(other) if !is_outside => (inside, other.1) = ((at, value), share * other.1),
                None if !is_outside => inside = (at, value),
                _ => (outside, inside.1) = (Some((at, value)), share * inside.1),
            }
            let next = match outside {
                None => {
                    let growth = self.root_limit / (value + self.root_limit);
                    best + (at - best) * growth.clamp(GROWTH.0, GROWTH.1)
                }
                Some((place, value)) if value.is_finite() => {
                    inside.0 + (place - inside.0) * inside.1 / (inside.1 - value)
                }
                Some((place, _)) => 0.5 * (inside.0 + place),
            };
            if outside.is_some() && (next - at).abs() <= 0.5 * END_TOLERANCE * next {
                return Some(next);
            }
            at = next;
        }
        None
    }

    /// Root of how far the lowest criterion at a value of the coordinate is above that of all; `places` are all coordinates at
    /// the last value, and then at this one.
    fn root_rise(&self, value: f64, places: &mut Vec<f64>) -> f64 {
        let by = value - places[self.kept];
        let mut start: Vec<f64> =
            places.iter().zip(&self.tangent).map(|(at, follows)| at + by * follows).collect();
        start[self.kept] = value;
        match self.criterion.profile(&start, self.kept, &self.optimum.curvature) {
            Some((criterion, at)) => {
                *places = at;
                (criterion - self.optimum.evaluation.criterion).max(0.0).sqrt()
            }
            None => f64::INFINITY,
        }
    }
}
