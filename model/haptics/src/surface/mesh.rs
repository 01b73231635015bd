//! Heights on a grid, at rest and now, and how far neighbours may be apart.

use super::grid::{Grid, Spans};
use super::heights::Heights;
use super::mesh_error::MeshError;

/// Heights are within a kilometre of zero: sums and differences of any two stay finite.
pub const HIGHEST_MM: f64 = 1e6;

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
    /// MaxShear: how far neighbours may be apart in height, in mm.
    shear: f64,
    /// Nodes at which `now` may differ from `rest`.
    pub(super) displaced: Spans,
    /// Nothing is now below or above these.
    pub(super) bounds: [f64; 2],
    rest_bounds: [f64; 2],
    /// From the rest heights of a row to those of the next: none where all rows are the same, as on a
    /// plane, so that one row in a fast cache stands for all.
    pub(super) rest_stride: usize,
}

impl HeightField {
    /// A field at rest, `rest` in mm row by row, with a MaxShear in mm for all links.
    ///
    /// Refused where the surface at rest has steps beyond its own limit: what a chain makes of such a
    /// surface depends on the order of its moves.
    pub fn new(grid: Grid, rest: Vec<f64>, shear: f64) -> Result<Self, MeshError> {
        let (columns, nodes) = (grid.columns(), grid.nodes());
        if rest.len() != nodes {
            return Err(MeshError::Count { what: "rest heights", given: rest.len(), nodes });
        }
        let is_bad = |height: &f64| height.is_nan() || height.abs() > HIGHEST_MM;
        if let Some(index) = rest.iter().position(is_bad) {
            let (column, row) = (index % columns, index / columns);
            return Err(MeshError::Height { column, row, height: rest[index] });
        }
        if shear.is_nan() || shear < 0.0 {
            return Err(MeshError::Shear(shear));
        }
        let fold = |start: f64, pick: fn(f64, f64) -> f64| rest.iter().copied().fold(start, pick);
        let rest_bounds = [fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max)];
        check_slopes(&rest, columns, shear, rest_bounds)?;
        let is_same = rest.chunks(columns).all(|row| row == &rest[..columns]);
        Ok(Self {
            grid,
            now: rest.clone().into(),
            rest: rest.into(),
            shear,
            displaced: Spans::none(&grid),
            bounds: rest_bounds,
            rest_bounds,
            rest_stride: if is_same { 0 } else { columns },
        })
    }

    /// A rectangle that is flat at height 0.
    pub fn flat(grid: Grid, shear: f64) -> Result<Self, MeshError> {
        Self::new(grid, vec![0.0; grid.nodes()], shear)
    }

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

    pub fn shear(&self) -> f64 {
        self.shear
    }

    /// Bounds of the heights drawn back to those at rest, once all is.
    pub(super) fn forget_bounds(&mut self) {
        if self.displaced.bounds().is_empty() {
            self.bounds = self.rest_bounds;
        }
    }
}

/// Refuses a rest surface that is steeper between neighbours than its limit.
fn check_slopes(
    rest: &[f64],
    columns: usize,
    limit: f64,
    bounds: [f64; 2],
) -> Result<(), MeshError> {
    // A surface made to the limit exceeds it by roundings of its heights.
    let rounding = 4.0 * f64::EPSILON * bounds[0].abs().max(bounds[1].abs());
    for (index, height) in rest.iter().enumerate() {
        let (column, row) = (index % columns, index / columns);
        let right = (column + 1 < columns).then(|| rest[index + 1]);
        let below = rest.get(index + columns).copied();
        for other in [right, below].into_iter().flatten() {
            let rise = (height - other).abs();
            if rise > limit * (1.0 + 1e-9) + rounding {
                return Err(MeshError::Steep { column, row, rise, limit });
            }
        }
    }
    Ok(())
}
