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

/// A way that is longer than another by this share is longer whatever the roundings of both, which are some 1e-16.
const CLEARLY: f64 = 1e-12;
/// The same where squares of distances are subtracted, from an edge that is no shorter than a thousandth of them.
const CLEARLY_ACROSS: f64 = 1e-9;

/// Vertices in a row beyond the reach that are passed, too: a straight way to a vertex within crosses edges with an end beyond.
const BEYOND: u8 = 2;

/// Storage of a search, made once for a mesh.
#[derive(Clone, Debug)]
pub struct GeodesicDistance {
    vertices: Box<[Vertex]>,
    /// The two other corners of the faces around each vertex, in the order of `TriangleMesh::around`.
    others: Box<[[u32; 2]]>,
    pass: u32,
    reach: f64,
    found: Vec<u32>,
    heap: VertexHeap,
}

/// All that a search needs of a vertex, in one line of the processor's cache: a search at a new place waits mostly for memory.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Vertex {
    at: Vector,
    distance: f64,
    /// The pass in which it was first seen, and that in which it was passed.
    seen: u32,
    passed: u32,
    beyond: u8,
}

impl GeodesicDistance {
    #[must_use]
    pub fn new(mesh: &TriangleMesh) -> Self {
        let count = mesh.points.len();
        let vertex =
            |&at: &Vector| Vertex { at, distance: f64::INFINITY, seen: 0, passed: 0, beyond: 0 };
        Self {
            vertices: mesh.points.iter().map(vertex).collect(),
            others: others(mesh),
            pass: 0,
            reach: 0.0,
            found: Vec::with_capacity(count),
            heap: VertexHeap::new(count),
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
            && let Some(vertex) = self.heap.pop()
        {
            left -= 1;
            self.vertices[vertex as usize].passed = self.pass;
            let [from, to] = [0, 1].map(|step| mesh.around_first[vertex as usize + step] as usize);
            for index in from..to {
                self.cross(vertex, self.others[index]);
            }
        }
    }

    /// Vertices of the last search and their distances in mm, in the order in which they were first reached.
    pub fn found(&self) -> impl Iterator<Item = (u32, f64)> {
        let distance = move |vertex: u32| self.vertices[vertex as usize].distance;
        let all = self.found.iter().map(move |&vertex| (vertex, distance(vertex)));
        all.filter(|(_, distance)| *distance <= self.reach)
    }

    fn begin(&mut self) {
        self.heap.clear();
        self.found.clear();
        self.pass = self.pass.wrapping_add(1);
        if self.pass == 0 {
            // After 4 thousand million searches the numbers repeat.
            for vertex in &mut self.vertices {
                (vertex.seen, vertex.passed) = (0, 0);
            }
            self.pass = 1;
        }
    }

    /// What a passed vertex gives the two others of a face.
    #[inline(always)]
    fn cross(&mut self, vertex: u32, [one, other]: [u32; 2]) {
        let Vertex { at, distance, beyond, .. } = self.vertices[vertex as usize];
        let beyond = if distance > self.reach { beyond + 1 } else { 1 };
        for (to, with) in [(one, other), (other, one)] {
            let (to_one, with_one) = (&self.vertices[to as usize], &self.vertices[with as usize]);
            let limit = to_one.limit(self.pass);
            let here = minus(at, to_one.at);
            // A corner that was passed before has no longer way than along this edge, but may have one across the triangle: the front
            // around a source that is near is round.
            let mut best = f64::INFINITY;
            let (room, squared) = (limit - distance, dot(here, here));
            if room > 0.0 && squared <= room * room * (1.0 + CLEARLY) {
                best = distance + squared.sqrt();
            }
            if with_one.passed == self.pass {
                let there = minus(with_one.at, to_one.at);
                let known = [distance, with_one.distance];
                if !is_too_long(here, there, known, limit)
                    && let Some(across) = unfold(here, there, known)
                {
                    best = best.min(across);
                }
            }
            if best < limit {
                self.offer(to, best, beyond);
            }
        }
    }

    /// `beyond`: the how manieth it is outside the reach, if it is.
    #[inline(always)]
    fn offer(&mut self, vertex: u32, distance: f64, beyond: u8) {
        if distance.is_nan() || (distance > self.reach && beyond > BEYOND) {
            return;
        }
        let one = &mut self.vertices[vertex as usize];
        if distance >= one.limit(self.pass) {
            return;
        }
        if one.seen != self.pass {
            one.seen = self.pass;
            self.found.push(vertex);
        }
        one.passed = 0;
        one.distance = distance;
        one.beyond = beyond;
        self.heap.raise(vertex, distance);
    }
}

impl Vertex {
    /// No distance from here on changes it in a pass.
    #[inline(always)]
    fn limit(&self, pass: u32) -> f64 {
        match (self.seen == pass, self.passed == pass) {
            (false, _) => f64::INFINITY,
            (true, false) => self.distance,
            (true, true) => self.distance * (1.0 - PASS_AGAIN),
        }
    }
}

fn others(mesh: &TriangleMesh) -> Box<[[u32; 2]]> {
    let mut others = Vec::with_capacity(mesh.around.len());
    for vertex in 0..mesh.points.len() as u32 {
        others.extend(mesh.faces_around(vertex).iter().map(|&face| {
            let corners = mesh.faces[face as usize];
            // Every face around a vertex has it as a corner.
            let corner = super::shading::corner_of(corners, vertex).unwrap_or(0);
            [corners[(corner + 1) % 3], corners[(corner + 2) % 3]]
        }));
    }
    others.into()
}

/// Whether [`unfold`] gives `limit` or more, as far as that is seen without roots and divisions: the way across is no shorter than the
/// hypotenuse over the heights of the source and the third corner above the edge.
#[inline(always)]
fn is_too_long(a: Vector, b: Vector, [to_a, to_b]: [f64; 2], limit: f64) -> bool {
    let ab = minus(b, a);
    let squared = dot(ab, ab);
    // Feet of both on the edge, times its length.
    let (source, corner) = (0.5 * (squared + to_a * to_a - to_b * to_b), dot(a, ab));
    let sides = to_a * to_a + dot(a, a);
    let heights = (sides * (1.0 - CLEARLY_ACROSS) - limit * limit) * squared;
    heights > source * source + corner * corner && 1e6 * squared > to_a * to_a
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

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::random::SplitMix;

    /// Triangles from equilateral to slivers of a millionth, sources near and far, and limits a rounding to a tenth beside the way itself.
    #[test]
    fn a_way_that_is_seen_to_be_too_long_is_too_long() {
        let mut random = SplitMix::seeded(7);
        let mut number = || random.below(2_000_001) as f64 / 1e6 - 1.0;
        let (mut ways, mut seen) = (0, 0);
        for round in 0..1_000_000 {
            let [thin, far, near] =
                [round % 7, round / 7 % 3, round / 21 % 16].map(|power| 10.0_f64.powi(power));
            let a = [number(), number(), number()];
            let b = a.map(|part| part + number() / thin);
            let source = [far * number(), far * number(), far * number()];
            let known = [length(minus(a, source)), length(minus(b, source))];
            let Some(across) = unfold(a, b, known) else { continue };
            let limit = across * (1.0 + number() / near);
            let is_seen = is_too_long(a, b, known, limit);
            assert!(!is_seen || across >= limit, "{a:?} {b:?} {known:?}: {across} {limit}");
            ways += 1;
            seen += usize::from(is_seen);
        }
        // Some are seen without a root.
        assert!(ways > 30_000 && seen > ways / 100, "{seen} of {ways}");
    }
}
