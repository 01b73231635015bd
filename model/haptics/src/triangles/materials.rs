//! Which part of a mesh is of which material.

use super::mesh::{SurfacePoint, TriangleMesh};
use thiserror::Error;

/// Most materials of a mesh: each is a force law that every tick steps, of a tenth of a microsecond.
pub const MOST_MATERIALS: usize = 8;

/// Shares of all materials at one place; they add up to one.
pub(super) type Shares = [f64; MOST_MATERIALS];

/// The first material alone.
pub(crate) const FIRST_ALONE: Shares = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// A painting that gives no materials.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MaterialError {
    #[error("a mesh of {0} materials is not possible; give from 1 to 8 force models")]
    Count(usize),
    #[error(
        "vertex {vertex} has material {material}, but there are {materials}, counted from 0; add a force model or correct the map"
    )]
    Material { vertex: usize, material: usize, materials: usize },
    #[error(
        "the map of materials names vertex {vertex}, but the file of the mesh has {vertices}, counted from 0; correct the map"
    )]
    Vertex { vertex: usize, vertices: usize },
    #[error(
        "line {line} of the map of materials is '{text}'; write a vertex and a material, such as '17,1', and if needed a weight"
    )]
    Line { line: usize, text: String },
    #[error(
        "the colours give {given} values for {vertices} vertices; give one colour for each vertex of the file"
    )]
    Colours { given: usize, vertices: usize },
    #[error(
        "vertex {0} has no red, green or blue that is above zero; paint it in the colour of a material"
    )]
    Unpainted(usize),
}

/// Shares of materials for each vertex of a mesh.
#[derive(Clone, Debug)]
pub struct MaterialMap {
    materials: usize,
    shares: Box<[Shares]>,
}

impl MaterialMap {
    /// One material everywhere.
    #[must_use]
    pub fn one(mesh: &TriangleMesh) -> Self {
        Self { materials: 1, shares: vec![FIRST_ALONE; mesh.points().len()].into() }
    }

    /// From colours of the file's vertices: red, green and blue are the shares of the first, second and third material, whatever the
    /// brightness. Where vertices at one place differ, their mean counts.
    pub fn from_colours(
        mesh: &TriangleMesh,
        colours: &[[f64; 3]],
        materials: usize,
    ) -> Result<Self, MaterialError> {
        check_count(materials)?;
        let vertices = mesh.vertex_of_file().len();
        if colours.len() != vertices {
            return Err(MaterialError::Colours { given: colours.len(), vertices });
        }
        let mut sums = vec![[0.0; MOST_MATERIALS]; mesh.points().len()];
        for (vertex, colour) in colours.iter().enumerate() {
            let sum: f64 = colour.iter().sum();
            if !(sum > 0.0 && sum.is_finite() && colour.iter().all(|part| *part >= 0.0)) {
                return Err(MaterialError::Unpainted(vertex));
            }
            for (material, part) in colour.iter().enumerate().filter(|(_, part)| **part > 0.0) {
                if material >= materials {
                    return Err(MaterialError::Material { vertex, material, materials });
                }
                sums[mesh.vertex_of_file()[vertex] as usize][material] += part / sum;
            }
        }
        Ok(Self::normalised(materials, sums))
    }

    /// From lines `vertex,material` or `vertex,material,weight`, both counted from 0 in the order of the mesh's file; the first line may be
    /// a heading. Vertices that no line names are of the first material.
    pub fn from_csv(
        mesh: &TriangleMesh,
        text: &str,
        materials: usize,
    ) -> Result<Self, MaterialError> {
        check_count(materials)?;
        let vertices = mesh.vertex_of_file().len();
        let mut sums = vec![[0.0; MOST_MATERIALS]; mesh.points().len()];
        for (index, line) in text.lines().enumerate() {
            let line = line.trim().trim_start_matches('\u{feff}');
            let is_heading = index == 0 && line.starts_with(|letter: char| letter.is_alphabetic());
            if line.is_empty() || is_heading {
                continue;
            }
            let refused = || MaterialError::Line { line: index + 1, text: line.to_owned() };
            let (vertex, material, weight) = csv_line(line).ok_or_else(refused)?;
            let place = mesh.vertex_of_file().get(vertex);
            let place = *place.ok_or(MaterialError::Vertex { vertex, vertices })?;
            if material >= materials {
                return Err(MaterialError::Material { vertex, material, materials });
            }
            sums[place as usize][material] += weight;
        }
        Ok(Self::normalised(materials, sums))
    }

    fn normalised(materials: usize, mut sums: Vec<Shares>) -> Self {
        for shares in &mut sums {
            let sum: f64 = shares.iter().sum();
            *shares = if sum > 0.0 { shares.map(|part| part / sum) } else { FIRST_ALONE };
        }
        Self { materials, shares: sums.into() }
    }

    /// Number of materials.
    pub fn materials(&self) -> usize {
        self.materials
    }

    /// Shares at a vertex of the mesh.
    pub fn at_vertex(&self, vertex: u32) -> [f64; MOST_MATERIALS] {
        self.shares[vertex as usize]
    }

    /// Shares at a point of the mesh, between the corners of its triangle in proportion.
    #[must_use]
    pub fn at(&self, mesh: &TriangleMesh, point: &SurfacePoint) -> [f64; MOST_MATERIALS] {
        let corners = mesh.corner_shares(point.face, point.point);
        let vertices = mesh.faces()[point.face as usize];
        let mut sum = [0.0; MOST_MATERIALS];
        for (share, vertex) in corners.iter().zip(vertices) {
            for (sum, part) in sum.iter_mut().zip(self.shares[vertex as usize]) {
                *sum += share * part;
            }
        }
        sum
    }
}

fn check_count(materials: usize) -> Result<(), MaterialError> {
    if (1..=MOST_MATERIALS).contains(&materials) {
        Ok(())
    } else {
        Err(MaterialError::Count(materials))
    }
}

fn csv_line(line: &str) -> Option<(usize, usize, f64)> {
    let mut parts = line.split([',', ';', '\t']).map(str::trim);
    let vertex = parts.next()?.parse().ok()?;
    let material = parts.next()?.parse().ok()?;
    let weight = parts.next().map_or(Some(1.0), |text| text.parse().ok())?;
    let is_weight = weight >= 0.0 && f64::is_finite(weight);
    (is_weight && parts.next().is_none()).then_some((vertex, material, weight))
}
