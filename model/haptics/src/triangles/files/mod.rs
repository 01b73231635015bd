//! Meshes from the bytes of files, and files from meshes.
//!
//! OBJ: positions, colours after them, and faces of any number of corners (Wavefront, "Object Files (.obj)", Advanced Visualizer
//! manual, appendix B1). STL: ASCII and binary (3D Systems, "Stereolithography Interface Specification", 1989). glTF 2.0: GLB, and
//! JSON with its buffers in it, by the specification of the Khronos Group (ISO/IEC 12113:2022).

mod base64;
mod gltf;
mod gltf_document;
mod obj;
mod stl;
mod write;

pub use gltf::read_gltf;
pub use obj::read_obj;
pub use stl::read_stl;
pub use write::{write_glb, write_obj, write_stl};

use super::mesh::{MOST_FACES, TriangleSoup};
use thiserror::Error;

palpate_model::named! {
    /// Unit of a file's numbers. glTF is always in metres.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum MeshUnit {
        #[default]
        Millimetre = "mm",
        Centimetre = "cm",
        Metre = "m",
    }
}

impl MeshUnit {
    /// Length in mm.
    #[must_use]
    pub fn mm(self) -> f64 {
        match self {
            Self::Millimetre => 1.0,
            Self::Centimetre => 10.0,
            Self::Metre => 1000.0,
        }
    }
}

palpate_model::named! {
    /// Format of a mesh file.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum MeshFormat {
        Obj = "obj",
        Stl = "stl",
        Gltf = "gltf",
        Glb = "glb",
    }
}

impl MeshFormat {
    /// By the end of a file's name.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        let (_, end) = name.rsplit_once('.')?;
        Self::ALL.into_iter().find(|one| one.name().eq_ignore_ascii_case(end))
    }
}

/// A file that is no mesh.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MeshFileError {
    #[error("line {line} of the OBJ file is no {what}: '{text}'; export it again")]
    ObjLine { line: usize, what: &'static str, text: String },
    #[error(
        "the face in line {line} of the OBJ file names vertex {index}, but {vertices} are before it; export it again"
    )]
    ObjIndex { line: usize, index: i64, vertices: usize },
    #[error("only some vertices of the OBJ file have a colour; colour all or none")]
    ObjColours,
    #[error(
        "the STL file ends at {bytes} bytes, but its {faces} triangles need {needed}; copy it again"
    )]
    StlShort { bytes: usize, faces: usize, needed: usize },
    #[error("line {line} of the STL file is no vertex: '{text}'; export it again")]
    StlLine { line: usize, text: String },
    #[error("the STL file has {0} corners, which is no multiple of three; export it again")]
    StlCorners(usize),
    #[error("the file is neither GLB nor glTF: {0}; export it again as GLB")]
    Gltf(String),
    #[error(
        "the glTF file needs the extension {0}, which is not read; export it without compression"
    )]
    GltfExtension(String),
    #[error("the glTF file keeps its numbers in {0}; export it as GLB, which has them in one file")]
    GltfExternal(String),
    #[error("the {what} of the glTF file is not as the specification has it; export it again")]
    GltfPart { what: &'static str },
    #[error("the file has more than {most} triangles; decimate the mesh")]
    TooManyFaces { most: usize },
}

/// Reads a file's bytes. The unit is for OBJ and STL, which do not say theirs; glTF is in metres by its specification.
pub fn read_mesh(
    format: MeshFormat,
    bytes: &[u8],
    unit: MeshUnit,
) -> Result<TriangleSoup, MeshFileError> {
    match format {
        MeshFormat::Obj => read_obj(bytes, unit),
        MeshFormat::Stl => read_stl(bytes, unit),
        MeshFormat::Gltf | MeshFormat::Glb => read_gltf(bytes),
    }
}

/// Refuses more triangles than a mesh may have while they are read, so that a file cannot fill the computer.
fn check_faces(faces: usize) -> Result<(), MeshFileError> {
    if faces > MOST_FACES { Err(MeshFileError::TooManyFaces { most: MOST_FACES }) } else { Ok(()) }
}
