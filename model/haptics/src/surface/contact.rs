//! What touches a surface, and how far its effect is followed.

use super::grid::{Grid, Node};
use super::mesh::HIGHEST_MM;
use thiserror::Error;

/// Which way a contact moves the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The surface is never above it: down where it is.
    Push,
    /// The surface is never below it: up where it is.
    Pull,
}

/// A point that the node nearest to it cannot pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Along columns, in mm.
    pub x: f64,
    /// Along rows, in mm.
    pub y: f64,
    /// Height in mm.
    pub z: f64,
    /// Which way.
    pub side: Side,
}

/// What of a displacement is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// Most steps along the axes from a contact to a node it moves.
    range: u32,
    /// Nodes that would move by no more than this are left where they are, in mm; never the touched one.
    threshold: f64,
}

/// A cut that cannot be.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("a movement threshold of {0} mm is not possible; it is a finite length, zero or more")]
pub struct CutError(pub f64);

impl Cut {
    /// Nothing is left out.
    pub const NONE: Self = Self { range: u32::MAX, threshold: 0.0 };

    /// No further than `range` steps (`None`: however far), nor where less than `threshold` mm.
    pub fn new(range: Option<u32>, threshold: f64) -> Result<Self, CutError> {
        if !(threshold >= 0.0 && threshold.is_finite()) {
            return Err(CutError(threshold));
        }
        Ok(Self { range: range.unwrap_or(u32::MAX), threshold })
    }

    /// Most steps from a contact; `u32::MAX` where there is no end.
    pub fn range(&self) -> u32 {
        self.range
    }

    /// Least movement in mm.
    pub fn threshold(&self) -> f64 {
        self.threshold
    }
}

/// A contact as the solvers take it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Poke {
    pub node: Node,
    pub z: f64,
    pub side: Side,
}

impl Poke {
    pub(super) const NOWHERE: Self =
        Self { node: Node { column: 0, row: 0 }, z: 0.0, side: Side::Push };
}

impl Contact {
    /// At a node of a grid.
    #[must_use]
    pub fn at(grid: &Grid, node: Node, z: f64, side: Side) -> Self {
        let [x, y] = grid.place(node);
        Self { x, y, z, side }
    }

    /// On which node, and whether its height had to be clamped; `None` outside the grid or where a
    /// number is none.
    pub(super) fn poke(&self, grid: &Grid) -> Option<(Poke, bool)> {
        if self.z.is_nan() {
            return None;
        }
        let node = grid.nearest(self.x, self.y)?;
        let z = self.z.clamp(-HIGHEST_MM, HIGHEST_MM);
        let side = self.side;
        Some((Poke { node, z, side }, z != self.z))
    }
}

/// What a pass did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MoveCounts {
    /// Nodes moved by contacts, counted once for each contact.
    pub moved: usize,
    /// Nodes or links looked at for it.
    pub visited: usize,
}

impl MoveCounts {
    pub(super) fn add(&mut self, other: Self) {
        self.moved += other.moved;
        self.visited += other.visited;
    }
}
