//! Triangles with their neighbours, normals and tree.

use super::build;
use super::error::TriangleMeshError;
use super::tree::{MeshHit, Tree};
use super::triangle::{TriangleFeature, corner_shares, meets};
use super::vector::{Vector, plus, unit};

/// Most triangles: with all tables 150 MB, and finer than 0.5 mm on a stomach of 1000 cm^2.
pub const MOST_FACES: usize = 1_000_000;
/// Longest side of a mesh's box in mm: nothing that is palpated is longer than 10 m, and an organ of more than 10 mm is refused where
/// its mm are taken for m.
pub const LARGEST_MM: f64 = 10_000.0;
/// Shortest longest side of a mesh's box in mm: 18 steps of the places that a device of the Omni's class senses.
pub const SMALLEST_MM: f64 = 1.0;

/// No neighbour: an open edge.
pub(super) const OPEN: u32 = u32::MAX;

/// Triangles as a file has them, in mm.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleSoup {
    /// Vertices, repeated or not.
    pub points: Vec<[f64; 3]>,
    /// Vertices of each triangle, counterclockwise as seen from outside where the file knows it.
    pub faces: Vec<[u32; 3]>,
    /// Red, green and blue from 0 to 1 for each vertex; empty for none.
    pub colours: Vec<[f64; 3]>,
}

/// A surface of triangles that knows its neighbours and its outer side.
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    pub(super) points: Box<[Vector]>,
    pub(super) faces: Box<[[u32; 3]]>,
    /// Across the edge from corner `i` to the next.
    pub(super) neighbours: Box<[[u32; 3]]>,
    pub(super) face_normals: Box<[Vector]>,
    /// By the angles of the faces around (Baerentzen & Aanaes, "Signed distance computation using the angle weighted pseudonormal",
    /// IEEE Trans. Vis. Comput. Graph. 11 (2005) 243-253).
    pub(super) vertex_normals: Box<[Vector]>,
    /// Which normal of `shaded_normals` a corner has.
    pub(super) corner_normals: Box<[[u32; 3]]>,
    pub(super) shaded_normals: Box<[Vector]>,
    /// Where the faces around a vertex begin in `around`.
    pub(super) around_first: Box<[u32]>,
    pub(super) around: Box<[u32]>,
    /// Whether the connected part of a face has no open edge.
    pub(super) is_closed: Box<[bool]>,
    pub(super) is_at_open_edge: Box<[bool]>,
    pub(super) tree: Tree,
    pub(super) vertex_of_file: Box<[u32]>,
    pub(super) open_edges: usize,
    pub(super) parts: usize,
    pub(super) turned: usize,
}

/// A point of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Index of the triangle.
    pub face: u32,
    /// Place in mm.
    pub point: [f64; 3],
    /// Which part of the triangle it is on.
    pub feature: TriangleFeature,
}

impl TriangleMesh {
    /// Welds, checks and orients triangles.
    ///
    /// Vertices nearer than a millionth of the mesh's size become one. Triangles are turned so that neighbours agree; a part
    /// without open edges then has its normals outwards, and an open part as most of its triangles had them. Open edges are
    /// counted and left open.
    pub fn new(soup: TriangleSoup) -> Result<Self, TriangleMeshError> {
        build::build(soup)
    }

    /// Vertices in mm, each place once.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// Vertices of each triangle, counterclockwise as seen from outside.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Outward unit normals of vertices, weighted by the angles of the triangles around.
    pub fn vertex_normals(&self) -> &[[f64; 3]] {
        &self.vertex_normals
    }

    /// Outward unit normals of triangles.
    pub fn face_normals(&self) -> &[[f64; 3]] {
        &self.face_normals
    }

    /// For each vertex of the file, which vertex it became.
    pub fn vertex_of_file(&self) -> &[u32] {
        &self.vertex_of_file
    }

    /// Edges with a triangle on one side only.
    pub fn open_edges(&self) -> usize {
        self.open_edges
    }

    /// Connected parts.
    pub fn parts(&self) -> usize {
        self.parts
    }

    /// Triangles that were turned over.
    pub fn turned(&self) -> usize {
        self.turned
    }

    /// Lowest and highest corner of the box around it, in mm.
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        self.tree.bounds()
    }

    pub(super) fn corners(&self, face: u32) -> [Vector; 3] {
        self.faces[face as usize].map(|vertex| self.points[vertex as usize])
    }

    pub(super) fn faces_around(&self, vertex: u32) -> &[u32] {
        let vertex = vertex as usize;
        let [from, to] = [vertex, vertex + 1].map(|index| self.around_first[index] as usize);
        &self.around[from..to]
    }

    /// Shares of a triangle's corners at a point of it.
    pub fn corner_shares(&self, face: u32, point: [f64; 3]) -> [f64; 3] {
        corner_shares(self.corners(face), point)
    }

    /// The point nearest to `place` and no further than `within` mm; `None` if there is none.
    pub fn nearest(&self, place: [f64; 3], within: f64) -> Option<SurfacePoint> {
        self.tree.nearest(self, place, within)
    }

    /// Whether a place is outside, by the sign along the angle-weighted normal at the surface point nearest to it.
    pub fn is_outside(&self, nearest: &SurfacePoint, place: [f64; 3]) -> bool {
        let way = super::vector::minus(place, nearest.point);
        super::vector::dot(way, self.normal_for_sign(nearest)) >= 0.0
    }

    /// Outward unit normal at a point of the surface: of a corner or an edge, that of the triangles around.
    pub fn normal(&self, at: &SurfacePoint) -> [f64; 3] {
        let own = self.face_normals[at.face as usize];
        unit(self.normal_for_sign(at)).unwrap_or(own)
    }

    /// Where a straight way first meets a triangle: on closed parts from outside, on open ones from either side.
    pub fn first_hit(&self, from: [f64; 3], to: [f64; 3]) -> Option<MeshHit> {
        self.tree.first_hit(self, from, to, |_| false)
    }

    /// Not unit: for signs alone.
    pub(super) fn normal_for_sign(&self, at: &SurfacePoint) -> Vector {
        let own = self.face_normals[at.face as usize];
        match at.feature {
            TriangleFeature::Inside => own,
            TriangleFeature::Edge(edge) => {
                match self.neighbours[at.face as usize][usize::from(edge)] {
                    OPEN => own,
                    other => plus(own, 1.0, self.face_normals[other as usize]),
                }
            }
            TriangleFeature::Corner(corner) => {
                self.vertex_normals[self.faces[at.face as usize][usize::from(corner)] as usize]
            }
        }
    }

    /// Interpolated unit normal (Phong, "Illumination for computer generated pictures", Commun. ACM 18 (1975) 311-317), smooth over edges
    /// of less than 45 degrees; the true one where they differ by more than a right angle.
    pub(super) fn shaded_normal(&self, face: u32, point: Vector) -> Vector {
        let own = self.face_normals[face as usize];
        let shares = self.corner_shares(face, point);
        let indices = self.corner_normals[face as usize];
        let sum = (0..3).fold([0.0; 3], |sum, corner| {
            plus(sum, shares[corner], self.shaded_normals[indices[corner] as usize])
        });
        match unit(sum) {
            Some(normal) if super::vector::dot(normal, own) > 0.0 => normal,
            _ => own,
        }
    }

    /// The share of a way at which it meets a face from a side that counts.
    #[inline]
    pub(super) fn meets(&self, face: u32, from: Vector, along: Vector) -> Option<f64> {
        let normal = self.face_normals[face as usize];
        if self.is_closed[face as usize] && super::vector::dot(along, normal) >= 0.0 {
            return None;
        }
        meets(self.corners(face), normal, from, along)
    }
}
