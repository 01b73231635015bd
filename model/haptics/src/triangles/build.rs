//! From loose triangles to a mesh: checks, neighbours, the outer side.

use super::error::TriangleMeshError as Error;
use super::mesh::{LARGEST_MM, MOST_FACES, OPEN, SMALLEST_MM, TriangleMesh, TriangleSoup};
use super::shading::shade;
use super::tree::Tree;
use super::vector::{Vector, angle, cross, dot, is_finite, length, minus, plus, unit};
use super::weld::{WELD_SHARE, weld};
use std::collections::HashMap;

pub(super) fn build(soup: TriangleSoup) -> Result<TriangleMesh, Error> {
    check(&soup)?;
    let [low, high] = box_of(&soup);
    let size = largest(minus(high, low));
    if size > LARGEST_MM {
        return Err(Error::TooLarge { size_mm: size, most_mm: LARGEST_MM });
    }
    if size < SMALLEST_MM {
        return Err(Error::TooSmall { size_mm: size, least_mm: SMALLEST_MM });
    }
    // Far from the origin, roundings of a file are those of its coordinates.
    let tolerance = WELD_SHARE * size.max(largest(low)).max(largest(high));
    let (points, vertex_of_file) = weld(&soup.points, tolerance);
    let mut faces: Vec<[u32; 3]> =
        soup.faces.iter().map(|face| face.map(|vertex| vertex_of_file[vertex as usize])).collect();
    check_areas(&points, &faces, tolerance)?;
    let mut neighbours = neighbours(&points, &faces)?;
    let parts = orient(&points, &mut faces, &mut neighbours)?;
    Ok(finish(points, faces, neighbours, parts, vertex_of_file))
}

fn check(soup: &TriangleSoup) -> Result<(), Error> {
    let vertices = soup.points.len();
    if soup.faces.is_empty() {
        return Err(Error::Empty);
    }
    if soup.faces.len() > MOST_FACES {
        return Err(Error::TooManyFaces { faces: soup.faces.len(), most: MOST_FACES });
    }
    if !soup.colours.is_empty() && soup.colours.len() != vertices {
        return Err(Error::Colours { given: soup.colours.len(), vertices });
    }
    if let Some(vertex) = soup.points.iter().position(|point| !is_finite(*point)) {
        return Err(Error::NotANumber { vertex });
    }
    for (face, corners) in soup.faces.iter().enumerate() {
        let beyond = corners.iter().find(|vertex| **vertex as usize >= vertices);
        if let Some(&vertex) = beyond {
            return Err(Error::Index { face, vertex: vertex as usize, vertices });
        }
    }
    Ok(())
}

/// Of the vertices that triangles have: a file may have others.
fn box_of(soup: &TriangleSoup) -> [Vector; 2] {
    let start = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    soup.faces.iter().flatten().fold(start, |[low, high], &vertex| {
        let point = soup.points[vertex as usize];
        [
            [0, 1, 2].map(|axis| low[axis].min(point[axis])),
            [0, 1, 2].map(|axis| high[axis].max(point[axis])),
        ]
    })
}

fn largest(parts: Vector) -> f64 {
    parts.iter().fold(0.0, |most, part| part.abs().max(most))
}

/// A triangle lower than the tolerance has a normal of roundings.
fn check_areas(points: &[Vector], faces: &[[u32; 3]], tolerance_mm: f64) -> Result<(), Error> {
    let is_flat = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|vertex| points[vertex as usize]);
        let longest = edge_lengths(points, face).into_iter().fold(0.0, f64::max);
        length(cross(minus(b, a), minus(c, a))) <= longest * tolerance_mm
    };
    match faces.iter().position(is_flat) {
        Some(face) => Err(Error::NoArea { face, tolerance_mm }),
        None => Ok(()),
    }
}

fn edge_lengths(points: &[Vector], face: &[u32; 3]) -> [f64; 3] {
    let [a, b, c] = face.map(|vertex| points[vertex as usize]);
    [minus(b, a), minus(c, b), minus(a, c)].map(length)
}

fn neighbours(points: &[Vector], faces: &[[u32; 3]]) -> Result<Vec<[u32; 3]>, Error> {
    let mut neighbours = vec![[OPEN; 3]; faces.len()];
    // The first face and edge with it, and whether there is a second.
    let mut edges: HashMap<[u32; 2], (u32, u8, bool)> = HashMap::with_capacity(faces.len() * 3 / 2);
    for (face, corners) in faces.iter().enumerate() {
        for edge in 0..3 {
            let (from, to) = (corners[edge], corners[(edge + 1) % 3]);
            match edges.entry([from.min(to), from.max(to)]) {
                std::collections::hash_map::Entry::Vacant(one) => {
                    one.insert((face as u32, edge as u8, false));
                }
                std::collections::hash_map::Entry::Occupied(mut one) => {
                    let (other, other_edge, is_full) = *one.get();
                    if is_full {
                        let middle = plus(points[from as usize], 1.0, points[to as usize]);
                        return Err(Error::ThirdFace { face, at: middle.map(|part| 0.5 * part) });
                    }
                    one.get_mut().2 = true;
                    neighbours[face][edge] = other;
                    neighbours[other as usize][usize::from(other_edge)] = face as u32;
                }
            }
        }
    }
    Ok(neighbours)
}

/// What the connected parts are.
struct Parts {
    is_closed: Vec<bool>,
    count: usize,
    turned: usize,
}

fn orient(
    points: &[Vector],
    faces: &mut [[u32; 3]],
    neighbours: &mut [[u32; 3]],
) -> Result<Parts, Error> {
    let mut seen = vec![false; faces.len()];
    let mut is_turned = vec![false; faces.len()];
    let mut parts = Parts { is_closed: vec![false; faces.len()], count: 0, turned: 0 };
    let mut part = Vec::new();
    for start in 0..faces.len() {
        if seen[start] {
            continue;
        }
        parts.count += 1;
        part.clear();
        part.push(start as u32);
        seen[start] = true;
        let mut next = 0;
        let mut is_closed = true;
        while next < part.len() {
            let face = part[next] as usize;
            next += 1;
            for edge in 0..3 {
                let other = neighbours[face][edge];
                if other == OPEN {
                    is_closed = false;
                    continue;
                }
                let (from, to) = (faces[face][edge], faces[face][(edge + 1) % 3]);
                let agrees = !goes(faces[other as usize], from, to);
                let other = other as usize;
                if seen[other] {
                    if !agrees {
                        return Err(Error::NoSides { face: other });
                    }
                    continue;
                }
                if !agrees {
                    turn(&mut faces[other], &mut neighbours[other]);
                    is_turned[other] = true;
                }
                seen[other] = true;
                part.push(other as u32);
            }
        }
        let turned = part.iter().filter(|face| is_turned[**face as usize]).count();
        let is_inside_out =
            if is_closed { volume(points, faces, &part) < 0.0 } else { 2 * turned > part.len() };
        for &face in &part {
            parts.is_closed[face as usize] = is_closed;
            if is_inside_out {
                turn(&mut faces[face as usize], &mut neighbours[face as usize]);
            }
        }
        parts.turned += if is_inside_out { part.len() - turned } else { turned };
    }
    Ok(parts)
}

/// Whether a face has an edge in this direction.
fn goes(face: [u32; 3], from: u32, to: u32) -> bool {
    (0..3).any(|edge| face[edge] == from && face[(edge + 1) % 3] == to)
}

/// The other way round: corners 0, 2, 1 have edges 2, 1, 0.
fn turn(face: &mut [u32; 3], neighbours: &mut [u32; 3]) {
    face.swap(1, 2);
    neighbours.swap(0, 2);
}

/// Six times the volume, from a vertex of the part so that far from the origin nothing is lost.
fn volume(points: &[Vector], faces: &[[u32; 3]], part: &[u32]) -> f64 {
    let origin = points[faces[part[0] as usize][0] as usize];
    part.iter().fold(0.0, |sum, &face| {
        let [a, b, c] = faces[face as usize].map(|vertex| minus(points[vertex as usize], origin));
        sum + dot(a, cross(b, c))
    })
}

fn finish(
    points: Vec<Vector>,
    faces: Vec<[u32; 3]>,
    neighbours: Vec<[u32; 3]>,
    parts: Parts,
    vertex_of_file: Vec<u32>,
) -> TriangleMesh {
    let face_normals: Vec<Vector> = faces
        .iter()
        .map(|face| {
            let [a, b, c] = face.map(|vertex| points[vertex as usize]);
            // A face without area was refused.
            unit(cross(minus(b, a), minus(c, a))).unwrap_or([0.0, 0.0, 1.0])
        })
        .collect();
    let (around_first, around) = faces_around(points.len(), &faces);
    let mut sums = vec![[0.0; 3]; points.len()];
    let mut is_at_open_edge = vec![false; points.len()];
    for (index, face) in faces.iter().enumerate() {
        for corner in 0..3 {
            let vertex = face[corner] as usize;
            sums[vertex] =
                plus(sums[vertex], corner_angle(&points, *face, corner), face_normals[index]);
            if neighbours[index][corner] == OPEN {
                is_at_open_edge[vertex] = true;
                is_at_open_edge[face[(corner + 1) % 3] as usize] = true;
            }
        }
    }
    // Between two faces back to back there is no direction; any will do.
    let vertex_normals = sums.iter().map(|sum| unit(*sum).unwrap_or([0.0, 0.0, 1.0])).collect();
    let (corner_normals, shaded_normals) =
        shade(&points, &faces, &neighbours, &face_normals, (&around_first, &around));
    let open_edges = neighbours.iter().flatten().filter(|other| **other == OPEN).count();
    TriangleMesh {
        tree: Tree::new(&points, &faces),
        points: points.into(),
        faces: faces.into(),
        neighbours: neighbours.into(),
        face_normals: face_normals.into(),
        vertex_normals,
        corner_normals: corner_normals.into(),
        shaded_normals: shaded_normals.into(),
        around_first: around_first.into(),
        around: around.into(),
        is_closed: parts.is_closed.into(),
        is_at_open_edge: is_at_open_edge.into(),
        vertex_of_file: vertex_of_file.into(),
        open_edges,
        parts: parts.count,
        turned: parts.turned,
    }
}

/// Angle of a face at one of its corners in rad.
fn corner_angle(points: &[Vector], face: [u32; 3], corner: usize) -> f64 {
    let at = |step: usize| points[face[(corner + step) % 3] as usize];
    angle(minus(at(1), at(0)), minus(at(2), at(0)))
}

fn faces_around(vertices: usize, faces: &[[u32; 3]]) -> (Vec<u32>, Vec<u32>) {
    let mut first = vec![0u32; vertices + 1];
    for vertex in faces.iter().flatten() {
        first[*vertex as usize + 1] += 1;
    }
    for vertex in 0..vertices {
        first[vertex + 1] += first[vertex];
    }
    let mut filled = first.clone();
    let mut around = vec![0u32; faces.len() * 3];
    for (face, corners) in faces.iter().enumerate() {
        for &vertex in corners {
            let at = &mut filled[vertex as usize];
            around[*at as usize] = face as u32;
            *at += 1;
        }
    }
    (first, around)
}
