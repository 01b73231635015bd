//! The tissue of a scene in the window: a square of heights, or a mesh with what its pictures need.

use palpate_analysis::scene_mesh::ReadMesh;
use palpate_haptics::scene::{MeshScene, Scene, SceneSettings, SceneStart, SceneTick};
use palpate_haptics::surface::{Grid, MeshError};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_runner::haptics::scene_file::SceneFile;
use palpate_runner::haptics::{LoopScene, MeshFrame, SceneFrame, SunkVertex};
use palpate_tissue_view::{ElasticModel, MeshShape};

/// The tissue of a scene at one moment.
#[derive(Clone, Debug, PartialEq)]
pub enum ShownTissue {
    /// Heights in mm; at rest they are zero.
    Square { grid: Grid, heights: Vec<f64> },
    /// What of the mesh is not at rest.
    Mesh(Vec<SunkVertex>),
}

/// A tick of a scene, and its tissue then.
#[derive(Clone, Debug)]
pub struct SceneInstant {
    pub tick: SceneTick,
    pub tissue: ShownTissue,
}

/// A mesh of a scene, with what its pictures need.
#[derive(Debug)]
pub struct MeshTissue {
    pub read: ReadMesh,
    pub shape: MeshShape,
    /// The relaxed force of each vertex.
    pub models: Vec<ElasticModel>,
}

impl MeshTissue {
    /// Of the mesh that a scene file names; `None` where its tissue is a square.
    pub fn of(file: &SceneFile) -> Result<Option<Self>, String> {
        let Some(read) = ReadMesh::of(file)? else { return Ok(None) };
        let shape = MeshShape::new(read.mesh.points(), read.mesh.faces());
        let bodies: Vec<_> = read.bodies.iter().map(elastic_model).collect();
        let vertices = 0..read.mesh.points().len() as u32;
        let models = vertices
            .map(|vertex| ElasticModel::blended(&bodies, &read.materials.at_vertex(vertex)))
            .collect();
        Ok(Some(Self { shape: shape.map_err(|err| err.to_string())?, models, read }))
    }
}

/// The relaxed force of a body.
#[must_use]
pub fn elastic_model(body: &ModifiedKelvin) -> ElasticModel {
    ElasticModel { mu: body.mu }
}

/// A scene to be computed or to run.
pub enum TissueScene {
    Square(Box<Scene>),
    Mesh(Box<MeshScene>),
}

impl TissueScene {
    /// Where it begins.
    pub fn start(&self) -> SceneStart {
        match self {
            Self::Square(scene) => LoopScene::start(&**scene),
            Self::Mesh(scene) => LoopScene::start(&**scene),
        }
    }

    /// Device, loop and guards, and the size of a square.
    pub fn settings(&self) -> &SceneSettings {
        match self {
            Self::Square(scene) => LoopScene::settings(&**scene),
            Self::Mesh(scene) => LoopScene::settings(&**scene),
        }
    }

    /// Of a file, at rest.
    pub fn of(file: &SceneFile, mesh: Option<&MeshTissue>) -> Result<Self, String> {
        match mesh {
            Some(mesh) => Ok(Self::Mesh(Box::new(mesh.read.scene(file)?))),
            None => Ok(Self::Square(Box::new(file.scene(file.nodes.unwrap_or_default())?))),
        }
    }
}

/// What the window takes of a scene's frame.
pub trait ShownFrame {
    fn tick(&self) -> &SceneTick;
    fn tissue(&self) -> Result<ShownTissue, MeshError>;
}

impl ShownFrame for SceneFrame {
    fn tick(&self) -> &SceneTick {
        &self.tick
    }

    fn tissue(&self) -> Result<ShownTissue, MeshError> {
        let spacing = self.side_mm / (self.nodes - 1) as f64;
        Ok(ShownTissue::Square {
            grid: Grid::new(self.nodes, self.nodes, spacing)?,
            heights: self.heights.iter().copied().map(f64::from).collect(),
        })
    }
}

impl ShownFrame for MeshFrame {
    fn tick(&self) -> &SceneTick {
        &self.tick
    }

    fn tissue(&self) -> Result<ShownTissue, MeshError> {
        Ok(ShownTissue::Mesh(self.sunk.clone()))
    }
}

impl SceneInstant {
    /// What a frame shows.
    pub fn of(frame: &impl ShownFrame) -> Result<Self, String> {
        let tissue = frame.tissue().map_err(|err| err.to_string())?;
        Ok(Self { tick: *frame.tick(), tissue })
    }
}
