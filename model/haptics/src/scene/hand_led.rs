//! A scene on the simulated device.

use super::{HandPose, Scene, SceneError, SceneSettings, SceneTick, SimulatedDevice};

/// A scene with the simulated device that a hand leads; the same hands give the same bits.
#[derive(Clone, Debug)]
pub struct HandLedScene {
    pub scene: Scene,
    pub device: SimulatedDevice,
}

impl HandLedScene {
    /// At rest, the stylus over the middle.
    pub fn new(settings: SceneSettings) -> Result<Self, SceneError> {
        Ok(Self { device: SimulatedDevice::of(&settings)?, scene: Scene::new(settings)? })
    }

    /// One tick, led by a hand.
    pub fn tick(&mut self, hand: HandPose) -> SceneTick {
        self.tick_after(hand, 1)
    }

    /// The tick that comes `elapsed` ticks after the last: one, unless the loop was away. Device and law are led through what
    /// was missed.
    pub fn tick_after(&mut self, hand: HandPose, elapsed: u64) -> SceneTick {
        let elapsed = elapsed.max(1);
        self.device.follow(hand, self.scene.last().force, elapsed);
        self.scene.render(self.device.pose(), elapsed)
    }
}
