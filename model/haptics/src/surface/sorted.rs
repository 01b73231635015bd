//! Enhanced ChainMail (Schill, Gibson, Bender & Männer, "Biomechanical simulation of the vitreous humor
//! in the eye using an enhanced ChainMail algorithm", MICCAI 1998) along z: limits
//! that differ from node to node, a link's being the mean of its nodes', and always the largest
//! violation first, so that a deformation runs ahead where the tissue is stiff.
//!
//! On a valid field this is Dijkstra's algorithm. With `D(p)` the contact's height plus the limits
//! along the shortest way to `p`, a violation is `z(p) - D(p)`, and along a way it never grows, because
//! `z` itself keeps to the limits; so the largest first settles every node at `min(z, D)`.

use super::chain::{Stamps, blocked_move, excess, finish, limit_height};
use super::contact::{Cut, MoveCounts, Poke, Side};
use super::grid::{Grid, Node};
use super::mesh::HeightField;
use std::collections::BinaryHeap;

/// Storage of a pass, made once.
#[derive(Clone, Debug)]
pub(super) struct Sorted {
    heap: BinaryHeap<Candidate>,
    stamps: Stamps,
    /// Rows in which something moved.
    rows: [u16; 2],
}

/// A link from a node that moved to one that has to, as one number: the violation, then the nodes. The
/// bits of numbers above zero are ordered as these are; violations that are equal are taken in the
/// order of nodes, so that a replay does the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate(u128);

impl Candidate {
    #[inline(always)]
    fn new(violation: f64, node: Node, sponsor: Node) -> Self {
        let of = |node: Node| u128::from(node.row) << 16 | u128::from(node.column);
        Self(u128::from(violation.to_bits()) << 64 | of(node) << 32 | of(sponsor))
    }

    /// Which node, and next to which.
    #[inline(always)]
    fn nodes(self) -> [Node; 2] {
        [self.0 >> 32, self.0].map(|bits| Node { row: (bits >> 16) as u16, column: bits as u16 })
    }
}

impl Sorted {
    pub(super) fn new(grid: &Grid) -> Self {
        // Each link is offered once, by the end that moves first, so the heap never grows.
        let links = 2 * grid.nodes() - grid.columns() - grid.rows();
        Self {
            heap: BinaryHeap::with_capacity(links),
            stamps: Stamps::new(grid.nodes()),
            rows: [0; 2],
        }
    }

    /// One pass for one contact.
    pub(super) fn poke(&mut self, field: &mut HeightField, cut: Cut, poke: Poke) -> MoveCounts {
        self.stamps.begin();
        self.heap.clear();
        match poke.side {
            Side::Push => self.spread::<false>(field, cut, poke),
            Side::Pull => self.spread::<true>(field, cut, poke),
        }
    }

    fn spread<const PULL: bool>(
        &mut self,
        field: &mut HeightField,
        cut: Cut,
        poke: Poke,
    ) -> MoveCounts {
        if let Some(counts) = blocked_move::<PULL>(field, poke) {
            return counts;
        }
        let mut counts = MoveCounts::default();
        self.rows = [poke.node.row, poke.node.row + 1];
        self.put::<PULL>(field, cut, poke, [poke.node, poke.node], poke.z, &mut counts);
        while let Some(next) = self.heap.pop() {
            let [node, sponsor] = next.nodes();
            if self.stamps.has(field.grid.index(node)) {
                continue;
            }
            let from = field.now[field.grid.index(sponsor)];
            let z = limit_height::<PULL>(from, field.limit(sponsor, node));
            self.put::<PULL>(field, cut, poke, [node, sponsor], z, &mut counts);
        }
        finish::<PULL>(field, poke.z, self.rows);
        counts
    }

    /// Moves a node and offers its neighbours a move.
    #[inline(always)]
    fn put<const PULL: bool>(
        &mut self,
        field: &mut HeightField,
        cut: Cut,
        poke: Poke,
        [node, sponsor]: [Node; 2],
        z: f64,
        counts: &mut MoveCounts,
    ) {
        let index = field.grid.index(node);
        field.now[index] = z;
        field.displaced.include(node);
        self.stamps.set(index);
        self.rows = [self.rows[0].min(node.row), self.rows[1].max(node.row + 1)];
        counts.moved += 1;
        if poke.node.steps_to(node) >= cut.range() {
            return;
        }
        for other in field.grid.neighbours(node).into_iter().flatten() {
            if other == sponsor {
                continue;
            }
            counts.visited += 1;
            let index = field.grid.index(other);
            let allowed = limit_height::<PULL>(z, field.limit(node, other));
            let violation = excess::<PULL>(field.now[index], allowed);
            if violation > cut.threshold() && !self.stamps.has(index) && !field.is_pinned(other) {
                self.heap.push(Candidate::new(violation, other, node));
            }
        }
    }

    /// Candidates that there is room for.
    #[cfg(test)]
    pub(super) fn room(&self) -> usize {
        self.heap.capacity()
    }
}
