//! Distances along the surface from a point of it.
//!
//! From vertex to vertex in the order of distance, as Dijkstra's, but also across triangles: from the distances of two corners the place of
//! the source follows in the plane of the triangle, and from there the distance of the third (Novotni & Klein, "Computing geodesic distances
//! on triangular meshes", WSCG 2002; exact windows instead of one source for each edge: Surazhsky et al., "Fast exact and approximate geodesics
//! on meshes", ACM Trans. Graph. 24 (2005) 553-560).
//!
//! On a plane the result is exact to rounding. Along edges alone it would be up to 15 % too long on equilateral triangles, however fine.

use super::heap::VertexHeap;
use super::mesh::{SurfacePoint, TriangleMesh};
use super::vector::{Vector, dot, length, minus};

/// A vertex whose distance falls by less than this share after it was passed is not passed again: far below the error of the method.
const PASS_AGAIN: f64 = 1e-9;

/// Vertices in a row beyond the reach that are passed, too: a straight way to a vertex within crosses edges with an end beyond.
const BEYOND: u8 = 2;

/// Storage of a search, made once for a mesh.
#[derive(Clone, Debug)]
pub struct GeodesicDistance {
    distance: Box<[f64]>,
    /// In the pass of this number a vertex was first seen, and passed.
    seen: Box<[u32]>,
    passed: Box<[u32]>,
    pass: u32,
    reach: f64,
    beyond: Box<[u8]>,
    found: Vec<u32>,
    heap: VertexHeap,
}

impl GeodesicDistance {
    #[must_use]
    pub fn new(mesh: &TriangleMesh) -> Self {
        let vertices = mesh.points.len();
        Self {
            distance: vec![f64::INFINITY; vertices].into(),
            seen: vec![0; vertices].into(),
            passed: vec![0; vertices].into(),
            pass: 0,
            reach: 0.0,
            beyond: vec![0; vertices].into(),
            found: Vec::with_capacity(vertices),
            heap: VertexHeap::new(vertices),
        }
    }

    /// Finds every vertex no further than `reach` mm from a point of the mesh that this was made for.
    pub fn search(&mut self, mesh: &TriangleMesh, from: &SurfacePoint, reach: f64) {
        self.begin();
        self.reach = reach;
        let corners = mesh.faces[from.face as usize];
        for vertex in corners {
            let distance = length(minus(mesh.points[vertex as usize], from.point));
            self.offer(vertex, distance, 0);
        }
        // Vertices that are passed again are few; this only bounds the time whatever the mesh.
        let mut left = 4 * mesh.points.len();
        while left > 0
            && let Some(vertex) = self.heap.pop(&self.distance)
        {
            left -= 1;
            self.passed[vertex as usize] = self.pass;
            for &face in mesh.faces_around(vertex) {
                self.cross(mesh, vertex, face);
            }
        }
    }

    /// Vertices of the last search and their distances in mm, in the order in which they were first reached.
    pub fn found(&self) -> impl Iterator<Item = (u32, f64)> {
        let all = self.found.iter().map(|&vertex| (vertex, self.distance[vertex as usize]));
        all.filter(|(_, distance)| *distance <= self.reach)
    }

    fn begin(&mut self) {
        self.heap.clear();
        self.found.clear();
        self.pass = self.pass.wrapping_add(1);
        if self.pass == 0 {
            // After 4 thousand million searches the numbers repeat.
            self.seen.fill(0);
            self.passed.fill(0);
            self.pass = 1;
        }
    }

    /// What a passed vertex gives the two others of a face.
    #[inline(always)]
    fn cross(&mut self, mesh: &TriangleMesh, vertex: u32, face: u32) {
        let corners = mesh.faces[face as usize];
        let Some(corner) = super::shading::corner_of(corners, vertex) else { return };
        let [one, other] = [corners[(corner + 1) % 3], corners[(corner + 2) % 3]];
        let at = |vertex: u32| mesh.points[vertex as usize];
        let distance = self.distance[vertex as usize];
        let beyond = if distance > self.reach { self.beyond[vertex as usize] + 1 } else { 1 };
        for (to, with) in [(one, other), (other, one)] {
            let (here, there) = (minus(at(vertex), at(to)), minus(at(with), at(to)));
            // A corner that was passed before has no longer way than along this edge, but may have one across the triangle: the front
            // around a source that is near is round.
            let is_before =
                self.passed[to as usize] == self.pass && self.distance[to as usize] <= distance;
            let mut best = if is_before { f64::INFINITY } else { distance + length(here) };
            if self.passed[with as usize] == self.pass {
                let known = [distance, self.distance[with as usize]];
                if let Some(across) = unfold(here, there, known) {
                    best = best.min(across);
                }
            }
            self.offer(to, best, beyond);
        }
    }

    /// `beyond`: the how manieth it is outside the reach, if it is.
    fn offer(&mut self, vertex: u32, distance: f64, beyond: u8) {
        if distance.is_nan() || (distance > self.reach && beyond > BEYOND) {
            return;
        }
        let index = vertex as usize;
        if self.seen[index] != self.pass {
            self.seen[index] = self.pass;
            self.found.push(vertex);
        } else if distance >= self.distance[index] {
            return;
        } else if self.passed[index] == self.pass {
            if distance >= self.distance[index] * (1.0 - PASS_AGAIN) {
                return;
            }
            self.passed[index] = 0;
        }
        self.distance[index] = distance;
        self.beyond[index] = beyond;
        self.heap.raise(vertex, &self.distance);
    }
}

/// The distance of the third corner where the straight way from the source to it crosses the edge of the first two, whose ways from the
/// third and distances from the source are known.
#[inline(always)]
fn unfold(a: Vector, b: Vector, [to_a, to_b]: [f64; 2]) -> Option<f64> {
    let ab = minus(b, a);
    let squared = dot(ab, ab);
    // All in shares of the edge, which is from (0, 0) to (1, 0): the source below it, the corner above.
    let x = 0.5 + (to_a * to_a - to_b * to_b) / (2.0 * squared);
    let y_squared = to_a * to_a / squared - x * x;
    // A source on the line of the edge is one at which roundings decide.
    if y_squared < -1e-9 * to_a * to_a / squared {
        return None;
    }
    let y = y_squared.max(0.0).sqrt();
    let corner_x = -dot(a, ab) / squared;
    let corner_y = (dot(a, a) / squared - corner_x * corner_x).max(0.0).sqrt();
    let high = y + corner_y;
    // Where the way crosses the edge, times its height.
    let crossing = x * high + (corner_x - x) * y;
    if !(0.0..=high).contains(&crossing) || high <= 0.0 {
        return None;
    }
    let wide = corner_x - x;
    Some(((wide * wide + high * high) * squared).sqrt())
}
