//! What is drawn: heights over a grid, or a mesh of triangles.

use thiserror::Error;

/// A surface that cannot be drawn.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SurfaceError {
    /// Fewer than two nodes along a side, or more than graphics processors take.
    #[error(
        "a surface of {columns} by {rows} nodes cannot be drawn: from 2 to {most} are possible"
    )]
    Size { columns: usize, rows: usize, most: usize },
    #[error("there are {given} {what} for {wanted} nodes")]
    Count { what: &'static str, given: usize, wanted: usize },
    #[error("the {what} of node {node} is not finite")]
    NotFinite { what: &'static str, node: usize },
    #[error("a spacing of {0} mm cannot be drawn: it is positive and finite")]
    Spacing(f64),
    #[error("triangle {triangle} names node {node}, and there are {nodes}")]
    Index { triangle: usize, node: u32, nodes: usize },
    #[error("{0} indices are no triangles: three make one")]
    Triangles(usize),
}

/// The most nodes along a side: the size of a texture that every adapter of WebGPU takes.
pub(crate) const SIDE_MAX: usize = 8192;

/// Heights over a grid, made ready for the graphics processor. Node (0, 0) is at x = y = 0.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldData {
    pub(crate) columns: u32,
    pub(crate) rows: u32,
    pub(crate) spacing_mm: f64,
    /// Height and depth below rest, row by row, in mm.
    pub(crate) heights: Vec<[f32; 2]>,
    /// What colours stand for; empty without.
    pub(crate) values: Vec<f32>,
}

/// Whether all numbers are finite; the first that is not otherwise.
fn check_finite(
    what: &'static str,
    numbers: impl Iterator<Item = f64> + Clone,
) -> Result<(), SurfaceError> {
    // Without a branch for each: a surface is checked in every frame.
    if numbers.clone().fold(true, |all, number| all & number.is_finite()) {
        return Ok(());
    }
    let mut numbers = numbers;
    let node = numbers.position(|number| !number.is_finite()).unwrap_or_default();
    Err(SurfaceError::NotFinite { what, node })
}

fn check_count(what: &'static str, given: usize, wanted: usize) -> Result<(), SurfaceError> {
    if given == wanted { Ok(()) } else { Err(SurfaceError::Count { what, given, wanted }) }
}

impl FieldData {
    /// Of `heights` in mm, row by row, `columns` to a row, `spacing_mm` apart.
    pub fn new(columns: usize, spacing_mm: f64, heights: &[f64]) -> Result<Self, SurfaceError> {
        let rows = heights.len() / columns.max(1);
        let is_size = |side: usize| (2..=SIDE_MAX).contains(&side);
        if !is_size(columns) || !is_size(rows) {
            return Err(SurfaceError::Size { columns, rows, most: SIDE_MAX });
        }
        check_count("heights", heights.len(), columns * rows)?;
        if !(spacing_mm.is_finite() && spacing_mm > 0.0) {
            return Err(SurfaceError::Spacing(spacing_mm));
        }
        check_finite("height", heights.iter().copied())?;
        Ok(Self {
            columns: columns as u32,
            rows: rows as u32,
            spacing_mm,
            heights: heights.iter().map(|&height| [height as f32, 0.0]).collect(),
            values: Vec::new(),
        })
    }

    /// With the heights at rest in mm, from which depths are counted.
    pub fn with_rest(mut self, rest: &[f64]) -> Result<Self, SurfaceError> {
        check_count("heights at rest", rest.len(), self.heights.len())?;
        check_finite("height at rest", rest.iter().copied())?;
        for (both, &rest) in self.heights.iter_mut().zip(rest) {
            both[1] = rest as f32 - both[0];
        }
        Ok(self)
    }

    /// With a number for each node that colours stand for: a force, a stress, a stiffness.
    pub fn with_values(mut self, values: Vec<f32>) -> Result<Self, SurfaceError> {
        check_count("values", values.len(), self.heights.len())?;
        check_finite("value", values.iter().map(|&value| f64::from(value)))?;
        self.values = values;
        Ok(self)
    }

    /// With the depth below rest as what colours stand for, in mm.
    #[must_use]
    pub fn with_depth_as_values(mut self) -> Self {
        self.values = self.heights.iter().map(|both| both[1]).collect();
        self
    }

    /// Lengths along x and y in mm.
    #[must_use]
    pub fn extent(&self) -> [f64; 2] {
        [self.columns, self.rows].map(|side| f64::from(side - 1) * self.spacing_mm)
    }
}

/// Triangles with normals, made ready for the graphics processor.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshData {
    /// Place in mm, unit normal, value of the colours, depth below rest in mm.
    pub(crate) nodes: Vec<[f32; 8]>,
    pub(crate) indices: Vec<u32>,
    pub(crate) size_mm: f64,
}

impl MeshData {
    /// Of places in mm, unit normals and the three nodes of each triangle.
    pub fn new(
        places: &[[f64; 3]],
        normals: &[[f64; 3]],
        indices: Vec<u32>,
    ) -> Result<Self, SurfaceError> {
        check_count("normals", normals.len(), places.len())?;
        if !indices.len().is_multiple_of(3) {
            return Err(SurfaceError::Triangles(indices.len()));
        }
        if let Some(at) = indices.iter().position(|&node| node as usize >= places.len()) {
            let (triangle, node) = (at / 3, indices[at]);
            return Err(SurfaceError::Index { triangle, node, nodes: places.len() });
        }
        // A sum is finite only if its parts are.
        check_finite("place", places.iter().map(|place| place.iter().sum()))?;
        check_finite("normal", normals.iter().map(|normal| normal.iter().sum()))?;
        let length = |axis: usize| {
            let ends = places.iter().map(|place| place[axis]);
            let [low, high] = ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], end| {
                [low.min(end), high.max(end)]
            });
            high - low
        };
        let nodes = places.iter().zip(normals).map(|([x, y, z], [u, v, w])| {
            [*x, *y, *z, *u, *v, *w, 0.0, 0.0].map(|number| number as f32)
        });
        Ok(Self { nodes: nodes.collect(), indices, size_mm: length(0).max(length(1)).max(1e-3) })
    }

    /// With a number for each node that colours stand for.
    pub fn with_values(mut self, values: &[f32]) -> Result<Self, SurfaceError> {
        check_count("values", values.len(), self.nodes.len())?;
        check_finite("value", values.iter().map(|&value| f64::from(value)))?;
        for (node, &value) in self.nodes.iter_mut().zip(values) {
            node[6] = value;
        }
        Ok(self)
    }

    /// With depths below rest in mm, for lines of equal depth.
    pub fn with_depths(mut self, depths: &[f32]) -> Result<Self, SurfaceError> {
        check_count("depths", depths.len(), self.nodes.len())?;
        check_finite("depth", depths.iter().map(|&depth| f64::from(depth)))?;
        for (node, &depth) in self.nodes.iter_mut().zip(depths) {
            node[7] = depth;
        }
        Ok(self)
    }
}

/// A surface to draw.
#[derive(Clone, Debug, PartialEq)]
pub enum SurfaceData {
    Field(FieldData),
    Mesh(MeshData),
}

impl SurfaceData {
    /// A length of the surface in mm.
    #[must_use]
    pub fn size_mm(&self) -> f64 {
        match self {
            Self::Field(field) => field.extent()[0].max(field.extent()[1]),
            Self::Mesh(mesh) => mesh.size_mm,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_are_counted_from_rest() {
        let field = FieldData::new(2, 0.5, &[1.0, 0.0, -2.0, 0.5]).unwrap();
        let field = field.with_rest(&[1.0, 1.0, 0.0, 0.0]).unwrap().with_depth_as_values();
        assert_eq!(field.values, [0.0, 1.0, 2.0, -0.5]);
        assert_eq!(field.extent(), [0.5, 0.5]);
    }

    #[test]
    fn what_cannot_be_drawn_is_refused_with_the_node() {
        let flat = [0.0; 4];
        assert!(matches!(FieldData::new(1, 1.0, &flat), Err(SurfaceError::Size { .. })));
        assert!(matches!(FieldData::new(0, 1.0, &[]), Err(SurfaceError::Size { .. })));
        assert!(matches!(FieldData::new(2, 1.0, &[0.0; 5]), Err(SurfaceError::Count { .. })));
        assert!(matches!(FieldData::new(2, f64::NAN, &flat), Err(SurfaceError::Spacing(_))));
        let bad = [0.0, 0.0, f64::NAN, 0.0];
        let refused = FieldData::new(2, 1.0, &bad).unwrap_err();
        assert_eq!(refused, SurfaceError::NotFinite { what: "height", node: 2 });
        let field = FieldData::new(2, 1.0, &flat).unwrap();
        assert!(field.clone().with_rest(&bad).is_err());
        assert!(field.with_values(vec![0.0; 3]).is_err());
    }

    #[test]
    fn a_triangle_without_its_node_is_refused() {
        let (places, normals) = ([[0.0; 3]; 3], [[0.0, 0.0, 1.0]; 3]);
        let refused = MeshData::new(&places, &normals, vec![0, 1, 3]).unwrap_err();
        assert_eq!(refused, SurfaceError::Index { triangle: 0, node: 3, nodes: 3 });
        let refused = MeshData::new(&places, &normals, vec![0, 1]).unwrap_err();
        assert_eq!(refused, SurfaceError::Triangles(2));
        assert!(MeshData::new(&places, &normals[..2], vec![0, 1, 2]).is_err());
    }
}
