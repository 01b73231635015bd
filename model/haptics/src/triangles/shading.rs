//! Normals for interpolation: one for all faces around a vertex that no edge divides.

use super::mesh::OPEN;
use super::vector::{Vector, cross, dot, minus, plus, unit};

/// Cosine of 45 degrees: faces that turn by more meet in an edge that is felt, as of a plate. Meshes of organs turn by a few degrees.
const CREASE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// For each corner the index of its normal, and the normals.
pub(super) fn shade(
    points: &[Vector],
    faces: &[[u32; 3]],
    neighbours: &[[u32; 3]],
    face_normals: &[Vector],
    (around_first, around): (&[u32], &[u32]),
) -> (Vec<[u32; 3]>, Vec<Vector>) {
    let mut indices = vec![[u32::MAX; 3]; faces.len()];
    let mut normals = Vec::with_capacity(points.len());
    let mut waiting = Vec::new();
    for vertex in 0..points.len() as u32 {
        let [from, to] = [vertex, vertex + 1].map(|index| around_first[index as usize] as usize);
        for &start in &around[from..to] {
            let Some(corner) = corner_of(faces[start as usize], vertex) else { continue };
            if indices[start as usize][corner] != u32::MAX {
                continue;
            }
            let index = normals.len() as u32;
            let mut sum = [0.0; 3];
            indices[start as usize][corner] = index;
            waiting.push((start as usize, corner));
            while let Some((face, corner)) = waiting.pop() {
                sum = plus(sum, 1.0, weighted_normal(points, faces[face], corner));
                // The two edges with this vertex.
                for edge in [corner, (corner + 2) % 3] {
                    let other = neighbours[face][edge];
                    if other == OPEN
                        || dot(face_normals[face], face_normals[other as usize]) < CREASE
                    {
                        continue;
                    }
                    let other = other as usize;
                    if let Some(corner) = corner_of(faces[other], vertex)
                        && indices[other][corner] == u32::MAX
                    {
                        indices[other][corner] = index;
                        waiting.push((other, corner));
                    }
                }
            }
            normals.push(unit(sum).unwrap_or(face_normals[start as usize]));
        }
    }
    (indices, normals)
}

pub(super) fn corner_of(face: [u32; 3], vertex: u32) -> Option<usize> {
    face.iter().position(|one| *one == vertex)
}

/// Normal of a face with the weight of one of its corners: exact together where all corners are on a sphere (Max, "Weights for computing
/// vertex normals from facet normals", J. Graph. Tools 4(2) (1999) 1-6). Normals by angles would err in proportion to the edge.
fn weighted_normal(points: &[Vector], face: [u32; 3], corner: usize) -> Vector {
    let at = |step: usize| points[face[(corner + step) % 3] as usize];
    let (one, other) = (minus(at(1), at(0)), minus(at(2), at(0)));
    let squares = dot(one, one) * dot(other, other);
    cross(one, other).map(|part| part / squares)
}
