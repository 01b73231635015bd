//! Distances along the surface from a point of it.
//!
//! From vertex to vertex in the order of distance, as Dijkstra's, but also across triangles: from the distances of two corners the place of
//! the source follows in the plane of the triangle, and from there the distance of the third (Novotni & Klein, "Computing geodesic distances
//! on triangular meshes", WSCG 2002; exact windows instead of one source for each edge: Surazhsky et al., "Fast exact and approximate geodesics
//! on meshes", ACM Trans. Graph. 24 (2005) 553-560).
//!
//! On a plane the result is exact to rounding. Along edges alone it would be up to 15 % too long on equilateral triangles, however fine.

use super::heap::{OUT, VertexHeap};
use super::mesh::{SurfacePoint, TriangleMesh};
use super::vector::{cross, dot, length, minus};

/// A vertex whose distance falls by less than this share after it was passed is not passed again: far below the error of the method.
const PASS_AGAIN: f64 = 1e-9;

/// Vertices in a row beyond the reach that are passed, too: a straight way to a vertex within crosses edges with an end beyond.
const BEYOND: u32 = 2;

/// Storage of a search, made once for a mesh.
#[derive(Clone, Debug)]
pub struct GeodesicDistance {
    vertices: Box<[Vertex]>,
    faces: Box<[FlatFace]>,
    pass: u32,
    reach: f64,
    found: Vec<u32>,
    heap: VertexHeap,
}

/// What a search knows of a vertex, four in a line of the processor's cache: a search at a new place waits mostly for memory.
#[derive(Clone, Copy, Debug)]
#[repr(align(16))]
pub(super) struct Vertex {
    pub distance: f64,
    /// The pass in which it was first seen, and what is known of it in that pass.
    seen: Seen,
    /// Where it is in the heap.
    pub place: u32,
}

/// A pass of the search, whether it has passed the vertex, and the how manieth the vertex is outside the reach, in one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Seen(u32);

/// A face in its own plane, with lengths in mm: of corner `i` the length of the opposite side, the foot on it as it counts from the next
/// corner, and the height above it.
#[derive(Clone, Copy, Debug)]
struct FlatFace {
    corners: [u32; 3],
    sides: [f64; 3],
    feet: [f64; 3],
    heights: [f64; 3],
}

impl GeodesicDistance {
    #[must_use]
    pub fn new(mesh: &TriangleMesh) -> Self {
        let count = mesh.points.len();
        let vertex = Vertex { distance: f64::INFINITY, seen: Seen::NEVER, place: OUT };
        Self {
            vertices: vec![vertex; count].into(),
            faces: mesh.faces.iter().map(|face| FlatFace::new(mesh, *face)).collect(),
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
            && let Some(vertex) = self.heap.pop(&mut self.vertices)
        {
            left -= 1;
            let seen = &mut self.vertices[vertex as usize].seen;
            *seen = seen.passed();
            for &face in mesh.faces_around(vertex) {
                self.cross(vertex, face);
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
        self.heap.clear(&mut self.vertices);
        self.found.clear();
        self.pass += 1;
        if self.pass == Seen::PASSES {
            // After 268 million searches the numbers repeat.
            for vertex in &mut self.vertices {
                vertex.seen = Seen::NEVER;
            }
            self.pass = 1;
        }
    }

    /// What a passed vertex gives the two others of a face.
    #[inline(always)]
    fn cross(&mut self, vertex: u32, face: u32) {
        let face = &self.faces[face as usize];
        let (corners, corner) = (face.corners, face.corner(vertex));
        let Vertex { distance, seen, .. } = self.vertices[vertex as usize];
        let beyond = if distance > self.reach { seen.beyond() + 1 } else { 1 };
        let mut offers = [f64::INFINITY; 2];
        for step in [1, 2] {
            let (to, with) = ((corner + step) % 3, (corner + 3 - step) % 3);
            let limit = self.vertices[corners[to] as usize].limit(self.pass);
            let other = self.vertices[corners[with] as usize];
            // A corner that was passed before has no longer way than along this edge, but may have one across the triangle: the front
            // around a source that is near is round.
            let mut best = distance + face.sides[with];
            if other.seen.is_passed_in(self.pass) {
                let known = [distance, other.distance];
                let known = if step == 1 { [known[1], known[0]] } else { known };
                best = best.min(face.across(to, known, limit).unwrap_or(best));
            }
            if best < limit {
                offers[step - 1] = best;
            }
        }
        for step in [1, 2] {
            if offers[step - 1] < f64::INFINITY {
                self.offer(corners[(corner + step) % 3], offers[step - 1], beyond);
            }
        }
    }

    /// `beyond`: the how manieth it is outside the reach, if it is.
    #[inline(always)]
    fn offer(&mut self, vertex: u32, distance: f64, beyond: u32) {
        if distance.is_nan() || (distance > self.reach && beyond > BEYOND) {
            return;
        }
        let one = &mut self.vertices[vertex as usize];
        if distance >= one.limit(self.pass) {
            return;
        }
        if !one.seen.is_in(self.pass) {
            self.found.push(vertex);
        }
        one.seen = Seen::first(self.pass, beyond);
        one.distance = distance;
        self.heap.raise(&mut self.vertices, vertex, distance);
    }
}

impl Vertex {
    /// No distance from here on changes it in a pass.
    #[inline(always)]
    fn limit(&self, pass: u32) -> f64 {
        match (self.seen.is_in(pass), self.seen.is_passed_in(pass)) {
            (false, _) => f64::INFINITY,
            (true, false) => self.distance,
            (true, true) => self.distance * (1.0 - PASS_AGAIN),
        }
    }
}

impl Seen {
    /// In no pass.
    const NEVER: Self = Self(0);
    const PASSES: u32 = 1 << 28;
    const PASSED: u32 = 8;

    #[inline(always)]
    fn first(pass: u32, beyond: u32) -> Self {
        Self(pass << 4 | beyond)
    }

    #[inline(always)]
    fn passed(self) -> Self {
        Self(self.0 | Self::PASSED)
    }

    #[inline(always)]
    fn beyond(self) -> u32 {
        self.0 % Self::PASSED
    }

    #[inline(always)]
    fn is_in(self, pass: u32) -> bool {
        self.0 >> 4 == pass
    }

    #[inline(always)]
    fn is_passed_in(self, pass: u32) -> bool {
        self.is_in(pass) && self.0 & Self::PASSED != 0
    }
}

impl FlatFace {
    fn new(mesh: &TriangleMesh, corners: [u32; 3]) -> Self {
        let places = corners.map(|corner| mesh.points[corner as usize]);
        let of = |corner: usize| {
            let next = places[(corner + 1) % 3];
            let side = minus(places[(corner + 2) % 3], next);
            let way = minus(places[corner], next);
            let along = length(side);
            [along, dot(way, side) / along, length(cross(way, side)) / along]
        };
        let [a, b, c] = [0, 1, 2].map(of);
        let [sides, feet, heights] = [0, 1, 2].map(|what| [a[what], b[what], c[what]]);
        Self { corners, sides, feet, heights }
    }

    /// Every face around a vertex has it as a corner.
    #[inline(always)]
    fn corner(&self, vertex: u32) -> usize {
        match self.corners {
            [first, ..] if first == vertex => 0,
            [_, second, _] if second == vertex => 1,
            _ => 2,
        }
    }

    /// The distance of a corner where the straight way from the source to it crosses the opposite side, from the distances of the next
    /// corner and of the one after; `None` where it is no shorter than `limit`, too.
    #[inline(always)]
    fn across(&self, corner: usize, [to_next, to_last]: [f64; 2], limit: f64) -> Option<f64> {
        let (side, foot, height) = (self.sides[corner], self.feet[corner], self.heights[corner]);
        // The side is from (0, 0) to (side, 0), the source below it, the corner above.
        let x = 0.5 * (side + (to_next - to_last) * (to_next + to_last) / side);
        let squared = to_next * to_next;
        let y_squared = squared - x * x;
        let wide = foot - x;
        // Before roots: the way is no shorter than the hypotenuse over both heights. A source on the line of the edge is one at which
        // roundings decide.
        if wide * wide + height * height + y_squared >= limit * limit || y_squared < -1e-9 * squared
        {
            return None;
        }
        let y = y_squared.max(0.0).sqrt();
        let high = y + height;
        // Where the way crosses the side, times its height.
        let crossing = x * height + foot * y;
        if !(0.0..=side * high).contains(&crossing) || high <= 0.0 {
            return None;
        }
        let way = (wide * wide + high * high).sqrt();
        (way < limit).then_some(way)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::random::SplitMix;

    /// Sides and heights from a millimetre to a hundredth, sources at hand and far away, against the distance in the plane.
    #[test]
    fn a_way_across_is_straight_and_none_where_it_goes_around_a_corner_or_is_no_shorter() {
        let mut random = SplitMix::seeded(7);
        let mut number = || random.below(1_000_001) as f64 / 1e6;
        let (mut across, mut around) = (0, 0);
        for round in 0..200_000 {
            let [flat, far] = [round % 3, round / 3 % 4].map(|power| 10.0_f64.powi(power));
            let side = 0.01 + number();
            let corner = [3.0 * number() - 1.0, (0.01 + number()) / flat];
            let source = [3.0 * far * number() - far, -0.01 - far * number()];
            let apart = |x: f64, y: f64| (source[0] - x).hypot(source[1] - y);
            let face = FlatFace {
                corners: [0, 1, 2],
                sides: [side, 0.0, 0.0],
                feet: [corner[0], 0.0, 0.0],
                heights: [corner[1], 0.0, 0.0],
            };
            let known = [apart(0.0, 0.0), apart(side, 0.0)];
            let straight = apart(corner[0], corner[1]);
            let crossing =
                source[0] - (corner[0] - source[0]) * source[1] / (corner[1] - source[1]);
            let found = face.across(0, known, f64::INFINITY);
            // The height of a far source is the root of a difference of squares.
            let room = 1e-9 * far * far / side;
            if crossing > room && crossing < side - room {
                let found = found.expect("a way across");
                assert!((found - straight).abs() <= 1e-9 * far * far / side, "{found} {straight}");
                assert!(face.across(0, known, found).is_none());
                assert_eq!(face.across(0, known, found * (1.0 + 1e-12)), Some(found));
                across += 1;
            } else if crossing < -room || crossing > side + room {
                assert_eq!(found, None);
                around += 1;
            }
        }
        assert!(across > 10_000 && around > 10_000, "{across} {around}");
    }
}
