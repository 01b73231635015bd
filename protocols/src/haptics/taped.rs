//! The simulated master-slave system with every tick recorded, so that it can be computed again.

use super::{Simulated, Ticking};
use palpate_model::haptics::simulation::SimulationTick;
use palpate_sessions::ticks::{Recorder, Row};

/// Columns of a recorded master-slave system: whole numbers, then others.
pub const COLUMNS: ([&str; 3], [&str; 5]) = (
    ["tick", "elapsed", "state_hash"],
    ["depth_mm", "model_n", "force_n", "torque_nmm", "bias_v"],
);

/// A recorded tick.
pub type TapedRow = Row<3, 5>;

/// Writes the ticks.
pub type TapeRecorder = Recorder<3, 5>;

/// What is recorded of a tick that came `elapsed` ticks after the one before; its hand goes where the settings say.
#[must_use]
pub fn taped_row(elapsed: u64, told: &SimulationTick) -> TapedRow {
    let seen = &told.snapshot;
    Row {
        whole: [seen.tick, elapsed, seen.sum()],
        real: [
            seen.depth.0,
            seen.model.0,
            seen.force.0,
            seen.torque,
            seen.bias.0,
        ],
    }
}

/// The device, and where its ticks are recorded, if they are.
#[derive(Debug)]
pub struct Taped {
    /// The device.
    pub device: Simulated,
    /// Its recording.
    pub recorder: Option<TapeRecorder>,
}

impl Ticking for Taped {
    type View = SimulationTick;

    fn tick(&mut self, elapsed: u64) {
        self.device.tick(elapsed);
        if let Some(recorder) = &self.recorder {
            recorder.push(taped_row(elapsed, self.device.last()));
        }
    }

    fn show(&self, view: &mut SimulationTick) {
        self.device.show(view);
    }
}
