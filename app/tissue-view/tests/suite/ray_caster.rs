//! A reference: rays through the same triangles in double precision, one after the other, without any structure.

use palpate_tissue_view::{Camera, Eye};

pub type Vec3 = [f64; 3];

pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn minus(a: Vec3, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|axis| a[axis] - b[axis])
}

fn unit(a: Vec3) -> Vec3 {
    let length = dot(a, a).sqrt();
    a.map(|part| part / length)
}

/// Between two directions, in degrees.
pub fn angle(a: Vec3, b: Vec3) -> f64 {
    let sine = cross(a, b);
    dot(sine, sine).sqrt().atan2(dot(a, b)).to_degrees()
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HitKind {
    Tissue,
    Probe,
}

#[derive(Clone, Copy, Debug)]
pub struct Hit {
    pub kind: HitKind,
    pub normal: Vec3,
    /// Along the line of sight, in mm: rays have length 1 along it.
    pub distance: f64,
}

/// Heights over a square grid, and a finger: a sphere with an endless cylinder of its radius upward.
pub struct Reference {
    pub side: usize,
    pub spacing: f64,
    pub heights: Vec<f64>,
    pub finger: Option<(Vec3, f64)>,
}

impl Reference {
    fn place(&self, column: usize, row: usize) -> Vec3 {
        let [x, y] = [column, row].map(|step| step as f64 * self.spacing);
        [x, y, self.heights[row * self.side + column]]
    }

    /// Central differences, one-sided at the border.
    fn normal(&self, column: usize, row: usize) -> Vec3 {
        let last = self.side - 1;
        let slope = |low: (usize, usize), high: (usize, usize)| {
            let rise = minus(self.place(high.0, high.1), self.place(low.0, low.1));
            rise[2] / (rise[0] + rise[1])
        };
        let [west, east] = [column.saturating_sub(1), (column + 1).min(last)];
        let [south, north] = [row.saturating_sub(1), (row + 1).min(last)];
        unit([-slope((west, row), (east, row)), -slope((column, south), (column, north)), 1.0])
    }

    /// Places and normals of the corners of all triangles.
    fn triangles(&self) -> Vec<[[Vec3; 3]; 2]> {
        let cells =
            (0..self.side - 1).flat_map(|row| (0..self.side - 1).map(move |column| (column, row)));
        let nodes = cells.flat_map(|(column, row)| {
            let [a, b] = [(column, row), (column + 1, row)];
            let [c, d] = [(column + 1, row + 1), (column, row + 1)];
            [[a, b, c], [a, c, d]]
        });
        nodes
            .map(|nodes| {
                let place = nodes.map(|(column, row)| self.place(column, row));
                [place, nodes.map(|(column, row)| self.normal(column, row))]
            })
            .collect()
    }

    /// What the pixels of a picture see, row by row from the top.
    pub fn picture(&self, camera: &Camera, eye: Eye, size: [u32; 2]) -> Vec<Option<Hit>> {
        picture_of(&self.triangles(), self.finger, camera, (eye, size))
    }
}

/// Places and normals of the corners of triangles. The normals are summed triangle by triangle with the weights of Max
/// ("Weights for computing vertex normals from facet normals", 1999).
pub fn corners_of(places: &[Vec3], faces: &[[u32; 3]]) -> Vec<[[Vec3; 3]; 2]> {
    let mut normals = vec![[0.0; 3]; places.len()];
    for face in faces {
        let [a, b, c] = face.map(|node| places[node as usize]);
        let sides = [minus(b, a), minus(c, b), minus(a, c)];
        let squares = sides.map(|side| dot(side, side));
        let across = cross(sides[0], minus(c, a));
        for (corner, node) in face.iter().enumerate() {
            let weight = squares[corner] * squares[(corner + 2) % 3];
            let sum = &mut normals[*node as usize];
            *sum = [0, 1, 2].map(|axis| sum[axis] + across[axis] / weight);
        }
    }
    let corner = |node: &u32| (places[*node as usize], unit(normals[*node as usize]));
    faces
        .iter()
        .map(|face| [face.map(|node| corner(&node).0), face.map(|node| corner(&node).1)])
        .collect()
}

/// What the pixels of a picture of triangles and a finger see, row by row from the top.
pub fn picture_of(
    triangles: &[[[Vec3; 3]; 2]],
    finger: Option<(Vec3, f64)>,
    camera: &Camera,
    (eye, [wide, high]): (Eye, [u32; 2]),
) -> Vec<Option<Hit>> {
    let from = camera.eye(eye);
    let half = [wide, high].map(|side| f64::from(side) / 2.0);
    let pixels = (0..high).flat_map(|row| (0..wide).map(move |column| (column, row)));
    pixels
        .map(|(column, row)| {
            let at = [
                (f64::from(column) + 0.5 - half[0]) / half[1],
                (half[1] - f64::from(row) - 0.5) / half[1],
            ];
            first_hit(triangles, finger, from, camera.ray(at, eye))
        })
        .collect()
}

/// What a ray meets first.
fn first_hit(
    triangles: &[[[Vec3; 3]; 2]],
    finger: Option<(Vec3, f64)>,
    from: Vec3,
    way: Vec3,
) -> Option<Hit> {
    let mut first = finger.and_then(|finger| finger_hit(finger, from, way));
    for [places, normals] in triangles {
        let Some((distance, shares)) = triangle_hit(*places, from, way) else { continue };
        if first.is_some_and(|hit| hit.distance <= distance) {
            continue;
        }
        let mixed = [0, 1, 2]
            .map(|axis| (0..3).map(|corner| shares[corner] * normals[corner][axis]).sum::<f64>());
        first = Some(Hit { kind: HitKind::Tissue, normal: unit(mixed), distance });
    }
    first
}

/// Distance and shares of the corners (Moeller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997).
fn triangle_hit([a, b, c]: [Vec3; 3], from: Vec3, way: Vec3) -> Option<(f64, Vec3)> {
    let (to_b, to_c) = (minus(b, a), minus(c, a));
    let across = cross(way, to_c);
    let determinant = dot(to_b, across);
    let start = minus(from, a);
    let share_b = dot(start, across) / determinant;
    let other = cross(start, to_b);
    let share_c = dot(way, other) / determinant;
    let distance = dot(to_c, other) / determinant;
    let is_inside = share_b >= 0.0 && share_c >= 0.0 && share_b + share_c <= 1.0;
    (is_inside && distance > 0.0).then_some((distance, [1.0 - share_b - share_c, share_b, share_c]))
}

fn finger_hit((centre, radius): (Vec3, f64), from: Vec3, way: Vec3) -> Option<Hit> {
    let start = minus(from, centre);
    let nearest = |a: Vec3, b: Vec3| {
        let (square, half) = (dot(b, b), dot(a, b));
        let inside = half * half - square * (dot(a, a) - radius * radius);
        (inside > 0.0).then(|| (-half - inside.sqrt()) / square).filter(|out| *out > 0.0)
    };
    let met = |out: f64| [0, 1, 2].map(|axis| (start[axis] + out * way[axis]) / radius);
    let hit = |out: f64, normal: Vec3| Hit { kind: HitKind::Probe, normal, distance: out };
    let ball = nearest(start, way).filter(|out| met(*out)[2] <= 0.0);
    let tube = nearest([start[0], start[1], 0.0], [way[0], way[1], 0.0]);
    let tube = tube.filter(|out| met(*out)[2] >= 0.0);
    match (ball, tube) {
        (Some(out), _) => Some(hit(out, met(out))),
        (None, Some(out)) => {
            let [x, y, _] = met(out);
            Some(hit(out, [x, y, 0.0]))
        }
        (None, None) => None,
    }
}
