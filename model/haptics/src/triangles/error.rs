//! Why triangles are no mesh that can be touched, in sentences.

use thiserror::Error;

/// Triangles that cannot be touched. Faces and vertices are counted from 0 in the order of the file.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TriangleMeshError {
    #[error("the mesh has no triangle; export the surface as triangles")]
    Empty,
    #[error("the mesh has {faces} triangles, more than the {most} that are possible; decimate it")]
    TooManyFaces { faces: usize, most: usize },
    #[error(
        "vertex {vertex} of the mesh has a coordinate that is no finite number; repair the file"
    )]
    NotANumber { vertex: usize },
    #[error(
        "triangle {face} of the mesh has vertex {vertex}, but there are {vertices}; repair the file"
    )]
    Index { face: usize, vertex: usize, vertices: usize },
    #[error(
        "the mesh has {given} colours for {vertices} vertices; give one for each vertex, or none"
    )]
    Colours { given: usize, vertices: usize },
    #[error(
        "triangle {face} of the mesh has no area: its corners are on a line or within {tolerance_mm} mm of each other; remove triangles without area in the program that made the mesh"
    )]
    NoArea { face: usize, tolerance_mm: f64 },
    #[error(
        "triangle {face} of the mesh is the third on one edge, at {at:?} mm; an edge has two triangles at most, so remove the walls inside the surface"
    )]
    ThirdFace { face: usize, at: [f64; 3] },
    #[error(
        "the mesh has no outer side: around triangle {face} a path on the surface returns on the other side, as on a Moebius strip; repair the file"
    )]
    NoSides { face: usize },
    #[error(
        "the mesh is {size_mm} mm long, more than the {most_mm} mm that are possible; state the unit of the file, which may be smaller than the one stated"
    )]
    TooLarge { size_mm: f64, most_mm: f64 },
    #[error(
        "the mesh is {size_mm} mm long, less than the {least_mm} mm that can be touched; state the unit of the file, which may be larger than the one stated"
    )]
    TooSmall { size_mm: f64, least_mm: f64 },
}
