//! What is drawn: heights over a grid, or a mesh of triangles.

use crate::camera::Vec3;
use crate::level::DetailLevel;
use crate::mesh::MeshData;
use crate::quantity::{ElasticModel, ModelQuantity};
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
    #[error("node {node} is said to have moved, and there are {nodes}")]
    MovedNode { node: u32, nodes: usize },
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

/// The least and the greatest; infinite and crossed where there are none.
fn ends(numbers: impl Iterator<Item = f32>) -> [f32; 2] {
    let start = [f32::INFINITY, f32::NEG_INFINITY];
    numbers.fold(start, |[low, high], number| [low.min(number), high.max(number)])
}

/// Whether all numbers are finite; the first that is not otherwise.
pub(crate) fn check_finite(
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

pub(crate) fn check_count(
    what: &'static str,
    given: usize,
    wanted: usize,
) -> Result<(), SurfaceError> {
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

    /// The same where all of it is at height zero at rest.
    #[must_use]
    pub fn with_level_rest(mut self) -> Self {
        for both in &mut self.heights {
            both[1] = -both[0];
        }
        self
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

    /// With what the fitted model says at the depths of the nodes as what colours stand for. All nodes are of one model.
    #[must_use]
    pub fn with_model_as_values(mut self, quantity: ModelQuantity, model: &ElasticModel) -> Self {
        let at = |both: &[f32; 2]| model.at(quantity, f64::from(both[1])) as f32;
        self.values = self.heights.iter().map(at).collect();
        self
    }

    /// Lowest and highest corner of the box around it, in mm.
    #[must_use]
    pub fn bounds(&self) -> [Vec3; 2] {
        let [wide, high] = self.extent();
        let [low, top] = ends(self.heights.iter().map(|both| both[0]));
        [[0.0, 0.0, f64::from(low)], [wide, high, f64::from(top)]]
    }

    /// Lengths along x and y in mm.
    #[must_use]
    pub fn extent(&self) -> [f64; 2] {
        [self.columns, self.rows].map(|side| f64::from(side - 1) * self.spacing_mm)
    }
}

/// A surface to draw.
#[derive(Clone, Debug, PartialEq)]
pub enum SurfaceData {
    Field(FieldData),
    Mesh(MeshData),
}

impl SurfaceData {
    /// Lowest and highest corner of the box around it, in mm.
    #[must_use]
    pub fn bounds(&self) -> [Vec3; 2] {
        match self {
            Self::Field(field) => field.bounds(),
            Self::Mesh(mesh) => mesh.bounds,
        }
    }

    /// The least and the greatest of what colours stand for; `None` without.
    #[must_use]
    pub fn value_range(&self) -> Option<[f64; 2]> {
        let [least, greatest] = match self {
            Self::Field(field) => ends(field.values.iter().copied()),
            Self::Mesh(mesh) => ends(mesh.nodes.iter().map(|node| node[6])),
        };
        (least <= greatest).then(|| [least, greatest].map(f64::from))
    }

    /// A level as it is for this surface: of [`MeshData::new`] all triangles are drawn at every level.
    #[must_use]
    pub fn level(&self, level: DetailLevel) -> DetailLevel {
        match self {
            Self::Mesh(mesh) if !mesh.is_thinned() => DetailLevel { every: 1, ..level },
            _ => level,
        }
    }

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
        let field = FieldData::new(2, 0.5, &[1.0, 0.0, -2.0, 0.5]).unwrap();
        let level = field.clone().with_level_rest();
        assert_eq!(level, field.with_rest(&[0.0; 4]).unwrap());
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
}
