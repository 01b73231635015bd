//! ChainMail, first moved first processed (Gibson, "3D ChainMail: a fast algorithm for deforming
//! volumetric objects", Symposium on Interactive 3D Graphics 1997, 149-154), on a surface (Li & Brodlie,
//! "Soft object modelling with generalised ChainMail", Comput. Graph. Forum 22 (2003)) whose
//! nodes move along z alone.
//!
//! A moved node offers each of its neighbours a move. A neighbour that is further away in height than
//! MaxShear moves just enough, once in a pass. The order matters: the first move that reaches a node must
//! be the largest, and with one limit for all that is the one over the fewest links.

use super::contact::{ContactSide, Cut, MoveCounts, Poke};
use super::envelope::height;
use super::grid::{Grid, GridNode, GridRect};
use super::mesh::HeightField;

/// Storage of a pass, made once.
#[derive(Clone, Debug)]
pub(super) struct Chain {
    /// Nodes in the order in which they moved. A node enters once, so it never overflows and what is
    /// still to process is its end.
    queue: Box<[GridNode]>,
    stamps: Stamps,
    moved: usize,
    /// Rows in which something moved.
    rows: [u16; 2],
}

/// Marks of the nodes that moved in this pass.
#[derive(Clone, Debug)]
pub(super) struct Stamps {
    of: Box<[u32]>,
    pass: u32,
}

impl Stamps {
    pub(super) fn new(nodes: usize) -> Self {
        Self { of: vec![0; nodes].into(), pass: 0 }
    }

    /// A new pass, in which nothing moved yet.
    pub(super) fn begin(&mut self) {
        self.pass = self.pass.wrapping_add(1);
        if self.pass == 0 {
            // After 4 thousand million passes the numbers repeat.
            self.of.fill(0);
            self.pass = 1;
        }
    }

    #[cfg(test)]
    pub(super) fn at_pass(&mut self, pass: u32) {
        self.pass = pass;
    }

    #[inline(always)]
    pub(super) fn has(&self, index: usize) -> bool {
        self.of[index] == self.pass
    }

    #[inline(always)]
    pub(super) fn set(&mut self, index: usize) {
        self.of[index] = self.pass;
    }
}

/// How far a height is beyond what is allowed of it, in mm; above zero: it has to move.
#[inline(always)]
pub(super) fn excess<const PULL: bool>(z: f64, allowed: f64) -> f64 {
    if PULL { allowed - z } else { z - allowed }
}

impl Chain {
    pub(super) fn new(grid: &Grid) -> Self {
        let nodes = grid.nodes();
        Self {
            queue: vec![GridNode::default(); nodes].into(),
            stamps: Stamps::new(nodes),
            moved: 0,
            rows: [0; 2],
        }
    }

    /// One pass for one contact on a field with one MaxShear for all, `shear`.
    pub(super) fn poke(
        &mut self,
        field: &mut HeightField,
        shear: f64,
        cut: Cut,
        poke: Poke,
    ) -> MoveCounts {
        self.stamps.begin();
        self.moved = 0;
        match poke.side {
            ContactSide::Push => self.spread::<false>(field, shear, cut, poke),
            ContactSide::Pull => self.spread::<true>(field, shear, cut, poke),
        }
    }

    fn spread<const PULL: bool>(
        &mut self,
        field: &mut HeightField,
        shear: f64,
        cut: Cut,
        poke: Poke,
    ) -> MoveCounts {
        let seed = field.grid.index(poke.node);
        if excess::<PULL>(field.now[seed], poke.z) <= 0.0 {
            return MoveCounts::default();
        }
        let mut counts = MoveCounts::default();
        self.rows = [poke.node.row, poke.node.row + 1];
        self.put(field, poke.node, seed, poke.z);
        let [last_column, last_row] = [field.grid.columns() - 1, field.grid.rows() - 1];
        let columns = field.grid.columns();
        let mut next = 0;
        while next < self.moved {
            let GridNode { column, row } = self.queue[next];
            next += 1;
            if poke.node.steps_to(GridNode { column, row }) >= cut.range() {
                continue;
            }
            let index = field.grid.index(GridNode { column, row });
            let allowed = height::<PULL>(field.now[index], 1.0, shear);
            let mut offer = |column, row, index| {
                counts.visited += 1;
                // Nodes that moved are mostly where they may be: looking at the height first saves
                // looking at the mark.
                if excess::<PULL>(field.now[index], allowed) > cut.threshold()
                    && !self.stamps.has(index)
                {
                    self.put(field, GridNode { column, row }, index, allowed);
                }
            };
            if column > 0 {
                offer(column - 1, row, index - 1);
            }
            if usize::from(column) < last_column {
                offer(column + 1, row, index + 1);
            }
            if row > 0 {
                offer(column, row - 1, index - columns);
            }
            if usize::from(row) < last_row {
                offer(column, row + 1, index + columns);
            }
        }
        let rows = self.rows.map(u32::from);
        field.displaced.widen(GridRect { rows, ..field.grid.whole() });
        field.displaced.tighten();
        extend_bounds::<PULL>(field, poke.z);
        counts.moved = self.moved;
        counts
    }

    #[inline(always)]
    fn put(&mut self, field: &mut HeightField, node: GridNode, index: usize, z: f64) {
        field.now[index] = z;
        field.displaced.include(node);
        self.stamps.set(index);
        self.rows = [self.rows[0].min(node.row), self.rows[1].max(node.row + 1)];
        self.queue[self.moved] = node;
        self.moved += 1;
    }

    /// The nodes that the last pass moved, in order.
    #[cfg(test)]
    pub(super) fn order(&self) -> &[GridNode] {
        &self.queue[..self.moved]
    }
}

/// Notes how far nodes may now be.
pub(super) fn extend_bounds<const PULL: bool>(field: &mut HeightField, z: f64) {
    let [lowest, highest] = &mut field.bounds;
    if PULL {
        *highest = highest.max(z);
    } else {
        *lowest = lowest.min(z);
    }
}
