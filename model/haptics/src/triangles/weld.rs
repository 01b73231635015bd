//! Vertices at one place become one.
//!
//! STL has three vertices for every triangle, and other formats repeat a vertex for every normal or colour. Only where triangles
//! have a vertex in common are they neighbours.

use super::vector::{Vector, dot, minus};
use std::collections::HashMap;

/// Vertices nearer than this share of the mesh's size are one: 16 roundings of a coordinate in single precision (2^-24 of it), which is
/// what files store. On an organ of 250 mm that is a quarter of a micrometre, far below what a scanner resolves or a hand feels.
pub(super) const WELD_SHARE: f64 = 1e-6;

/// Cells are so many tolerances wide: wide enough that hardly a vertex is near the border of its cell.
const CELL: f64 = 1024.0;

/// The mark of the end of a cell's list.
const END: u32 = u32::MAX;

/// Places without repetition, in the order of their first vertices, and for each vertex which place it has.
pub(super) fn weld(points: &[Vector], tolerance: f64) -> (Vec<Vector>, Vec<u32>) {
    let width = CELL * tolerance;
    let cell = |value: f64| (value / width).floor() as i64;
    let mut first: HashMap<[i64; 3], u32> = HashMap::new();
    let mut next: Vec<u32> = Vec::new();
    let mut places: Vec<Vector> = Vec::new();
    let mut place_of = Vec::with_capacity(points.len());
    for &point in points {
        let [low, high] = [-tolerance, tolerance].map(|step| point.map(|part| cell(part + step)));
        let mut found = None;
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let mut at = first.get(&[x, y, z]).copied().unwrap_or(END);
                    while at != END {
                        let way = minus(places[at as usize], point);
                        if dot(way, way) <= tolerance * tolerance {
                            // The earliest of several, so that the order of cells has no effect.
                            found = Some(found.map_or(at, |other: u32| other.min(at)));
                        }
                        at = next[at as usize];
                    }
                }
            }
        }
        let place = found.unwrap_or_else(|| {
            let place = places.len() as u32;
            let head = first.insert(point.map(cell), place);
            places.push(point);
            next.push(head.unwrap_or(END));
            place
        });
        place_of.push(place);
    }
    (places, place_of)
}
