//! Nodes in rows and columns, and parts of them.

use super::MeshError;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Most nodes of a mesh: 16.8 million, 0.7 GB with everything a sorted chain keeps for each.
pub const MOST_NODES: usize = 1 << 24;

/// A node by column (along x) and row (along y).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GridNode {
    /// Column, from 0.
    pub column: u16,
    /// Row, from 0.
    pub row: u16,
}

/// A rectangle of nodes at constant spacing; the node of column 0 and row 0 is at x = y = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    columns: u16,
    rows: u16,
    spacing: f64,
}

impl Grid {
    /// `columns` by `rows` nodes, `spacing` mm apart.
    pub fn new(columns: usize, rows: usize, spacing: f64) -> Result<Self, MeshError> {
        let sides = [u16::try_from(columns), u16::try_from(rows)];
        let (Ok(wide), Ok(high)) = (sides[0], sides[1]) else {
            return Err(MeshError::Size { columns, rows });
        };
        if wide < 2 || high < 2 || columns * rows > MOST_NODES {
            return Err(MeshError::Size { columns, rows });
        }
        // From a nanometre to a metre: squares of slopes and lengths stay far from the ends of numbers.
        if !(1e-6..=1e3).contains(&spacing) {
            return Err(MeshError::Spacing(spacing));
        }
        Ok(Self { columns: wide, rows: high, spacing })
    }

    /// Nodes along x.
    pub fn columns(&self) -> usize {
        usize::from(self.columns)
    }

    /// Nodes along y.
    pub fn rows(&self) -> usize {
        usize::from(self.rows)
    }

    /// Distance between neighbours in mm.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    pub fn nodes(&self) -> usize {
        self.columns() * self.rows()
    }

    /// Lengths along x and y in mm.
    pub fn extent(&self) -> [f64; 2] {
        [self.columns - 1, self.rows - 1].map(|cells| f64::from(cells) * self.spacing)
    }

    /// Index of a node's numbers: row by row.
    #[inline(always)]
    pub fn index(&self, node: GridNode) -> usize {
        usize::from(node.row) * usize::from(self.columns) + usize::from(node.column)
    }

    /// Position of a node in mm.
    pub fn place(&self, node: GridNode) -> [f64; 2] {
        [node.column, node.row].map(|step| f64::from(step) * self.spacing)
    }

    /// The node nearest to a place in mm; `None` more than half a spacing outside, or for no number.
    pub fn nearest(&self, x: f64, y: f64) -> Option<GridNode> {
        let step = |place: f64, count: u16| {
            let step = (place / self.spacing).round();
            // False for NaN and for both infinities.
            (step >= 0.0 && step < f64::from(count)).then_some(step as u16)
        };
        Some(GridNode { column: step(x, self.columns)?, row: step(y, self.rows)? })
    }

    pub fn whole(&self) -> GridRect {
        GridRect { columns: [0, u32::from(self.columns)], rows: [0, u32::from(self.rows)] }
    }
}

impl GridNode {
    /// Steps along the axes from one node to another.
    #[must_use]
    #[inline(always)]
    pub fn steps_to(self, other: Self) -> u32 {
        u32::from(self.column.abs_diff(other.column)) + u32::from(self.row.abs_diff(other.row))
    }
}

/// A rectangle of nodes: from the first to before the last of each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GridRect {
    /// Columns.
    pub columns: [u32; 2],
    pub rows: [u32; 2],
}

impl GridRect {
    pub const EMPTY: Self = Self { columns: [0; 2], rows: [0; 2] };

    /// Whether there is no node in it.
    pub fn is_empty(&self) -> bool {
        self.columns[0] >= self.columns[1] || self.rows[0] >= self.rows[1]
    }

    /// The least rectangle around both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        match (self.is_empty(), other.is_empty()) {
            (true, _) => other,
            (_, true) => self,
            _ => {
                let join = |a: [u32; 2], b: [u32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
                Self {
                    columns: join(self.columns, other.columns),
                    rows: join(self.rows, other.rows),
                }
            }
        }
    }

    pub fn nodes(&self) -> usize {
        let count = |[from, to]: [u32; 2]| to.saturating_sub(from) as usize;
        count(self.columns) * count(self.rows)
    }

    pub(super) fn row_range(&self) -> Range<usize> {
        self.rows[0] as usize..self.rows[1] as usize
    }
}

/// For each row, from where to where something is displaced.
#[derive(Clone, Debug)]
pub(super) struct Spans {
    /// From, and to before which, in each row; equal where nothing is.
    rows: Box<[[u16; 2]]>,
    /// Every displaced node is in it.
    bounds: GridRect,
}

impl Spans {
    pub(super) fn none(grid: &Grid) -> Self {
        Self { rows: vec![[0; 2]; grid.rows()].into(), bounds: GridRect::EMPTY }
    }

    #[inline(always)]
    pub(super) fn row(&self, row: usize) -> [usize; 2] {
        self.rows[row].map(usize::from)
    }

    /// Rows in which something may be displaced.
    pub(super) fn active_rows(&self) -> Range<usize> {
        self.bounds.row_range()
    }

    pub(super) fn bounds(&self) -> GridRect {
        self.bounds
    }

    /// Takes in one node.
    #[inline(always)]
    pub(super) fn include(&mut self, node: GridNode) {
        let span = &mut self.rows[usize::from(node.row)];
        if span[0] == span[1] {
            *span = [node.column, node.column + 1];
        } else {
            span[0] = span[0].min(node.column);
            span[1] = span[1].max(node.column + 1);
        }
    }

    /// Bounds that hold every node taken in since.
    pub(super) fn widen(&mut self, by: GridRect) {
        self.bounds = self.bounds.union(by);
    }

    #[inline(always)]
    pub(super) fn set(&mut self, row: usize, [from, to]: [usize; 2]) {
        self.rows[row] = [from as u16, to as u16];
    }

    /// Bounds drawn tight around the spans of the rows that were active.
    pub(super) fn tighten(&mut self) {
        let mut tight = GridRect::EMPTY;
        for row in self.active_rows() {
            let [from, to] = self.rows[row].map(u32::from);
            let row = row as u32;
            tight = tight.union(GridRect { columns: [from, to], rows: [row, row + 1] });
        }
        self.bounds = tight;
    }
}
