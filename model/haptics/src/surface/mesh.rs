//! Heights on a grid, at rest and now, and how far neighbours may be apart.

use super::grid::{Grid, Node, Spans};
use super::heights::Heights;
use super::mesh_error::MeshError;

/// Heights are within a kilometre of zero: sums and differences of any two stay finite.
pub const HIGHEST_MM: f64 = 1e6;

/// MaxShear: how far neighbours may be apart in height, in mm.
#[derive(Clone, Debug, PartialEq)]
pub enum Shear {
    /// One for all.
    Uniform(f64),
    /// One for each node, row by row; between two nodes their mean counts (Schill, Gibson, Bender &
    /// Männer, MICCAI 1998).
    PerNode(Box<[f64]>),
}

/// Nodes that never move. They pass nothing on either, so that links to them may be stretched.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Pins {
    /// None.
    #[default]
    None,
    /// The outermost rows and columns.
    Border,
    /// Those marked, row by row.
    Nodes(Box<[bool]>),
}

/// The parts of a ChainMail mesh that have no effect, and why: MinDist and MaxDist, how near and how far neighbours may be
/// along an axis (Gibson, "3D ChainMail", Symposium on Interactive 3D Graphics 1997).
pub const INERT: [(&str, &str); 2] = [
    ("MinDist", "nodes move along z alone, so neighbours never come nearer along x or y"),
    ("MaxDist", "nodes move along z alone, so neighbours never go further apart along x or y"),
];

/// A surface as heights over a grid.
#[derive(Clone, Debug)]
pub struct HeightField {
    pub(super) grid: Grid,
    pub(super) rest: Box<[f64]>,
    pub(super) now: Box<[f64]>,
    pub(super) shear: Shear,
    pub(super) pins: Pins,
    /// Where `now` may differ from `rest`.
    pub(super) displaced: Spans,
    /// Nothing is now below or above these.
    pub(super) bounds: [f64; 2],
    rest_bounds: [f64; 2],
    /// From the rest heights of a row to those of the next: none where all rows are the same, as on a
    /// plane, so that one row in a fast cache stands for all.
    pub(super) rest_stride: usize,
}

impl HeightField {
    /// A field at rest, `rest` in mm row by row, nothing pinned.
    ///
    /// Refused where the surface at rest has steps beyond its own limits: what a chain makes of such a
    /// surface depends on the order of its moves.
    pub fn new(grid: Grid, rest: Vec<f64>, shear: Shear) -> Result<Self, MeshError> {
        check_count("rest heights", rest.len(), &grid)?;
        for (index, &height) in rest.iter().enumerate() {
            if height.is_nan() || height.abs() > HIGHEST_MM {
                let (column, row) = (index % grid.columns(), index / grid.columns());
                return Err(MeshError::Height { column, row, height });
            }
        }
        let limits = match &shear {
            Shear::Uniform(limit) => std::slice::from_ref(limit),
            Shear::PerNode(limits) => {
                check_count("MaxShears", limits.len(), &grid)?;
                limits
            }
        };
        if let Some(&bad) = limits.iter().find(|limit| limit.is_nan() || **limit < 0.0) {
            return Err(MeshError::Shear(bad));
        }
        let fold = |start: f64, pick: fn(f64, f64) -> f64| rest.iter().copied().fold(start, pick);
        let rest_bounds = [fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max)];
        let columns = grid.columns();
        let is_same = rest.chunks(columns).all(|row| row == &rest[..columns]);
        let rest_stride = if is_same { 0 } else { columns };
        let field = Self {
            grid,
            now: rest.clone().into(),
            rest: rest.into(),
            shear,
            pins: Pins::None,
            displaced: Spans::none(&grid),
            bounds: rest_bounds,
            rest_bounds,
            rest_stride,
        };
        field.checked_rest()?;
        Ok(field)
    }

    /// A square or rectangle that is flat at height 0.
    pub fn flat(grid: Grid, shear: f64) -> Result<Self, MeshError> {
        Self::new(grid, vec![0.0; grid.nodes()], Shear::Uniform(shear))
    }

    /// With nodes that never move.
    pub fn pinned(mut self, pins: Pins) -> Result<Self, MeshError> {
        if let Pins::Nodes(marks) = &pins {
            check_count("marks of pinned nodes", marks.len(), &self.grid)?;
        }
        self.pins = pins;
        Ok(self)
    }

    /// The grid.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Heights at rest in mm, row by row.
    pub fn rest(&self) -> &[f64] {
        &self.rest
    }

    /// Heights now in mm, row by row.
    pub fn heights(&self) -> &[f64] {
        &self.now
    }

    /// The surface at rest.
    pub fn at_rest(&self) -> Heights<'_> {
        Heights::for_grid(self.grid, &self.rest)
    }

    /// The surface now.
    pub fn current(&self) -> Heights<'_> {
        Heights::for_grid(self.grid, &self.now)
    }

    /// MaxShear.
    pub fn shear(&self) -> &Shear {
        &self.shear
    }

    /// What is pinned.
    pub fn pins(&self) -> &Pins {
        &self.pins
    }

    /// MaxShear between two nodes.
    #[inline(always)]
    pub fn limit(&self, one: Node, other: Node) -> f64 {
        match &self.shear {
            Shear::Uniform(limit) => *limit,
            Shear::PerNode(limits) => {
                // Halved before the sum, which else may be beyond the numbers.
                0.5 * limits[self.grid.index(one)] + 0.5 * limits[self.grid.index(other)]
            }
        }
    }

    /// Whether a node is pinned.
    #[inline(always)]
    pub fn is_pinned(&self, node: Node) -> bool {
        match &self.pins {
            Pins::None => false,
            Pins::Border => {
                let last = [self.grid.columns() - 1, self.grid.rows() - 1];
                let [column, row] = [node.column, node.row].map(usize::from);
                column == 0 || row == 0 || column == last[0] || row == last[1]
            }
            Pins::Nodes(marks) => marks[self.grid.index(node)],
        }
    }

    /// Most that a link is stretched beyond its limit, in mm; links to pinned nodes are left out.
    /// Zero or less: the field is valid.
    pub fn worst_excess(&self) -> f64 {
        let mut worst = f64::NEG_INFINITY;
        self.links(&self.now, |one, other, rise, limit| {
            if !(self.is_pinned(one) || self.is_pinned(other)) {
                worst = worst.max(rise - limit);
            }
        });
        worst
    }

    /// Forgets every displacement.
    pub fn reset(&mut self) {
        self.now.copy_from_slice(&self.rest);
        self.displaced = Spans::none(&self.grid);
        self.bounds = self.rest_bounds;
    }

    /// Bounds of the heights drawn back to those at rest, once all is.
    pub(super) fn forget_bounds(&mut self) {
        if self.displaced.bounds().is_empty() {
            self.bounds = self.rest_bounds;
        }
    }

    fn links(&self, heights: &[f64], mut see: impl FnMut(Node, Node, f64, f64)) {
        for row in 0..self.grid.rows() as u16 {
            for column in 0..self.grid.columns() as u16 {
                let one = Node { column, row };
                let [_, right, _, below] = self.grid.neighbours(one);
                for other in [right, below].into_iter().flatten() {
                    let [a, b] = [one, other].map(|node| heights[self.grid.index(node)]);
                    see(one, other, (a - b).abs(), self.limit(one, other));
                }
            }
        }
    }

    fn checked_rest(&self) -> Result<(), MeshError> {
        let mut steep = None;
        // A surface made to the limit exceeds it by roundings of its heights.
        let [lowest, highest] = self.rest_bounds.map(f64::abs);
        let rounding = 4.0 * f64::EPSILON * lowest.max(highest);
        self.links(&self.rest, |one, _, rise, limit| {
            if rise > limit * (1.0 + 1e-9) + rounding && steep.is_none() {
                steep = Some(MeshError::Steep {
                    column: usize::from(one.column),
                    row: usize::from(one.row),
                    rise,
                    limit,
                });
            }
        });
        steep.map_or(Ok(()), Err)
    }
}

fn check_count(what: &'static str, given: usize, grid: &Grid) -> Result<(), MeshError> {
    let nodes = grid.nodes();
    if given == nodes { Ok(()) } else { Err(MeshError::Count { what, given, nodes }) }
}
