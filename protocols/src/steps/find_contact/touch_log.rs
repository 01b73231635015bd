//! What a contact search felt, averaged into points for the fit.

use palpate_model::rig::RigDescription;
use palpate_model::signal::TouchPoint;
use palpate_model::units::{Newtons, Position, Seconds};

/// Milliseconds averaged into one point: 50 points a second, in which the fastest approach goes 0.03 mm.
const POINT_MS: usize = 20;

/// Points kept of the way to the tissue, 5 s: they tell offset and drift.
const LEAD_POINTS: usize = 250;

/// Points of a search in progress.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TouchLog {
    start_tick: u64,
    tick: Seconds,
    /// Means in one point.
    point: u32,
    bin: Bin,
    points: Vec<TouchPoint>,
}

/// Milliseconds being averaged into one point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Bin {
    count: u32,
    t: f64,
    position: f64,
    force: f64,
    is_uncounted: bool,
}

/// Whether the force of a millisecond says something about the tissue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Counts {
    /// On the way to the tissue, of which only the end is kept.
    Lead,
    /// Like every later one.
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
            point: rig.means_in(POINT_MS) as u32,
            bin: Bin::default(),
            points: Vec::new(),
        }
    }

    pub fn push(&mut self, tick: u64, position: Position, force: Newtons, counts: Counts) {
        let bin = &mut self.bin;
        bin.count += 1;
        bin.t += tick.saturating_sub(self.start_tick) as f64 * self.tick.0;
        bin.position += position.0;
        bin.force += force.0;
        bin.is_uncounted |= counts == Counts::No;
        if bin.count < self.point {
            return;
        }
        let count = f64::from(bin.count);
        let force = (!bin.is_uncounted).then_some(Newtons(bin.force / count));
        self.points.push(TouchPoint {
            t: Seconds(bin.t / count),
            position: Position(bin.position / count),
            force,
        });
        *bin = Bin::default();
        if counts == Counts::Lead && self.points.len() >= 2 * LEAD_POINTS {
            self.points.drain(..LEAD_POINTS);
        }
    }

    pub fn points(&self) -> &[TouchPoint] {
        &self.points
    }
}
