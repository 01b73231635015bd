//! Why a mesh cannot be, in sentences.

use thiserror::Error;

/// A mesh that cannot be.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MeshError {
    /// Too few nodes, or too many.
    #[error(
        "a mesh of {columns} x {rows} nodes is not possible; each side has 2 to 65535 nodes and all together at most 16777216"
    )]
    Size {
        /// Nodes along x.
        columns: usize,
        /// Nodes along y.
        rows: usize,
    },
    /// No distance.
    #[error("nodes {0} mm apart are not possible; the spacing is from 0.000001 to 1000 mm")]
    Spacing(f64),
    /// Not a number for each node.
    #[error("there are {given} {what} for {nodes} nodes; give one for each, row by row")]
    Count { what: &'static str, given: usize, nodes: usize },
    /// No height.
    #[error(
        "the rest height of column {column}, row {row} is {height} mm; heights are within 1000000 mm of zero"
    )]
    Height {
        column: usize,
        row: usize,
        /// Its height in mm.
        height: f64,
    },
    /// No limit.
    #[error("a MaxShear of {0} mm is not possible; it is zero or more, and may be infinite")]
    Shear(f64),
    /// The surface at rest breaks its own limits.
    #[error(
        "at rest, column {column}, row {row} is {rise} mm from its neighbour in height, and MaxShear there is {limit} mm; make the rest surface smoother or MaxShear larger"
    )]
    Steep {
        column: usize,
        row: usize,
        /// Difference of heights in mm.
        rise: f64,
        limit: f64,
    },
}
