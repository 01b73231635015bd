//! What graphics see of a scene on a mesh of triangles.

use palpate_haptics::scene::{MeshScene, SceneTick};

/// A vertex that is not at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunkVertex {
    pub vertex: u32,
    /// Where it is now, in mm.
    pub place: [f64; 3],
    /// How far it is below its place at rest, in mm.
    pub depth: f64,
}

/// What graphics see of a scene on a mesh, about sixty times a second.
#[derive(Debug)]
pub struct MeshFrame {
    /// The newest tick.
    pub tick: SceneTick,
    pub sunk: Vec<SunkVertex>,
}

/// With room for all vertices: the loop fills a copy and must not allocate.
impl Clone for MeshFrame {
    fn clone(&self) -> Self {
        let mut sunk = Vec::with_capacity(self.sunk.capacity());
        sunk.extend_from_slice(&self.sunk);
        Self { tick: self.tick, sunk }
    }
}

impl MeshFrame {
    pub(super) fn new(scene: &MeshScene) -> Self {
        let vertices = scene.touched().mesh().points().len();
        let mut frame = Self { tick: scene.last(), sunk: Vec::with_capacity(vertices) };
        frame.update(scene);
        frame
    }

    pub(super) fn update(&mut self, scene: &MeshScene) {
        self.tick = scene.last();
        let (mesh, dent) = (scene.touched().mesh(), scene.touched().dent());
        let side = scene.contact().map_or(1.0, |contact| contact.side);
        let sunk = dent.sunk();
        self.sunk.clear();
        self.sunk.extend(dent.moved_vertices().iter().map(|&vertex| SunkVertex {
            vertex,
            place: dent.place(mesh, vertex, side),
            depth: sunk[vertex as usize],
        }));
    }
}
