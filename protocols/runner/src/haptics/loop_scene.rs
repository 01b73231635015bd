//! What a loop needs of a scene, whether its tissue is a square of heights or a mesh of triangles.

use super::mesh_frame::MeshFrame;
use super::scene::SceneFrame;
use super::stylus::Stylus;
use palpate_haptics::scene::{
    HandPose, MeshScene, Pose, Scene, ScenePath, SceneSettings, SceneStart, SceneTick,
    SimulatedDevice,
};
use palpate_haptics::{Period, SettingError};
use std::fmt::Debug;
use triple_buffer::Input;

/// A path and how many times it is followed.
pub type Laps = (Option<ScenePath>, u32);

/// A scene as a loop ticks it.
pub trait LoopScene: Debug + Send + 'static {
    /// What others see of it, about sixty times a second.
    type Frame: Clone + Debug + Send + 'static;

    /// Device, loop and guards.
    fn settings(&self) -> &SceneSettings;

    fn start(&self) -> SceneStart;

    /// Must not allocate, lock or wait.
    fn render(&mut self, pose: Pose, elapsed: u64) -> SceneTick;

    fn hash(&self) -> u64;

    fn frame(&self) -> Self::Frame;

    /// Must not allocate.
    fn update(&self, frame: &mut Self::Frame);

    fn period(&self) -> Period {
        self.settings().period
    }

    /// The simulated device at the start.
    fn simulated_device(&self) -> Result<SimulatedDevice, SettingError> {
        let SceneStart { middle, at, .. } = self.start();
        SimulatedDevice::new(self.settings().device, self.period(), middle, at)
    }

    /// The same with a hand on a path, and what moves the hand afterwards.
    fn stylus(&self, path: Laps) -> Result<(Stylus, Input<HandPose>), SettingError> {
        let at = (*self.settings(), self.start());
        Ok(Stylus::on(self.simulated_device()?, at, path))
    }
}

impl LoopScene for Scene {
    type Frame = SceneFrame;

    fn settings(&self) -> &SceneSettings {
        Scene::settings(self)
    }

    fn start(&self) -> SceneStart {
        SceneStart::of_square(Scene::settings(self))
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

impl LoopScene for MeshScene {
    type Frame = MeshFrame;

    fn settings(&self) -> &SceneSettings {
        MeshScene::settings(self)
    }

    fn start(&self) -> SceneStart {
        MeshScene::start(self)
    }

    fn render(&mut self, pose: Pose, elapsed: u64) -> SceneTick {
        MeshScene::render(self, pose, elapsed)
    }

    fn hash(&self) -> u64 {
        MeshScene::hash(self)
    }

    fn frame(&self) -> MeshFrame {
        MeshFrame::new(self)
    }

    fn update(&self, frame: &mut MeshFrame) {
        frame.update(self);
    }
}
