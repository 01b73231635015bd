//! Normals of many nodes, for drawing: each face once, where something changed.

use super::grid::{Grid, Rect};
use super::heights::{Heights, face, unit};
use palpate_rheology::vectors::wide;

/// Unit normals of all nodes, row by row.
#[derive(Clone, Debug)]
pub struct Normals {
    grid: Grid,
    of: Box<[[f32; 3]]>,
    /// Faces of the row of cells above the nodes, and of the one below them.
    faces: [Faces; 2],
}

/// Normals of a row of cells, one more at either end: zero, so that there a sum lacks them.
#[derive(Clone, Debug)]
struct Faces([Box<[f64]>; 3]);

impl Normals {
    /// Of a surface.
    #[must_use]
    pub fn new(heights: Heights) -> Self {
        let grid = *heights.grid();
        let faces = Faces([0, 1, 2].map(|_| vec![0.0; grid.columns() + 1].into()));
        let mut normals = Self {
            grid,
            of: vec![[0.0; 3]; grid.nodes()].into(),
            faces: [faces.clone(), faces],
        };
        normals.update(heights, grid.whole());
        normals
    }

    /// All of them.
    #[must_use]
    pub fn all(&self) -> &[[f32; 3]] {
        &self.of
    }

    /// Renews those that the heights in `dirty` touch and returns where; nothing for heights of
    /// another grid.
    pub fn update(&mut self, heights: Heights, dirty: Rect) -> Rect {
        // A face belongs to its four corners, so the nodes beside a moved one turn with it.
        let dirty = dirty.intersected(self.grid.whole()).grown(&self.grid);
        if dirty.is_empty() || *heights.grid() != self.grid {
            return Rect::EMPTY;
        }
        let [from, to] = dirty.columns.map(|end| end as usize);
        let Self { grid, of, faces } = self;
        let [above, below] = faces;
        let (mut above, mut below) = (above, below);
        wide(
            #[inline(always)]
            || {
                let rows = dirty.row_range();
                below.fill(heights, rows.start.checked_sub(1), from, to);
                for row in rows {
                    std::mem::swap(&mut above, &mut below);
                    below.fill(heights, Some(row), from, to);
                    let first = row * grid.columns();
                    let out = &mut of[first + from..first + to];
                    sum(above, below, from, out);
                }
            },
        );
        dirty
    }
}

impl Faces {
    /// Takes the normals of the cells from those left of node `from` to those left of node `to`.
    #[inline(always)]
    fn fill(&mut self, heights: Heights, row: Option<usize>, from: usize, to: usize) {
        let grid = heights.grid();
        let (first, last) = (from.max(1), to.min(grid.columns() - 1));
        let [xs, ys, zs] = self.0.each_mut().map(|axis| &mut axis[first..=last]);
        let Some(row) = row.filter(|row| row + 1 < grid.rows()) else {
            for axis in [xs, ys, zs] {
                axis.fill(0.0);
            }
            return;
        };
        // Cell `first` is between nodes `first - 1` and `first`.
        let upper = &heights.row(row)[first - 1..=last];
        let lower = &heights.row(row + 1)[first - 1..=last];
        let count = xs.len();
        let (ys, zs) = (&mut ys[..count], &mut zs[..count]);
        let (upper, lower) = (&upper[..=count], &lower[..=count]);
        for cell in 0..count {
            let corners = [upper[cell], upper[cell + 1], lower[cell], lower[cell + 1]];
            [xs[cell], ys[cell], zs[cell]] = face(corners, grid.spacing());
        }
    }
}

/// Sums the faces around nodes from column `from` on.
#[inline(always)]
fn sum(above: &Faces, below: &Faces, from: usize, out: &mut [[f32; 3]]) {
    let [ax, ay, az] = above
        .0
        .each_ref()
        .map(|axis| &axis[from..=from + out.len()]);
    let [bx, by, bz] = below
        .0
        .each_ref()
        .map(|axis| &axis[from..=from + out.len()]);
    let around = |a: &[f64], b: &[f64], i: usize| (a[i] + a[i + 1]) + (b[i] + b[i + 1]);
    for (i, out) in out.iter_mut().enumerate() {
        let sum = [around(ax, bx, i), around(ay, by, i), around(az, bz, i)];
        *out = unit(sum).map(|part| part as f32);
    }
}
