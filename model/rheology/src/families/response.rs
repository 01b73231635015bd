//! The response of a sum of relaxation terms to any depth history.

use super::relaxation::{DepthPiece, RelaxationState, RelaxationTerm};
use palpate_model::units::{Depth, Seconds};
use palpate_model::viscoelastic::ContactPieces;
use thiserror::Error;

/// A number as people write it, by powers of ten where it would be a row of zeros.
pub(super) fn plain(value: &f64) -> String {
    let size = value.abs();
    if size == 0.0 || !value.is_finite() || (1e-6..1e9).contains(&size) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// A step that has no answer; the state is as it was before.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum StepError {
    #[error("a depth of {0} mm is not a finite number; give the depth of the probe in mm")]
    Depth(f64),
    #[error("a time step of {0} s is not possible; give zero or more seconds")]
    Time(f64),
    #[error(
        "a dashpot cannot move from {} mm to {} mm at once, because that takes an infinite force; give the move a duration", plain(.from), plain(.to)
    )]
    Jump { from: f64, to: f64 },
    #[error(
        "the speed of a move from {} mm to {} mm in {} s is too large to compute; give the move a longer time, or 0 s for a jump", plain(.from), plain(.to), plain(.dt)
    )]
    Speed { from: f64, to: f64, dt: f64 },
    #[error(
        "the force at rest at a depth of {} mm is too large to compute; check the unit of depth (mm) and the parameters of the model", plain(.depth)
    )]
    Rest { depth: f64 },
    #[error(
        "the force of a move from {} mm to {} mm in {} s is too large to compute; check the units of depth (mm) and the parameters of the model", plain(.from), plain(.to), plain(.dt)
    )]
    Overflow { from: f64, to: f64, dt: f64 },
}

/// Columns of terms that are moved together.
///
/// Depth moves straight between steps and the response is exact for that path, whatever the step
/// length. Depth below zero is out of contact and counts as zero; steps are cut exactly where the path
/// crosses the surface or, for terms that soften, the greatest depth so far.
#[derive(Clone, Debug)]
pub struct Response {
    terms: Vec<RelaxationState>,
    columns: Vec<usize>,
    depth: f64,
    depth_max: f64,
    softens: bool,
}

impl Response {
    /// Columns relaxed with the probe at `depth`: as if it had been held there for ever.
    #[must_use]
    pub fn new(columns: &[Vec<RelaxationTerm>], depth: Depth) -> Self {
        let start = depth.0.max(0.0);
        let terms: Vec<RelaxationState> =
            columns.iter().flatten().map(|term| RelaxationState::relaxed(*term, start)).collect();
        let softens = terms.iter().any(|one| one.softens);
        let owners = columns.iter().enumerate();
        Self {
            terms,
            columns: owners
                .flat_map(|(column, terms)| std::iter::repeat_n(column, terms.len()))
                .collect(),
            depth: depth.0,
            depth_max: start,
            softens,
        }
    }

    /// Sum of all terms, in the unit of their drives.
    pub fn sum(&self) -> f64 {
        self.terms.iter().map(RelaxationState::value).sum()
    }

    /// Adds each column's value to its slot.
    pub fn add_to(&self, slots: &mut [f64]) {
        for (term, &column) in self.terms.iter().zip(&self.columns) {
            slots[column] += term.value();
        }
    }

    /// Moves straight to `depth` within `dt`. On an error nothing has moved.
    pub fn step(&mut self, depth: Depth, dt: Seconds) -> Result<(), StepError> {
        let (from, to, dt) = (self.depth, depth.0, dt.0);
        if !to.is_finite() {
            return Err(StepError::Depth(to));
        }
        if !(dt >= 0.0 && dt.is_finite()) {
            return Err(StepError::Time(dt));
        }
        let (x0, x1) = (from.max(0.0), to.max(0.0));
        if dt == 0.0 {
            let ends = [x0, x1];
            let deepest = [self.depth_max, self.depth_max.max(x1)];
            for term in &mut self.terms {
                if !term.can_jump(ends, deepest) {
                    return Err(StepError::Jump { from, to });
                }
                if !term.prepare_jump(ends, deepest) {
                    return Err(StepError::Overflow { from, to, dt });
                }
            }
            self.terms.iter_mut().for_each(RelaxationState::settle_jump);
            self.arrive(to);
            return Ok(());
        }
        if !((to - from) / dt).is_finite() {
            return Err(StepError::Speed { from, to, dt });
        }
        if ContactPieces::of(from, to) == ContactPieces::Inside && !self.is_cut_by_softening(x0, x1)
        {
            let piece = self.piece(x0, x1 - x0, dt);
            return self.advance(&piece, [from, to, dt]).map(|()| self.arrive(to));
        }
        // A cut step either happens whole or not at all; cuts are rare, so a copy is cheap.
        let mut trial = self.clone();
        for (x0, x1, part) in trial.parts(from, to, dt) {
            if part > 0.0 {
                let piece = trial.piece(x0, x1 - x0, part);
                trial.advance(&piece, [from, to, dt])?;
            }
            trial.depth_max = trial.depth_max.max(x1);
        }
        trial.arrive(to);
        *self = trial;
        Ok(())
    }

    /// Moves as [`Response::step`] does and adds to each column's slot its mean over `count` samples
    /// evenly within the step, the last one at its end.
    pub(crate) fn step_mean(
        &mut self,
        depth: Depth,
        dt: Seconds,
        count: usize,
        slots: &mut [f64],
    ) -> Result<(), StepError> {
        if count <= 1 || dt.0 == 0.0 {
            self.step(depth, dt)?;
            self.add_to(slots);
            return Ok(());
        }
        let before: Vec<f64> = self.terms.iter().map(RelaxationState::value).collect();
        let (x0, x1) = (self.depth.max(0.0), depth.0.max(0.0));
        let piece = self.piece(x0, x1 - x0, dt.0);
        self.step(depth, dt)?;
        // Samples lie at the ends of their intervals: half a difference more than the integral.
        let share = 0.5 / count as f64;
        for ((term, &column), before) in self.terms.iter().zip(&self.columns).zip(before) {
            slots[column] += term.mean(before, &piece) + share * (term.value() - before);
        }
        Ok(())
    }

    fn arrive(&mut self, depth: f64) {
        self.depth = depth;
        self.depth_max = self.depth_max.max(depth);
    }

    fn is_cut_by_softening(&self, x0: f64, x1: f64) -> bool {
        self.softens && x0 < self.depth_max && x1 > self.depth_max
    }

    fn piece(&self, x0: f64, d: f64, dt: f64) -> DepthPiece {
        DepthPiece { x0, d, dt, x_max: self.depth_max, primary: d >= 0.0 && x0 >= self.depth_max }
    }

    /// The parts of a step, in depth in contact and time.
    fn parts(&self, from: f64, to: f64, dt: f64) -> Vec<(f64, f64, f64)> {
        let mut parts = match ContactPieces::of(from, to) {
            ContactPieces::Inside => vec![(from, to, dt)],
            ContactPieces::Outside => vec![(0.0, 0.0, dt)],
            ContactPieces::Entering([outside, inside]) => {
                vec![(0.0, 0.0, dt * outside), (0.0, to, dt * inside)]
            }
            ContactPieces::Leaving([inside, outside]) => {
                vec![(from, 0.0, dt * inside), (0.0, 0.0, dt * outside)]
            }
        };
        if let Some(&(x0, x1, time)) = parts.last()
            && self.is_cut_by_softening(x0, x1)
        {
            let known = (self.depth_max - x0) / (x1 - x0);
            let new = (x1 - self.depth_max) / (x1 - x0);
            parts.pop();
            parts.push((x0, self.depth_max, time * known));
            parts.push((self.depth_max, x1, time * new));
        }
        parts
    }

    #[inline]
    fn advance(&mut self, piece: &DepthPiece, [from, to, dt]: [f64; 3]) -> Result<(), StepError> {
        for term in &mut self.terms {
            if !term.prepare(piece) {
                return Err(StepError::Overflow { from, to, dt });
            }
        }
        self.terms.iter_mut().for_each(RelaxationState::settle);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::relaxation::{DepthDrive, RelaxationTerm};
    use super::*;

    /// A spring that softens, in series with a dashpot: what it lost relaxes like the rest.
    fn softening_maxwell(softens: bool) -> Response {
        let spring = DepthDrive {
            powers: [0.2, 0.01, 0.0, 0.0, 0.0],
            softening: if softens { [-0.1, 0.004, -1e-4] } else { [0.0; 3] },
            ..DepthDrive::default()
        };
        Response::new(&[vec![RelaxationTerm::maxwell(spring, 3.0)]], Depth(0.0))
    }

    /// Two ways of one path: in one step a piece, and in many. Depth over time is the same.
    #[test]
    fn a_rate_that_softens_is_cut_where_the_greatest_depth_is() {
        let path = [(2.0, 8.0), (1.0, 3.0), (1.5, -1.0), (2.5, 12.0), (1.0, 12.0), (0.5, 5.0)];
        for parts in [3u32, 64] {
            let (mut whole, mut cut) = (softening_maxwell(true), softening_maxwell(true));
            let mut before = 0.0;
            for (dt, to) in path {
                whole.step(Depth(to), Seconds(dt)).unwrap();
                for part in 1..=parts {
                    let share = f64::from(part) / f64::from(parts);
                    let depth = Depth(before + (to - before) * share);
                    cut.step(depth, Seconds(dt / f64::from(parts))).unwrap();
                }
                before = to;
                let miss = (whole.sum() - cut.sum()).abs();
                assert!(miss < 1e-13, "{to} in {parts}: {miss:e}");
            }
            assert_eq!(whole.depth_max, 12.0);
        }
    }

    /// Jumps see no relaxation, so the force is the spring's, whichever way depth was reached.
    #[test]
    fn jumps_change_by_what_the_spring_changes() {
        let mut body = softening_maxwell(true);
        let spring = |x: f64, x_max: f64| {
            let lost = (-0.1 * x + 0.004 * x * x - 1e-4 * x.powi(3)) * (1.0 - x / x_max);
            0.2 * x + 0.01 * x * x + lost
        };
        for (to, x_max) in [(8.0, 8.0), (3.0, 8.0), (12.0, 12.0), (6.0, 12.0)] {
            body.step(Depth(to), Seconds(0.0)).unwrap();
            assert!((body.sum() - spring(to, x_max)).abs() < 1e-14, "{to}");
        }
    }

    #[test]
    fn nothing_is_softened_on_first_loading() {
        let (mut soft, mut hard) = (softening_maxwell(true), softening_maxwell(false));
        for (dt, to) in [(1.0, 0.5), (2.0, 8.0), (1.0, 8.0), (0.0, 9.0), (1.0, 11.0)] {
            for body in [&mut soft, &mut hard] {
                body.step(Depth(to), Seconds(dt)).unwrap();
            }
            assert!((soft.sum() - hard.sum()).abs() < 1e-14, "{to}");
        }
        soft.step(Depth(6.0), Seconds(1.0)).unwrap();
        hard.step(Depth(6.0), Seconds(1.0)).unwrap();
        assert!(soft.sum() < hard.sum() - 0.1);
        // A greatest depth that cannot be divided by has softened nothing.
        let mut tiny = softening_maxwell(true);
        for depth in [5e-324, 0.0, 4.0] {
            tiny.step(Depth(depth), Seconds(1.0)).unwrap();
            assert!(tiny.sum().is_finite());
        }
    }
}
