//! Which nodes of a mesh stand for others where a level of detail leaves nodes out, and whether a mesh has an inner side.

use crate::camera::{Vec3, cross, dot, minus};
use std::collections::{HashMap, HashSet};

/// One of so many nodes along each direction: what levels of detail have.
const THINNED: [u32; 3] = [2, 3, 4];

/// For each thinning the node that stands for each.
///
/// Nodes in one cell of a grid that face the same way have one node that stands for them, the first, where it is (Rossignac and
/// Borrel, "Multi-resolution 3D approximations for rendering complex scenes", Modeling in Computer Graphics, 1993). Cells are
/// so many mean edges wide. Facing keeps the two sides of a thin wall apart.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Thinning([Vec<u32>; THINNED.len()]);

impl Thinning {
    pub fn new(places: &[Vec3], normals: &[Vec3], indices: &[u32]) -> Self {
        let edge = mean_edge(places, indices);
        Self(THINNED.map(|every| {
            let cell = f64::from(every) * edge;
            let mut first = HashMap::with_capacity(places.len() / 3);
            let nodes = places.iter().zip(normals).enumerate();
            nodes
                .map(|(node, (place, normal))| {
                    let key = (place.map(|part| (part / cell).floor() as i64), facing(*normal));
                    *first.entry(key).or_insert(node as u32)
                })
                .collect()
        }))
    }

    /// `None` where all nodes are drawn.
    pub fn standing(&self, every: u32) -> Option<&[u32]> {
        let last = THINNED[THINNED.len() - 1];
        let at = THINNED.iter().position(|one| *one == every.min(last))?;
        Some(&self.0[at])
    }
}

/// The axis along which a direction is longest, and on which side.
fn facing(way: Vec3) -> (usize, bool) {
    let longer =
        |one: usize, other: usize| if way[other].abs() > way[one].abs() { other } else { one };
    let axis = longer(longer(0, 1), 2);
    (axis, way[axis] > 0.0)
}

/// In mm; 1 without triangles.
fn mean_edge(places: &[Vec3], indices: &[u32]) -> f64 {
    let mut sum = 0.0;
    for face in indices.chunks_exact(3) {
        for corner in 0..3 {
            let [from, to] = [corner, (corner + 1) % 3].map(|at| places[face[at] as usize]);
            let way = minus(to, from);
            sum += dot(way, way).sqrt();
        }
    }
    if sum > 0.0 { sum / indices.len() as f64 } else { 1.0 }
}

/// Whether no inner side can be seen: every edge has a triangle on each side, and triangles face outwards.
pub(crate) fn is_closed(places: &[Vec3], indices: &[u32]) -> bool {
    let faces = indices.chunks_exact(3);
    let edges: HashSet<[u32; 2]> =
        faces.clone().flat_map(|face| [0, 1, 2].map(|at| [face[at], face[(at + 1) % 3]])).collect();
    // Six times the volume.
    let volume: f64 = faces
        .map(|face| {
            let [a, b, c] = [0, 1, 2].map(|at| places[face[at] as usize]);
            dot(a, cross(b, c))
        })
        .sum();
    volume > 0.0 && edges.iter().all(|[from, to]| edges.contains(&[*to, *from]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_of_a_cell_have_one_that_stands_for_them_and_the_sides_of_a_wall_do_not_mix() {
        let places: Vec<Vec3> = (0..8).map(|node| [f64::from(node), 0.25, 0.25]).collect();
        let faces: Vec<u32> = (0..7).flat_map(|node| [node, node + 1, node]).collect();
        let mut normals = vec![[0.0, 0.0, 1.0]; 8];
        normals[5] = [0.0, 0.1, -1.0];
        // Edges of 1, 1 and 0 mm: for every third node a cell is 2 mm wide.
        let thinning = Thinning::new(&places, &normals, &faces);
        assert_eq!(thinning.standing(1), None);
        assert_eq!(thinning.standing(3).unwrap(), [0, 0, 2, 2, 4, 5, 6, 6]);
        assert_eq!(thinning.standing(9), thinning.standing(4));
    }

    #[test]
    fn a_tetrahedron_is_closed_and_without_a_side_or_turned_over_it_is_not() {
        let places = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let faces = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
        assert!(is_closed(&places, &faces));
        assert!(!is_closed(&places, &faces[3..]));
        let turned: Vec<u32> = faces.iter().rev().copied().collect();
        assert!(!is_closed(&places, &turned));
    }
}
