//! The simulated master-slave system with every tick recorded, so that replay can compute it again.

use super::{Led, Live, Simulated, Ticking};
use palpate_haptics::simulation::SimulationTick;
use palpate_sessions::ticks::{Recorder, Row};

/// Columns of a recorded master-slave system: whole numbers, then others.
pub const COLUMNS: ([&str; 3], [&str; 5]) =
    (["tick", "elapsed", "state_hash"], ["depth_mm", "model_n", "force_n", "torque_nmm", "bias_v"]);

/// A recorded tick.
pub type TapedRow = Row<3, 5>;

/// Writes the ticks.
pub type TapeRecorder = Recorder<3, 5>;

/// What is recorded of a tick that came `elapsed` ticks after the one before; its hand goes where the settings say.
#[must_use]
pub fn taped_row(elapsed: u64, tick: &SimulationTick) -> TapedRow {
    let seen = &tick.snapshot;
    Row {
        whole: [seen.tick, elapsed, seen.sum()],
        real: [seen.depth.0, seen.model.0, seen.force.0, seen.torque, seen.bias.0],
    }
}

/// The device, and where its ticks are recorded, if they are.
#[derive(Debug)]
pub struct Taped {
    pub device: Simulated,
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

/// Columns of a recorded system whose hand was led from outside.
pub const LED_COLUMNS: ([&str; 3], [&str; 6]) =
    (COLUMNS.0, ["lead_mm", "depth_mm", "model_n", "force_n", "torque_nmm", "bias_v"]);

/// A recorded tick of it.
pub type LedRow = Row<3, 6>;

pub type LedRecorder = Recorder<3, 6>;

/// What is recorded of its newest tick, which came `elapsed` ticks after the one before.
#[must_use]
pub fn led_row(elapsed: u64, led: &Led) -> LedRow {
    let Row { whole, real } = taped_row(elapsed, &led.live().last);
    let [depth, model, force, torque, bias] = real;
    Row { whole, real: [led.place(), depth, model, force, torque, bias] }
}

/// The led device, and where its ticks are recorded, if they are.
#[derive(Debug)]
pub struct TapedLed {
    pub led: Led,
    pub recorder: Option<LedRecorder>,
}

impl Ticking for TapedLed {
    type View = Live;

    fn tick(&mut self, elapsed: u64) {
        self.led.tick(elapsed);
        if let Some(recorder) = &self.recorder {
            recorder.push(led_row(elapsed, &self.led));
        }
    }

    fn show(&self, view: &mut Live) {
        self.led.show(view);
    }
}
