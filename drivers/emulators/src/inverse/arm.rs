//! The arm: the simulated device of the scene, with a hand that swings.

use palpate_haptics::scene::{DeviceSettings, HandPose, SimulatedDevice};
use palpate_haptics::{Period, SettingError};
use palpate_model::Nanos;
use std::f64::consts::TAU;

/// Step of the simulation: a quarter of a millisecond, some parts of an exchange.
const STEP: Nanos = Nanos(250_000);
/// Middle of the reach in mm from the base, as in the reports of Haply's pages.
pub const MIDDLE_FROM_BASE_MM: [f64; 3] = [0.0, -120.0, 150.0];

/// Mechanics of an arm, and the hand on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmSettings {
    /// Mass, friction, damping, steps of the sensors and the hand's spring.
    pub device: DeviceSettings,
    /// How far the hand swings along x, y and z in mm, around the middle of the reach.
    pub swing_mm: [f64; 3],
    /// Swings a second.
    pub swing_hz: f64,
}

impl Default for ArmSettings {
    /// Of the class of a desktop device, with a hand that pokes 8 mm deep twice a second. No measured arm.
    fn default() -> Self {
        Self {
            device: DeviceSettings { workspace_mm: [115.0; 3], ..DeviceSettings::default() },
            swing_mm: [3.0, 0.0, 8.0],
            swing_hz: 2.0,
        }
    }
}

/// An arm in motion.
#[derive(Clone, Debug)]
pub struct EmulatedArm {
    settings: ArmSettings,
    device: SimulatedDevice,
    steps: u64,
}

impl EmulatedArm {
    /// At rest in the middle of its reach.
    pub fn new(settings: ArmSettings) -> Result<Self, SettingError> {
        let period = Period::of_nanos(STEP.0).unwrap_or(Period::MILLISECOND);
        let device = SimulatedDevice::new(settings.device, period, [0.0; 3], [0.0; 3])?;
        Ok(Self { settings, device, steps: 0 })
    }

    /// Moves to `now` under a force in N.
    pub fn advance(&mut self, now: Nanos, force: [f64; 3]) {
        let until = now.0 / STEP.0;
        // After a pause of the computer the hand goes on from where it is.
        self.steps = self.steps.max(until.saturating_sub(1000));
        while self.steps < until {
            self.steps += 1;
            let t = Nanos(self.steps * STEP.0).seconds().0;
            let swing = (TAU * self.settings.swing_hz * t).sin();
            let at = self.settings.swing_mm.map(|part| part * swing);
            self.device.follow(HandPose { at, turn: [0.0; 3] }, force, 1);
        }
    }

    /// The sensed place in mm from the middle of the reach, in whole steps of the sensors.
    #[must_use]
    pub fn place_mm(&self) -> [f64; 3] {
        self.device.pose().at
    }

    /// The velocity in mm/s.
    #[must_use]
    pub fn velocity_mm_per_s(&self) -> [f64; 3] {
        self.device.axes().map(|axis| axis.v)
    }
}
