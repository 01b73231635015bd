//! Contacts with a surface, and bounds of their influence.

use super::grid::{Grid, GridNode};
use super::mesh::HIGHEST_MM;
use crate::{SettingError, SettingRange};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactSide {
    /// The surface is never above it: down where it is.
    Push,
    /// The surface is never below it: up where it is.
    Pull,
}

/// A point that the node nearest to it cannot pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceContact {
    /// Along columns, in mm.
    pub x: f64,
    /// Along rows, in mm.
    pub y: f64,
    pub z: f64,
    pub side: ContactSide,
}

/// Bounds of a contact's influence, for speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// Most steps along the axes from a contact to a node it moves.
    range: u32,
    /// Nodes that would move by no more than this are left where they are, in mm; never the touched one.
    threshold: f64,
}

impl Cut {
    /// Nothing is left out.
    pub const NONE: Self = Self { range: u32::MAX, threshold: 0.0 };

    /// No further than `range` steps (`None`: however far), nor where less than `threshold` mm.
    pub fn new(range: Option<u32>, threshold: f64) -> Result<Self, SettingError> {
        let settings = [("movement threshold", threshold, " mm")];
        SettingRange::NotNegative.check("a cut", &settings)?;
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
    pub node: GridNode,
    pub z: f64,
    pub side: ContactSide,
}

impl Poke {
    pub(super) const NOWHERE: Self =
        Self { node: GridNode { column: 0, row: 0 }, z: 0.0, side: ContactSide::Push };
}

impl SurfaceContact {
    /// At a node of a grid.
    #[must_use]
    pub fn at(grid: &Grid, node: GridNode, z: f64, side: ContactSide) -> Self {
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
