//! Normals for interpolation: one for all faces around a vertex that no edge divides.

use super::build::corner_angle;
use super::mesh::OPEN;
use super::vector::{Vector, dot, plus, unit};

/// Cosine of 45 degrees: faces that turn by more meet in an edge that is felt, as of a plate. Meshes of organs turn by a few degrees.
const CREASE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// For each corner the index of its normal, and the normals, weighted by angles.
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
                sum = plus(sum, corner_angle(points, faces[face], corner), face_normals[face]);
                // The two edges with this vertex.
                for edge in [corner, (corner + 2) % 3] {
                    let other = neighbours[face][edge];
                    if other == OPEN || dot(face_normals[face], face_normals[other as usize]) < CREASE {
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
