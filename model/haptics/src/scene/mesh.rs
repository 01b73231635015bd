//! A scene whose tissue is a mesh of triangles instead of a square of heights.

use super::device::length;
use super::rendering::ForceRendering;
use super::{
    HandPose, Pose, START_HEIGHT_MM, SceneError, SceneSettings, SceneStart, SceneTick,
    SimulatedDevice, StartPlace, hash,
};
use crate::SettingError;
use crate::triangles::{
    DentSettings, FAR_MM, FIRST_ALONE, MOST_MATERIALS, MaterialMap, MeshTouch, Shading,
    TouchedMesh, TriangleMesh,
};
use palpate_model::viscoelastic::ModifiedKelvin;
use std::sync::Arc;
use thiserror::Error;

/// Vertices in a tick's hash.
const HASHED: usize = 256;

/// A mesh, its materials, and how it is touched.
#[derive(Clone, Debug)]
pub struct MeshSceneSettings {
    pub mesh: Arc<TriangleMesh>,
    pub materials: MaterialMap,
    /// Force over depth of each material.
    pub bodies: Vec<ModifiedKelvin>,
    pub shading: Shading,
    pub dent: DentSettings,
    pub start: StartPlace,
    /// Friction, device, period, scheme, guard and controller of the scene; what it has of a square of tissue has no effect.
    pub scene: SceneSettings,
}

/// A scene on a mesh that cannot be.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MeshSceneError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Setting(#[from] SettingError),
    #[error(
        "the map has {materials} materials, but there are {bodies} force models; give one for each material"
    )]
    Bodies { materials: usize, bodies: usize },
    #[error(
        "the scene begins at vertex {vertex}, but the file of the mesh has {vertices}, counted from 0; choose one of them"
    )]
    StartVertex { vertex: usize, vertices: usize },
    #[error(
        "the place where the scene begins is more than {} mm from the surface; give one that is nearer, or correct the unit of the mesh",
        FAR_MM
    )]
    StartFar,
    #[error(
        "other tissue is less than {} mm before the place where the scene begins; choose a place with more room",
        START_HEIGHT_MM
    )]
    StartBuried,
}

/// A scene on a mesh with its state. A tick is that of [`Scene`](super::Scene), with the same numbers.
#[derive(Clone, Debug)]
pub struct MeshScene {
    touched: TouchedMesh,
    rendering: ForceRendering,
    shares: [f64; MOST_MATERIALS],
    last: SceneTick,
    contact: Option<MeshTouch>,
    settings: SceneSettings,
    start: SceneStart,
}

impl MeshSceneSettings {
    /// Where the scene begins.
    pub fn start(&self) -> Result<SceneStart, MeshSceneError> {
        SceneStart::on_mesh(&self.mesh, self.start)
    }
}

impl MeshScene {
    /// At rest. Everything that ticks need is allocated here.
    pub fn new(settings: &MeshSceneSettings) -> Result<Self, MeshSceneError> {
        let (materials, bodies) = (settings.materials.materials(), settings.bodies.len());
        if materials > bodies {
            return Err(MeshSceneError::Bodies { materials, bodies });
        }
        let MeshSceneSettings { mesh, materials, shading, dent, scene, .. } = settings;
        let touched =
            TouchedMesh::new(mesh.clone(), materials.clone(), (scene.friction, *shading), *dent)?;
        let start = settings.start()?;
        let nearest = mesh.nearest(start.at, FAR_MM);
        let high = nearest.map_or(FAR_MM, |nearest| {
            length([0, 1, 2].map(|axis| start.at[axis] - nearest.point[axis]))
        });
        Ok(Self {
            touched,
            rendering: ForceRendering::new(scene, &settings.bodies, -high)?,
            shares: FIRST_ALONE,
            last: SceneTick {
                device: start.at,
                proxy: start.at,
                normal: [0.0, 0.0, 1.0],
                ..SceneTick::default()
            },
            contact: None,
            settings: *scene,
            start,
        })
    }

    /// The tick of a device that was sensed at `pose`, `elapsed` ticks after the last: one, unless the loop was away.
    pub fn render(&mut self, pose: Pose, elapsed: u64) -> SceneTick {
        let elapsed = elapsed.max(1);
        let tick = self.last.tick.saturating_add(elapsed);
        let (contact, shares) = self.touched.follow(pose.at);
        // In the air the last material counts.
        self.shares = shares.unwrap_or(self.shares);
        let rendered = self.rendering.tick(&contact.touch, contact.below, &self.shares, elapsed);
        let dent = self.touched.sink(&contact);
        self.contact = Some(contact);
        self.last = SceneTick {
            tick,
            moved: dent.moved,
            row_hash: self.part_hash(tick),
            ..rendered.scene_tick(pose, &contact.touch)
        };
        self.last
    }

    pub fn last(&self) -> SceneTick {
        self.last
    }

    /// Device, loop and guards; what it has of a square of tissue has no effect.
    pub fn settings(&self) -> &SceneSettings {
        &self.settings
    }

    /// [`MeshSceneSettings::start`].
    pub fn start(&self) -> SceneStart {
        self.start
    }

    /// The last contact with its triangle.
    pub fn contact(&self) -> Option<&MeshTouch> {
        self.contact.as_ref()
    }

    /// Shares of the materials at the last contact.
    pub fn shares(&self) -> &[f64; MOST_MATERIALS] {
        &self.shares
    }

    pub fn touched(&self) -> &TouchedMesh {
        &self.touched
    }

    /// Hash of how far all vertices have sunk, in place of comparing them.
    pub fn hash(&self) -> u64 {
        hash(self.touched.dent().sunk())
    }

    /// Of one part of the vertices, of the next part in every tick.
    fn part_hash(&self, tick: u64) -> u64 {
        let sunk = self.touched.dent().sunk();
        let parts = sunk.len().div_ceil(HASHED);
        let from = HASHED * (tick % parts as u64) as usize;
        hash(&sunk[from..sunk.len().min(from + HASHED)])
    }
}

/// A scene on a mesh with the simulated device that a hand leads; the same hands give the same bits.
#[derive(Clone, Debug)]
pub struct HandLedMeshScene {
    pub scene: MeshScene,
    pub device: SimulatedDevice,
}

impl HandLedMeshScene {
    /// At rest, the stylus above the mesh.
    pub fn new(settings: &MeshSceneSettings) -> Result<Self, MeshSceneError> {
        let SceneSettings { device, period, .. } = settings.scene;
        let scene = MeshScene::new(settings)?;
        let SceneStart { middle, at, .. } = scene.start();
        Ok(Self { device: SimulatedDevice::new(device, period, middle, at)?, scene })
    }

    /// One tick, led by a hand.
    pub fn tick(&mut self, hand: HandPose) -> SceneTick {
        self.tick_after(hand, 1)
    }

    /// The tick that comes `elapsed` ticks after the last. Device and law are led through what was missed.
    pub fn tick_after(&mut self, hand: HandPose, elapsed: u64) -> SceneTick {
        let elapsed = elapsed.max(1);
        self.device.follow(hand, self.scene.last().force, elapsed);
        self.scene.render(self.device.pose(), elapsed)
    }
}
