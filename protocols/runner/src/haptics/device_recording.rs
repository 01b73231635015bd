//! The simulated master-slave system with every tick recorded, so that replay can compute it again.

use super::{GuidedDevice, GuidedDeviceView, LoopTask, SimulatedMasterSlave};
use palpate_haptics::simulation::SimulationTick;
use palpate_sessions::ticks::{TickRecorder, TickRow};

/// Columns of a recorded master-slave system: whole numbers, then others.
pub const COLUMNS: ([&str; 3], [&str; 5]) =
    (["tick", "elapsed", "state_hash"], ["depth_mm", "model_n", "force_n", "torque_nmm", "bias_v"]);

/// A recorded tick.
pub type DeviceRow = TickRow<3, 5>;

/// Writes the ticks.
pub type DeviceRecorder = TickRecorder<3, 5>;

/// What is recorded of a tick that came `elapsed` ticks after the one before; its hand goes where the settings say.
#[must_use]
pub fn device_row(elapsed: u64, tick: &SimulationTick) -> DeviceRow {
    let seen = &tick.snapshot;
    TickRow {
        whole: [seen.tick, elapsed, seen.sum()],
        real: [seen.depth.0, seen.model.0, seen.force.0, seen.torque, seen.bias.0],
    }
}

/// The device, and where its ticks are recorded, if they are.
#[derive(Debug)]
pub struct RecordedDevice {
    pub device: SimulatedMasterSlave,
    pub recorder: Option<DeviceRecorder>,
}

impl LoopTask for RecordedDevice {
    type View = SimulationTick;

    fn tick(&mut self, elapsed: u64) {
        self.device.tick(elapsed);
        if let Some(recorder) = &self.recorder {
            recorder.push(device_row(elapsed, self.device.last()));
        }
    }

    fn show(&self, view: &mut SimulationTick) {
        self.device.show(view);
    }
}

/// Columns of a recorded system whose hand was led from outside.
pub const GUIDED_COLUMNS: ([&str; 3], [&str; 6]) =
    (COLUMNS.0, ["lead_mm", "depth_mm", "model_n", "force_n", "torque_nmm", "bias_v"]);

/// A recorded tick of it.
pub type GuidedDeviceRow = TickRow<3, 6>;

pub type GuidedDeviceRecorder = TickRecorder<3, 6>;

/// What is recorded of its newest tick, which came `elapsed` ticks after the one before.
#[must_use]
pub fn guided_device_row(elapsed: u64, led: &GuidedDevice) -> GuidedDeviceRow {
    let TickRow { whole, real } = device_row(elapsed, &led.view().last);
    let [depth, model, force, torque, bias] = real;
    TickRow { whole, real: [led.place(), depth, model, force, torque, bias] }
}

/// The led device, and where its ticks are recorded, if they are.
#[derive(Debug)]
pub struct RecordedGuidedDevice {
    pub device: GuidedDevice,
    pub recorder: Option<GuidedDeviceRecorder>,
}

impl LoopTask for RecordedGuidedDevice {
    type View = GuidedDeviceView;

    fn tick(&mut self, elapsed: u64) {
        self.device.tick(elapsed);
        if let Some(recorder) = &self.recorder {
            recorder.push(guided_device_row(elapsed, &self.device));
        }
    }

    fn show(&self, view: &mut GuidedDeviceView) {
        self.device.show(view);
    }
}
