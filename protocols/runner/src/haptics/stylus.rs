//! The simulated haptic device with a hand that follows a path, then a pointer.

use palpate_haptics::device::HapticDevice;
use palpate_haptics::scene::{
    DeviceSettings, HandPose, Pose, SceneError, ScenePath, SceneSettings, SimulatedDevice,
};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use triple_buffer::{Input, Output, triple_buffer};

/// The simulated device of a scene.
#[derive(Debug)]
pub struct Stylus {
    device: SimulatedDevice,
    settings: SceneSettings,
    /// From the scene of a path to this one in mm.
    shift: [f64; 3],
    path: Option<ScenePath>,
    laps: u32,
    pointed: Output<HandPose>,
    is_over: Arc<AtomicBool>,
    ticks: u64,
    hand: HandPose,
    force: [f64; 3],
}

impl Stylus {
    /// Starts over the middle of the tissue and follows the path `laps` times; the input moves the hand afterwards.
    pub fn new(
        settings: SceneSettings,
        path: (Option<ScenePath>, u32),
    ) -> Result<(Self, Input<HandPose>), SceneError> {
        let (middle, start) = (settings.middle(), settings.start());
        Self::from_start(settings, (middle, start), path)
    }

    /// Starts at `start` with the workspace around `middle`, in mm; the path is moved with the start.
    pub fn from_start(
        settings: SceneSettings,
        (middle, start): ([f64; 3], [f64; 3]),
        (path, laps): (Option<ScenePath>, u32),
    ) -> Result<(Self, Input<HandPose>), SceneError> {
        let hand = HandPose { at: start, turn: [0.0; 3] };
        let (input, pointed) = triple_buffer(&hand);
        let usual = settings.start();
        let stylus = Self {
            device: SimulatedDevice::new(settings.device, settings.period, middle, start)?,
            shift: [0, 1, 2].map(|axis| start[axis] - usual[axis]),
            settings,
            path,
            laps,
            pointed,
            is_over: Arc::new(AtomicBool::new(path.is_none())),
            ticks: 0,
            hand,
            force: [0.0; 3],
        };
        Ok((stylus, input))
    }

    /// True from the end of the path on; without a path, from the start.
    pub(super) fn end_flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.is_over)
    }

    fn next_pose(&mut self) -> HandPose {
        let t = self.settings.period.time_of(self.ticks).seconds().0;
        match self.path {
            Some(path) if t <= path.seconds() * f64::from(self.laps) => {
                let HandPose { at, turn } = path.at(t % path.seconds(), &self.settings);
                HandPose { at: [0, 1, 2].map(|axis| at[axis] + self.shift[axis]), turn }
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
