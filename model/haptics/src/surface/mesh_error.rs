//! Why a mesh cannot be, in sentences.

use thiserror::Error;

/// A mesh that cannot be.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MeshError {
    /// Too few nodes, or too many.
    #[error(
        "a mesh of {columns} x {rows} nodes is not possible; choose 2 to 65535 nodes for each side and at most 16777216 in all"
    )]
    Size {
        /// Nodes along x.
        columns: usize,
        /// Nodes along y.
        rows: usize,
    },
    /// No distance.
    #[error("a node spacing of {0} mm is not possible; choose from 0.000001 mm to 1000 mm")]
    Spacing(f64),
    /// Not a number for each node.
    #[error(
        "the mesh has {given} {what} for {nodes} nodes; give one height for each node, row by row"
    )]
    Count { what: &'static str, given: usize, nodes: usize },
    /// No height.
    #[error(
        "the rest height of column {column}, row {row} is {height} mm; heights must be within 1000000 mm of zero"
    )]
    Height {
        column: usize,
        row: usize,
        /// Its height in mm.
        height: f64,
    },
    /// No limit.
    #[error(
        "a limit of {0} mm for the height difference of neighbouring nodes is not possible; choose zero, a positive number or infinity"
    )]
    Shear(f64),
    /// The surface at rest breaks its own limits.
    #[error(
        "the rest heights of column {column}, row {row} and its neighbour differ by {rise} mm, more than the {limit} mm allowed between neighbouring nodes; make the rest surface smoother or allow a steeper slope"
    )]
    Steep {
        column: usize,
        row: usize,
        /// Difference of heights in mm.
        rise: f64,
        limit: f64,
    },
}
