//! What a loop needs of a scene, whether its tissue is a square of heights or a mesh of triangles.

use super::scene::SceneFrame;
use super::stylus::Stylus;
use palpate_haptics::Period;
use palpate_haptics::scene::{
    DeviceSettings, HandPose, MeshScene, Pose, Scene, SceneError, ScenePath, SceneTick,
};
use std::fmt::Debug;
use triple_buffer::Input;

/// A path and how many times it is followed.
pub type Laps = (Option<ScenePath>, u32);

/// A scene as a loop ticks it.
pub trait LoopScene: Debug + Send + 'static {
    /// What others see of it, about sixty times a second.
    type Frame: Clone + Debug + Send + 'static;

    fn period(&self) -> Period;

    fn device(&self) -> &DeviceSettings;

    /// The simulated device over its tissue.
    fn stylus(&self, path: Laps) -> Result<(Stylus, Input<HandPose>), SceneError>;

    /// Must not allocate, lock or wait.
    fn render(&mut self, pose: Pose, elapsed: u64) -> SceneTick;

    fn hash(&self) -> u64;

    fn frame(&self) -> Self::Frame;

    /// Must not allocate.
    fn update(&self, frame: &mut Self::Frame);
}

impl LoopScene for Scene {
    type Frame = SceneFrame;

    fn period(&self) -> Period {
        self.settings().period
    }

    fn device(&self) -> &DeviceSettings {
        &self.settings().device
    }

    fn stylus(&self, path: Laps) -> Result<(Stylus, Input<HandPose>), SceneError> {
        Stylus::new(*self.settings(), path)
    }

    fn render(&mut self, pose: Pose, elapsed: u64) -> SceneTick {
        Scene::render(self, pose, elapsed)
    }

    fn hash(&self) -> u64 {
        Scene::hash(self)
    }

    fn frame(&self) -> SceneFrame {
        SceneFrame::new(self)
    }

    fn update(&self, frame: &mut SceneFrame) {
        frame.update(self);
    }
}

/// Of a mesh the newest tick is seen.
impl LoopScene for MeshScene {
    type Frame = SceneTick;

    fn period(&self) -> Period {
        self.settings().period
    }

    fn device(&self) -> &DeviceSettings {
        &self.settings().device
    }

    fn stylus(&self, path: Laps) -> Result<(Stylus, Input<HandPose>), SceneError> {
        Stylus::from_start(*self.settings(), (self.middle(), self.start()), path)
    }

    fn render(&mut self, pose: Pose, elapsed: u64) -> SceneTick {
        MeshScene::render(self, pose, elapsed)
    }

    fn hash(&self) -> u64 {
        MeshScene::hash(self)
    }

    fn frame(&self) -> SceneTick {
        self.last()
    }

    fn update(&self, frame: &mut SceneTick) {
        *frame = self.last();
    }
}
