//! Heights between nodes: what is read of a surface, of whichever moment.

use super::grid::{Grid, GridNode};
use super::mesh_error::MeshError;

/// Heights on a grid, borrowed: at rest, now, or of a snapshot.
#[derive(Clone, Copy, Debug)]
pub struct Heights<'a> {
    grid: Grid,
    of: &'a [f64],
}

impl<'a> Heights<'a> {
    /// Of a grid, in mm row by row.
    pub fn new(grid: Grid, of: &'a [f64]) -> Result<Self, MeshError> {
        if of.len() == grid.nodes() {
            Ok(Self { grid, of })
        } else {
            Err(MeshError::Count { what: "heights", given: of.len(), nodes: grid.nodes() })
        }
    }

    /// Of a grid that they were made for.
    pub(super) fn for_grid(grid: Grid, of: &'a [f64]) -> Self {
        Self { grid, of }
    }

    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// All of them.
    pub fn all(&self) -> &'a [f64] {
        self.of
    }

    /// Height and unit normal of the bilinear surface at a place in mm; `None` outside the mesh or where
    /// a number is none.
    pub fn at(&self, x: f64, y: f64) -> Option<(f64, [f64; 3])> {
        let (node, [u, v]) = self.cell(x, y)?;
        let [a, b, c, d] = self.corners(node);
        let (near, far) = (a + u * (b - a), c + u * (d - c));
        let spacing = self.grid.spacing();
        let along_x = ((b - a) + v * ((d - c) - (b - a))) / spacing;
        let along_y = (far - near) / spacing;
        Some((near + v * (far - near), unit([-along_x, -along_y, 1.0])))
    }

    /// Unit normal of a node: the normalised sum of the unit normals of the faces around it, at the
    /// boundary of those that there are.
    pub fn normal(&self, node: GridNode) -> [f64; 3] {
        let [column, row] = [node.column, node.row].map(usize::from);
        let mut sum = [0.0; 3];
        for face_row in row.saturating_sub(1)..(row + 1).min(self.grid.rows() - 1) {
            for face_column in column.saturating_sub(1)..(column + 1).min(self.grid.columns() - 1) {
                let corner = GridNode { column: face_column as u16, row: face_row as u16 };
                let normal = face(self.corners(corner), self.grid.spacing());
                sum = [0, 1, 2].map(|axis| sum[axis] + normal[axis]);
            }
        }
        unit(sum)
    }

    /// The cell that holds a place: its first node, and how far along it in both directions, 0 to 1.
    fn cell(&self, x: f64, y: f64) -> Option<(GridNode, [f64; 2])> {
        let [wide, high] = self.grid.extent();
        if !((0.0..=wide).contains(&x) && (0.0..=high).contains(&y)) {
            return None;
        }
        let split = |place: f64, nodes: usize| {
            let steps = place / self.grid.spacing();
            // The last node closes the last cell.
            let cell = steps.floor().min((nodes - 2) as f64);
            (cell as u16, (steps - cell).min(1.0))
        };
        let (column, u) = split(x, self.grid.columns());
        let (row, v) = split(y, self.grid.rows());
        Some((GridNode { column, row }, [u, v]))
    }

    /// Heights of a cell's four corners: along x first.
    #[inline(always)]
    fn corners(&self, first: GridNode) -> [f64; 4] {
        let at = self.grid.index(first);
        let below = at + self.grid.columns();
        [self.of[at], self.of[at + 1], self.of[below], self.of[below + 1]]
    }
}

/// Unit normal of a face by its diagonals, from the heights of its corners.
#[inline(always)]
fn face([a, b, c, d]: [f64; 4], spacing: f64) -> [f64; 3] {
    // (1, 1, p / spacing) x (-1, 1, q / spacing), times the spacing.
    let (p, q) = (d - a, c - b);
    unit([q - p, -p - q, 2.0 * spacing])
}

/// A vector of length 1 in the same direction; its third part is above zero.
#[inline(always)]
pub(super) fn unit([x, y, z]: [f64; 3]) -> [f64; 3] {
    let by = 1.0 / (x * x + y * y + z * z).sqrt();
    [x * by, y * by, z * by]
}
