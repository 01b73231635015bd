//! Meshes by formula, the same bits from the same numbers.

use super::mesh::TriangleSoup;
use super::vector::{Vector, cross, plus, unit};
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// A rectangle in the plane z = 0 from the origin, normal up, open around: `cells` squares along x and y, two triangles each.
#[must_use]
pub fn plate(side_mm: [f64; 2], cells: [usize; 2]) -> TriangleSoup {
    let cells = cells.map(|count| count.max(1));
    let mut soup = TriangleSoup::default();
    for row in 0..=cells[1] {
        for column in 0..=cells[0] {
            let at = |axis: usize, step: usize| side_mm[axis] * step as f64 / cells[axis] as f64;
            soup.points.push([at(0, column), at(1, row), 0.0]);
        }
    }
    for row in 0..cells[1] {
        for column in 0..cells[0] {
            let first = row * (cells[0] + 1) + column;
            let [a, b, c, d] = [first, first + 1, first + cells[0] + 1, first + cells[0] + 2]
                .map(|index| index as u32);
            soup.faces.extend([[a, b, d], [a, d, c]]);
        }
    }
    soup
}

/// A box from the origin, two triangles a side, normals outwards.
#[must_use]
pub fn cuboid(side_mm: [f64; 3]) -> TriangleSoup {
    let points = (0..8).map(|corner: usize| {
        [0, 1, 2].map(|axis| if corner >> axis & 1 == 1 { side_mm[axis] } else { 0.0 })
    });
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    TriangleSoup {
        points: points.collect(),
        faces: quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect(),
        colours: Vec::new(),
    }
}

/// A ball around the origin: an icosahedron whose triangles are divided into four, `times` times; 20 * 4^times of them, on the sphere with
/// their corners. Seven times at most.
#[must_use]
pub fn ball(radius_mm: f64, times: u32) -> TriangleSoup {
    let golden = 0.5 * (1.0 + 5.0f64.sqrt());
    let mut points: Vec<Vector> = Vec::new();
    for (one, other) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        points.extend([[0.0, one, other], [one, other, 0.0], [other, 0.0, one]]);
    }
    let mut faces: Vec<[u32; 3]> = Vec::new();
    for a in 0..12u32 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [p, q, r] = [a, b, c].map(|index| points[index as usize]);
                // Neighbours are 2 apart, others more than 3.
                let near = |p: Vector, q: Vector| {
                    (0..3).map(|axis| (p[axis] - q[axis]).powi(2)).sum::<f64>() < 5.0
                };
                if near(p, q) && near(q, r) && near(p, r) {
                    let is_outward = super::vector::dot(p, cross(q, r)) > 0.0;
                    faces.push(if is_outward { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    for point in &mut points {
        *point = on_sphere(*point);
    }
    for _ in 0..times.min(7) {
        faces = divide(&mut points, &faces);
    }
    let points = points.iter().map(|point| point.map(|part| radius_mm * part)).collect();
    TriangleSoup { points, faces, colours: Vec::new() }
}

fn on_sphere(point: Vector) -> Vector {
    unit(point).unwrap_or(point)
}

fn divide(points: &mut Vec<Vector>, faces: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
    let mut divided = Vec::with_capacity(4 * faces.len());
    for &[a, b, c] in faces {
        let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[from, to]| {
            *middles.entry([from.min(to), from.max(to)]).or_insert_with(|| {
                let middle = plus(points[from as usize], 1.0, points[to as usize]);
                points.push(on_sphere(middle));
                points.len() as u32 - 1
            })
        });
        divided.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    divided
}

/// Faces of [`stomach`].
pub const STOMACH_FACES: usize = 2 * STOMACH_SIDES * (STOMACH_RINGS - 1);
const STOMACH_RINGS: usize = 158;
const STOMACH_SIDES: usize = 160;

/// A closed, smooth surface like a stomach, 50 240 triangles: a curved tube with a fundus above its beginning, a wide body, and
/// a narrow end. About 220 mm long. Its proportions are chosen, not measured.
#[must_use]
pub fn stomach() -> TriangleSoup {
    tube(STOMACH_RINGS, STOMACH_SIDES, stomach_axis, stomach_radius)
}

/// Axis of the stomach: down from the fundus and round to the right. `share` from 0 to 1.
fn stomach_axis(share: f64) -> Vector {
    let bend = PI * (1.15 * share - 0.1);
    [75.0 - 75.0 * bend.cos(), 12.0 * (TAU * share).sin(), 60.0 - 95.0 * bend.sin() - 30.0 * share]
}

fn stomach_radius(share: f64) -> f64 {
    // Round ends, a fundus at 0.18, a body and an antrum that narrows.
    let ends = (1.0 - (2.0 * share - 1.0).powi(8)).max(0.0).sqrt();
    let fundus = 12.0 * (-((share - 0.18) / 0.16).powi(2)).exp();
    ends * (34.0 - 20.0 * share * share + fundus)
}

/// A tube of rings around an axis, closed by a point at each end, where its radius is zero. Rings are turned as little as possible.
fn tube(
    rings: usize,
    sides: usize,
    axis: fn(f64) -> Vector,
    radius: fn(f64) -> f64,
) -> TriangleSoup {
    const STEP: f64 = 1e-4;
    let mut soup = TriangleSoup::default();
    let mut across = [0.0, 1.0, 0.0];
    soup.points.push(axis(0.0));
    for ring in 1..rings {
        // Rings are nearer to each other towards the ends, where the radius changes most.
        let share = 0.5 - 0.5 * (PI * ring as f64 / rings as f64).cos();
        let way = plus(axis(share + STEP), -1.0, axis(share - STEP));
        let forward = unit(way).unwrap_or([0.0, 0.0, 1.0]);
        let level = plus(across, -super::vector::dot(across, forward), forward);
        across = unit(level).unwrap_or(across);
        let upward = cross(forward, across);
        let (middle, wide) = (axis(share), radius(share));
        for side in 0..sides {
            let (sin, cos) = (TAU * side as f64 / sides as f64).sin_cos();
            soup.points.push(plus(plus(middle, wide * cos, across), wide * sin, upward));
        }
    }
    soup.points.push(axis(1.0));
    let at = |ring: usize, side: usize| (1 + (ring - 1) * sides + side % sides) as u32;
    let end = soup.points.len() as u32 - 1;
    for side in 0..sides {
        soup.faces.push([0, at(1, side + 1), at(1, side)]);
        for ring in 1..rings - 1 {
            let [a, b] = [at(ring, side), at(ring, side + 1)];
            let [c, d] = [at(ring + 1, side), at(ring + 1, side + 1)];
            soup.faces.extend([[a, b, d], [a, d, c]]);
        }
        soup.faces.push([at(rings - 1, side), at(rings - 1, side + 1), end]);
    }
    soup
}

/// Middle of the nodule of [`phantom`] in mm.
pub const NODULE_MM: [f64; 3] = [20.0, 10.0, 22.0];
/// Radius of the nodule in mm.
pub const NODULE_RADIUS_MM: f64 = 8.0;

/// An organ phantom of 20 480 triangles: half axes of 50, 35 and 25 mm, red, with a stiffer nodule, green, and a border of 3 mm between them.
#[must_use]
pub fn phantom() -> TriangleSoup {
    let mut soup = ball(1.0, 5);
    for point in &mut soup.points {
        *point = [50.0 * point[0], 35.0 * point[1], 25.0 * point[2]];
        let way = plus(*point, -1.0, NODULE_MM);
        let distance = super::vector::length(way);
        let green = ((NODULE_RADIUS_MM + 1.5 - distance) / 3.0).clamp(0.0, 1.0);
        soup.colours.push([1.0 - green, green, 0.0]);
    }
    soup
}
