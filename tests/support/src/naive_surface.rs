//! ChainMail along z as it is first written: a queue and a set that allocate, limits by link. Order
//! and limits can be chosen, wrong ones too.
use std::collections::{HashSet, VecDeque};

/// Order of the waiting nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PassOrder {
    /// The one that moved first.
    First,
    /// The one that moved last: right in one dimension, wrong in two.
    Last,
}

/// Pushes node `seed` down to `height`; `limit` is MaxShear between two indices. How many moved.
pub fn push(
    z: &mut [f64],
    columns: usize,
    limit: impl Fn(usize, usize) -> f64,
    (seed, height): (usize, f64),
    order: PassOrder,
) -> usize {
    if z[seed] <= height {
        return 0;
    }
    z[seed] = height;
    let mut moved = HashSet::from([seed]);
    let mut waiting = VecDeque::from([seed]);
    let next = |waiting: &mut VecDeque<usize>| match order {
        PassOrder::First => waiting.pop_front(),
        PassOrder::Last => waiting.pop_back(),
    };
    while let Some(node) = next(&mut waiting) {
        for other in neighbours(node, columns, z.len()) {
            let allowed = z[node] + limit(node, other);
            if z[other] > allowed && moved.insert(other) {
                z[other] = allowed;
                waiting.push_back(other);
            }
        }
    }
    moved.len()
}

/// Indices of the nodes beside one.
pub fn neighbours(node: usize, columns: usize, nodes: usize) -> Vec<usize> {
    let column = node % columns;
    let mut beside = Vec::new();
    if column > 0 {
        beside.push(node - 1);
    }
    if column + 1 < columns {
        beside.push(node + 1);
    }
    if node >= columns {
        beside.push(node - columns);
    }
    if node + columns < nodes {
        beside.push(node + columns);
    }
    beside
}

/// Most that a link is beyond its limit.
pub fn worst_excess(z: &[f64], columns: usize, limit: impl Fn(usize, usize) -> f64) -> f64 {
    let mut worst = f64::NEG_INFINITY;
    for node in 0..z.len() {
        for other in neighbours(node, columns, z.len()) {
            worst = worst.max((z[node] - z[other]).abs() - limit(node, other));
        }
    }
    worst
}

/// Normals of all nodes, each from the faces around it.
pub fn normals(z: &[f64], columns: usize, spacing: f64) -> Vec<[f64; 3]> {
    let rows = z.len() / columns;
    let at = |column: usize, row: usize| z[row * columns + column];
    let face = |column: usize, row: usize| {
        let [a, b] = [at(column, row), at(column + 1, row)];
        let [c, d] = [at(column, row + 1), at(column + 1, row + 1)];
        // Diagonals (h, h, d - a) and (-h, h, c - b).
        let (p, q, h) = (d - a, c - b, spacing);
        unit([h * q - p * h, -p * h - h * q, 2.0 * h * h])
    };
    let mut normals = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let mut sum = [0.0; 3];
            for face_row in row.saturating_sub(1)..(row + 1).min(rows - 1) {
                for face_column in column.saturating_sub(1)..(column + 1).min(columns - 1) {
                    let normal = face(face_column, face_row);
                    sum = [0, 1, 2].map(|axis| sum[axis] + normal[axis]);
                }
            }
            normals.push(unit(sum));
        }
    }
    normals
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v.map(|x| x / length)
}
