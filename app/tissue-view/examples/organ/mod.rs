//! The organs that the examples draw: the built-in meshes under a ball of 6 mm radius.

#![allow(dead_code, reason = "each example takes its part")]

use palpate_haptics::surface::SurfaceRecovery;
use palpate_haptics::triangles::shapes::{NODULE_MM, phantom, stomach};
use palpate_haptics::triangles::{
    Dent, DentSettings, MaterialMap, SurfacePoint, TriangleMesh, TriangleSoup,
};
use palpate_tissue_view::{Camera, ElasticModel, MeshShape, MovedNode, PictureShape, Probe, Vec3};
use std::error::Error;

const RADIUS_MM: f64 = 6.0;
/// Pig stomach, equation 3.5 of the thesis that palpate implements, and a nodule five times as stiff.
const MODELS: [ElasticModel; 2] = [
    ElasticModel { mu: [0.05333, -0.0086, 0.0004345] },
    ElasticModel { mu: [0.26665, -0.043, 0.0021725] },
];

pub struct Organ {
    mesh: TriangleMesh,
    dent: Dent,
    pub shape: MeshShape,
    /// The model of each vertex.
    pub models: Vec<ElasticModel>,
    pub probe: Option<Probe>,
    /// How far the camera goes around from where it begins, in rad.
    turn: f64,
    /// How far the shaft leans along x, as a share of its direction along the normal.
    tilt: f64,
}

impl Organ {
    pub fn stomach() -> Result<Self, Box<dyn Error>> {
        let mut organ = Self::at_rest(stomach())?;
        // On the front of the body.
        organ.tilt = -0.9;
        organ.press([24.0, -80.0, 20.0], 7.0)?;
        Ok(organ)
    }

    /// The phantom with a stiffer nodule, nothing on it.
    pub fn phantom() -> Result<Self, Box<dyn Error>> {
        // The nodule is in front.
        Ok(Self { turn: 0.9, ..Self::at_rest(phantom())? })
    }

    /// The same with the ball beside the nodule.
    pub fn pressed_phantom() -> Result<Self, Box<dyn Error>> {
        let mut organ = Self::phantom()?;
        organ.press([NODULE_MM[0] + 6.0, NODULE_MM[1] - 26.0, 60.0], 5.0)?;
        Ok(organ)
    }

    fn at_rest(soup: TriangleSoup) -> Result<Self, Box<dyn Error>> {
        let colours = soup.colours.clone();
        let mesh = TriangleMesh::new(soup)?;
        let map = match colours.is_empty() {
            true => MaterialMap::one(&mesh),
            false => MaterialMap::from_colours(&mesh, &colours, MODELS.len())?,
        };
        let vertices = 0..mesh.points().len() as u32;
        let settings = DentSettings { recovery: SurfaceRecovery::NONE, ..DentSettings::default() };
        Ok(Self {
            shape: MeshShape::new(mesh.points(), mesh.faces())?,
            models: vertices
                .map(|vertex| ElasticModel::blended(&MODELS, &map.at_vertex(vertex)))
                .collect(),
            dent: Dent::new(&mesh, settings)?,
            mesh,
            probe: None,
            turn: 0.0,
            tilt: 0.0,
        })
    }

    /// Every point of a ball that is inside the organ is a contact of the loop's point.
    fn press(&mut self, from: Vec3, depth_mm: f64) -> Result<(), Box<dyn Error>> {
        let on = self.mesh.nearest(from, 1e3).ok_or("no surface is near")?;
        let normal = self.normal(&on);
        let centre = along(on.point, normal, RADIUS_MM - depth_mm);
        const STEPS: u32 = 1500;
        for step in 0..STEPS {
            // Equal areas of a sphere by the golden angle.
            let z = 1.0 - 2.0 * (f64::from(step) + 0.5) / f64::from(STEPS);
            let (sin, cos) = (f64::from(step) * 2.399_963).sin_cos();
            let across = (1.0 - z * z).sqrt();
            let point = along(centre, [across * cos, across * sin, z], RADIUS_MM);
            let Some(near) = self.mesh.nearest(point, 30.0) else { continue };
            if !self.mesh.is_outside(&near, point) {
                let [x, y, z] = along(point, near.point, -1.0);
                self.dent.tick(&self.mesh, Some((&near, x.hypot(y).hypot(z))));
            }
        }
        let tilted = along(along(normal, [0.0, 0.0, 1.0], 0.6), [1.0, 0.0, 0.0], self.tilt);
        let probe = Probe::new(centre, RADIUS_MM)?.with_axis(tilted)?;
        self.probe = Some(probe.above(along(on.point, normal, -0.5 * depth_mm), normal)?);
        Ok(())
    }

    fn normal(&self, on: &SurfacePoint) -> Vec3 {
        self.mesh.face_normals()[on.face as usize]
    }

    /// Nodes that are not at rest, their dent this times as deep.
    pub fn moved(&self, times: f64) -> impl Iterator<Item = MovedNode> {
        self.dent.moved_vertices().iter().map(move |&node| {
            let rest = self.mesh.points()[node as usize];
            let now = self.dent.place(&self.mesh, node, 1.0);
            MovedNode {
                node,
                place: [0, 1, 2].map(|axis| rest[axis] + times * (now[axis] - rest[axis])),
                depth_mm: times * self.dent.sunk()[node as usize],
            }
        })
    }

    pub fn camera(&self, shape: PictureShape) -> Camera {
        let mut camera = Camera::around(self.mesh.bounds());
        camera.orbit(self.turn, 0.0);
        camera.fitted_to(self.mesh.points(), shape)
    }
}

fn along(from: Vec3, direction: Vec3, length: f64) -> Vec3 {
    [0, 1, 2].map(|axis| from[axis] + length * direction[axis])
}
