//! A device in use, as the scene's loop has it: the same for each of them.

use crate::figures::{DeviceFigures, RoundTrip};
use crate::hand_over::{DeviceMonitor, SceneEnd};
use palpate_haptics::margin::LoopDevice;
use palpate_haptics::scene::{DeviceSettings, Pose};
use palpate_haptics::{HapticDevice, Period};

/// A device in use. Dropping it sends zero force and lets the connection go.
#[derive(Debug)]
pub struct LinkedDevice {
    scene: SceneEnd,
    round_trip: RoundTrip,
    loop_device: LoopDevice,
}

impl LinkedDevice {
    /// A device whose thread runs and whose round trips were measured with zero force.
    pub(crate) fn new(
        scene: SceneEnd,
        figures: &DeviceFigures,
        round_trip: RoundTrip,
        period: Period,
    ) -> Self {
        let loop_device = figures.loop_device(&scene.settings, &round_trip, period);
        Self { scene, round_trip, loop_device }
    }

    /// Round trips measured at the start.
    #[must_use]
    pub fn round_trip(&self) -> RoundTrip {
        self.round_trip
    }

    /// What the margin before play needs, with this device's delay.
    #[must_use]
    pub fn loop_device(&self) -> LoopDevice {
        self.loop_device
    }

    /// A look at it for another thread.
    #[must_use]
    pub fn monitor(&self) -> DeviceMonitor {
        self.scene.monitor.clone()
    }
}

impl HapticDevice for LinkedDevice {
    fn settings(&self) -> &DeviceSettings {
        &self.scene.settings
    }

    fn sense(&mut self, elapsed: u64) -> Pose {
        self.scene.sense(elapsed)
    }

    fn give(&mut self, force: [f64; 3]) {
        self.scene.give(force);
    }
}
