//! The simulated haptic device with a hand that follows a path, then a pointer.

use super::loop_scene::Laps;
use palpate_haptics::SettingError;
use palpate_haptics::device::HapticDevice;
use palpate_haptics::scene::{
    DeviceSettings, HandPose, Pose, ScenePath, SceneSettings, SceneStart, SimulatedDevice,
};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use triple_buffer::{Input, Output, triple_buffer};

/// The simulated device of a scene.
#[derive(Debug)]
pub struct Stylus {
    device: SimulatedDevice,
    settings: SceneSettings,
    start: SceneStart,
    path: Option<ScenePath>,
    laps: u32,
    pointed: Output<HandPose>,
    is_over: Arc<AtomicBool>,
    ticks: u64,
    hand: HandPose,
    force: [f64; 3],
}

impl Stylus {
    /// Starts over the middle of a square of tissue and follows the path `laps` times; the input moves the hand afterwards.
    pub fn new(
        settings: SceneSettings,
        path: Laps,
    ) -> Result<(Self, Input<HandPose>), SettingError> {
        let device = SimulatedDevice::of(&settings)?;
        Ok(Self::on(device, (settings, SceneStart::of_square(&settings)), path))
    }

    /// On a device at the start of a scene; the path of a square is moved there.
    pub(super) fn on(
        device: SimulatedDevice,
        (settings, start): (SceneSettings, SceneStart),
        (path, laps): Laps,
    ) -> (Self, Input<HandPose>) {
        let hand = HandPose { at: start.at, turn: [0.0; 3] };
        let (input, pointed) = triple_buffer(&hand);
        let stylus = Self {
            device,
            start,
            settings,
            path,
            laps,
            pointed,
            is_over: Arc::new(AtomicBool::new(path.is_none())),
            ticks: 0,
            hand,
            force: [0.0; 3],
        };
        (stylus, input)
    }

    /// True from the end of the path on; without a path, from the start.
    pub(super) fn end_flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.is_over)
    }

    fn next_pose(&mut self) -> HandPose {
        let t = self.settings.period.time_of(self.ticks).seconds().0;
        match self.path {
            Some(path) if t <= path.seconds() * f64::from(self.laps) => {
                self.start.moved(path.at(t % path.seconds(), &self.settings), &self.settings)
            }
            _ => {
                self.is_over.store(true, Ordering::Relaxed);
                *self.pointed.read()
            }
        }
    }
}

impl HapticDevice for Stylus {
    fn settings(&self) -> &DeviceSettings {
        self.device.settings()
    }

    fn sense(&mut self, elapsed: u64) -> Pose {
        self.ticks = self.ticks.saturating_add(elapsed);
        self.hand = self.next_pose();
        self.device.follow(self.hand, self.force, elapsed);
        self.device.pose()
    }

    fn give(&mut self, force: [f64; 3]) {
        self.force = force;
    }

    fn hand(&self) -> Option<HandPose> {
        Some(self.hand)
    }
}
