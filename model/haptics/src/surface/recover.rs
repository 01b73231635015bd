//! The way back to rest.
//!
//! Over a tick of `T` a displacement is multiplied by `exp(-T / tau)`, the exact solution of
//! `tau u' = -u`. Alone, that would never end, so the target is [`SETTLED_MM`] beyond the rest height
//! and the node stops at rest: its displacement is less than the exponential's by at most
//! `SETTLED_MM (1 - exp(-t / tau))` and zero after a finite time.
//!
//! Both keep neighbours within their limits: the first is a convex combination of two fields that are,
//! the second the lower or upper envelope of two fields that are.

use super::mesh::HeightField;
use crate::{SettingError, SettingRange};
use palpate_model::units::Seconds;
use palpate_rheology::vectors::run_wide;

/// How far beyond rest a recovering node aims, in mm: a nanometre, a ten-thousandth of what any
/// display or motor of this size resolves.
pub const SETTLED_MM: f64 = 1e-6;

/// Exponential return of displaced nodes, before the contacts of each tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceRecovery {
    /// Share of the way to rest in a tick.
    share: f64,
    /// SETTLED_MM times that.
    creep: f64,
}

impl SurfaceRecovery {
    /// At rest again at once: every tick starts from the rest surface, so that the shape depends on
    /// this tick's contacts alone.
    pub const ELASTIC: Self = Self { share: 1.0, creep: SETTLED_MM };
    pub const NONE: Self = Self { share: 0.0, creep: 0.0 };

    /// With a time constant, such as the `tau_eps` of the force model, at a constant tick.
    pub fn new(tau: Seconds, tick: Seconds) -> Result<Self, SettingError> {
        const RECOVERY: &str = "a recovery";
        let (tau, tick) = (tau.0, tick.0);
        SettingRange::Positive.check(RECOVERY, &[("tick", tick, " s")])?;
        SettingRange::MayBeInfinite.check(RECOVERY, &[("time constant", tau, " s")])?;
        // tau = 0 gives exp(-inf) = 0: elastic.
        let share = -(-tick / tau).exp_m1();
        Ok(Self { share, creep: share * SETTLED_MM })
    }

    /// Share of the way to rest that a node goes in a tick.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// A height one tick later.
    #[inline(always)]
    pub(crate) fn step(&self, now: f64, rest: f64) -> f64 {
        let free = now + self.share * (rest - now);
        // Comparisons rather than `min` and `max`, which would look for NaN where none can be.
        let (above, below) = (free + self.creep, free - self.creep);
        let up = if above < rest { above } else { rest };
        if up > below { up } else { below }
    }

    #[inline(always)]
    pub(super) fn step_row(&self, now: &mut [f64], rest: &[f64]) {
        for (now, &rest) in now.iter_mut().zip(rest) {
            *now = self.step(*now, rest);
        }
    }

    /// Moves everything displaced by one tick.
    pub(super) fn step_field(&self, field: &mut HeightField) {
        if *self == Self::NONE {
            return;
        }
        let columns = field.grid.columns();
        run_wide(
            #[inline(always)]
            || {
                for row in field.displaced.active_rows() {
                    let [from, to] = field.displaced.row(row);
                    if from < to {
                        let first = row * columns;
                        let now = &mut field.now[first..first + columns];
                        let rest = &field.rest[row * field.rest_stride..][..columns];
                        self.step_row(&mut now[from..to], &rest[from..to]);
                        field.displaced.set(row, trim_span(now, rest, [from, to]));
                    }
                }
            },
        );
        field.displaced.tighten();
        field.forget_bounds();
    }
}

/// The part of a span outside of which a row is at rest.
#[inline(always)]
pub(super) fn trim_span(now: &[f64], rest: &[f64], [mut from, mut to]: [usize; 2]) -> [usize; 2] {
    while from < to && now[from] == rest[from] {
        from += 1;
    }
    while from < to && now[to - 1] == rest[to - 1] {
        to -= 1;
    }
    [from, to]
}
