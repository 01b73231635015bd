//! Vectors, random places and slow searches for tests of meshes.

use palpate_haptics::triangles::{TriangleMesh, TriangleSoup};
use palpate_model::random::SplitMix;

pub fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| a[axis] - b[axis])
}

pub fn plus(a: [f64; 3], share: f64, b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| a[axis] + share * b[axis])
}

pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

pub fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = length(a);
    a.map(|part| part / length)
}

pub fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    length(minus(a, b))
}

/// Uniform between two numbers.
pub fn uniform(random: &mut SplitMix, from: f64, to: f64) -> f64 {
    const STEPS: usize = 1 << 40;
    from + (to - from) * random.below(STEPS) as f64 / STEPS as f64
}

pub fn within(random: &mut SplitMix, low: [f64; 3], high: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| uniform(random, low[axis], high[axis]))
}

pub fn direction(random: &mut SplitMix) -> [f64; 3] {
    unit([0, 1, 2].map(|_| random.normal()))
}

pub fn mesh(soup: TriangleSoup) -> TriangleMesh {
    TriangleMesh::new(soup).expect("a mesh")
}

pub fn corners(mesh: &TriangleMesh, face: usize) -> [[f64; 3]; 3] {
    mesh.faces()[face].map(|vertex| mesh.points()[vertex as usize])
}

/// Distance to a triangle by its plane and its three edges, each on its own.
pub fn distance_to(triangle: [[f64; 3]; 3], place: [f64; 3]) -> f64 {
    let [a, b, c] = triangle;
    let edges = [[a, b], [b, c], [c, a]].map(|[from, to]| {
        let way = minus(to, from);
        let share = (dot(minus(place, from), way) / dot(way, way)).clamp(0.0, 1.0);
        apart(plus(from, share, way), place)
    });
    let normal = unit(cross(minus(b, a), minus(c, a)));
    let height = dot(minus(place, a), normal);
    let foot = plus(place, -height, normal);
    let is_over = [[a, b], [b, c], [c, a]]
        .iter()
        .all(|[from, to]| dot(cross(minus(*to, *from), minus(foot, *from)), normal) >= 0.0);
    let least = edges.into_iter().fold(f64::INFINITY, f64::min);
    if is_over { least.min(height.abs()) } else { least }
}

pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Share of a way at which it meets a triangle, by solving for the place in the triangle (Cramer's rule).
pub fn hit_share(triangle: [[f64; 3]; 3], from: [f64; 3], along: [f64; 3]) -> Option<f64> {
    let [a, b, c] = triangle;
    let (ab, ac, way) = (minus(b, a), minus(c, a), minus(from, a));
    let across = cross(along, ac);
    let volume = dot(ab, across);
    if volume == 0.0 {
        return None;
    }
    let u = dot(way, across) / volume;
    let v = dot(along, cross(way, ab)) / volume;
    let share = dot(ac, cross(way, ab)) / volume;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && (0.0..=1.0).contains(&share)).then_some(share)
}
