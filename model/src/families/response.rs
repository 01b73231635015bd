//! The response of a sum of relaxation terms to any depth history.

use super::relaxation::{Piece, Relaxation, Relaxing};
use crate::units::{Depth, Seconds};
use crate::viscoelastic::Pieces;
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
    /// NaN or infinite depth.
    #[error("a depth of {0} mm is not a finite number; give the depth of the probe in mm")]
    Depth(f64),
    /// Negative, NaN or infinite duration.
    #[error("a time step of {0} s is not possible; time steps are zero or more seconds")]
    Time(f64),
    /// A dashpot moved in no time.
    #[error(
        "a dashpot cannot be moved from {} mm to {} mm in no time, which takes an infinite force; give the move a duration", plain(.from), plain(.to)
    )]
    Jump {
        /// Depth before, in mm.
        from: f64,
        /// Depth after, in mm.
        to: f64,
    },
    /// Faster than numbers go.
    #[error(
        "a move from {} mm to {} mm in {} s is faster than the largest number; give the move a longer time, or 0 s for a jump", plain(.from), plain(.to), plain(.dt)
    )]
    Speed {
        /// Depth before, in mm.
        from: f64,
        /// Depth after, in mm.
        to: f64,
        /// Duration in s.
        dt: f64,
    },
    /// The force at rest cannot be written as a number.
    #[error(
        "the force at rest at a depth of {} mm is beyond the largest number; check the unit of depth (mm) and the parameters of the body", plain(.depth)
    )]
    Rest {
        /// Depth in mm.
        depth: f64,
    },
    /// The force cannot be written as a number.
    #[error(
        "the force of a move from {} mm to {} mm in {} s is beyond the largest number; check the units of depth (mm) and the parameters of the body", plain(.from), plain(.to), plain(.dt)
    )]
    Overflow {
        /// Depth before, in mm.
        from: f64,
        /// Depth after, in mm.
        to: f64,
        /// Duration in s.
        dt: f64,
    },
}

/// Columns of terms that are moved together.
///
/// Depth moves straight between steps and the response is exact for that path, whatever the step
/// length. Depth below zero is out of contact and counts as zero; steps are cut exactly where the path
/// crosses the surface or, for terms that soften, the greatest depth so far.
#[derive(Clone, Debug)]
pub struct Response {
    terms: Vec<Relaxing>,
    /// Column of each term.
    columns: Vec<usize>,
    depth: f64,
    depth_max: f64,
    softens: bool,
}

impl Response {
    /// Columns relaxed with the probe at `depth`: as if it had been held there for ever.
    #[must_use]
    pub fn new(columns: &[Vec<Relaxation>], depth: Depth) -> Self {
        let start = depth.0.max(0.0);
        let terms: Vec<Relaxing> = columns
            .iter()
            .flatten()
            .map(|term| Relaxing::relaxed(*term, start))
            .collect();
        let softens = terms
            .iter()
            .any(|one| one.term.elastic.softens() || one.term.rate.softens());
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

    /// Depth at the end of the last step.
    #[must_use]
    pub fn depth(&self) -> Depth {
        Depth(self.depth)
    }

    /// Greatest depth so far.
    #[must_use]
    pub fn depth_max(&self) -> Depth {
        Depth(self.depth_max)
    }

    /// Sum of all terms, in the unit of their drives.
    #[must_use]
    pub fn sum(&self) -> f64 {
        self.terms.iter().map(Relaxing::value).sum()
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
            self.terms.iter_mut().for_each(Relaxing::settle_jump);
            self.arrive(to);
            return Ok(());
        }
        if !((to - from) / dt).is_finite() {
            return Err(StepError::Speed { from, to, dt });
        }
        if Pieces::of(from, to) == Pieces::Inside && !self.is_cut_by_softening(x0, x1) {
            let piece = self.piece(x0, x1 - x0, dt);
            return self
                .advance(&piece, [from, to, dt])
                .map(|()| self.arrive(to));
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
        let before: Vec<f64> = self.terms.iter().map(Relaxing::value).collect();
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

    fn piece(&self, x0: f64, d: f64, dt: f64) -> Piece {
        Piece {
            x0,
            d,
            dt,
            x_max: self.depth_max,
            primary: d > 0.0 && x0 >= self.depth_max,
        }
    }

    /// The parts of a step, in depth in contact and time.
    fn parts(&self, from: f64, to: f64, dt: f64) -> Vec<(f64, f64, f64)> {
        let mut parts = match Pieces::of(from, to) {
            Pieces::Inside => vec![(from, to, dt)],
            Pieces::Outside => vec![(0.0, 0.0, dt)],
            Pieces::Entering([outside, inside]) => {
                vec![(0.0, 0.0, dt * outside), (0.0, to, dt * inside)]
            }
            Pieces::Leaving([inside, outside]) => {
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
    fn advance(&mut self, piece: &Piece, [from, to, dt]: [f64; 3]) -> Result<(), StepError> {
        for term in &mut self.terms {
            if !term.prepare(piece) {
                return Err(StepError::Overflow { from, to, dt });
            }
        }
        self.terms.iter_mut().for_each(Relaxing::settle);
        Ok(())
    }
}
