//! Forces of a contact search, averaged into points for the fit.

use crate::engine::BlockMean;
use palpate_model::rig::RigDescription;
use palpate_model::signal::ContactSearchPoint;
use palpate_model::units::{Newtons, Position, Seconds};

/// Milliseconds averaged into one point: 50 points a second, in which the fastest approach goes 0.03 mm.
const POINT_MS: usize = 20;

/// Points kept of the way to the tissue, 5 s: they tell offset and drift.
const LEAD_POINTS: usize = 250;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct TouchLog {
    start_tick: u64,
    tick: Seconds,
    /// Time in s, position in mm and force in N of the point in progress.
    point: BlockMean<3>,
    is_uncounted: bool,
    points: Vec<ContactSearchPoint>,
}

/// Whether the force of a millisecond says something about the tissue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ForceUse {
    /// On the way to the tissue, of which only the end is kept.
    Lead,
    Yes,
    /// The path matters, the force does not.
    No,
}

impl TouchLog {
    pub fn new(start_tick: u64, rig: &RigDescription) -> Self {
        Self {
            start_tick,
            tick: rig.tick(),
            // Twenty at most.
            point: BlockMean::new(rig.means_in(POINT_MS) as u32),
            is_uncounted: false,
            points: Vec::new(),
        }
    }

    pub fn push(&mut self, tick: u64, position: Position, force: Newtons, counts: ForceUse) {
        let t = tick.saturating_sub(self.start_tick) as f64 * self.tick.0;
        self.is_uncounted |= counts == ForceUse::No;
        let Some([t, position, force]) = self.point.push([t, position.0, force.0]) else {
            return;
        };
        let force = (!std::mem::take(&mut self.is_uncounted)).then_some(Newtons(force));
        self.points.push(ContactSearchPoint { t: Seconds(t), position: Position(position), force });
        if counts == ForceUse::Lead && self.points.len() >= 2 * LEAD_POINTS {
            self.points.drain(..LEAD_POINTS);
        }
    }

    pub fn points(&self) -> &[ContactSearchPoint] {
        &self.points
    }
}
