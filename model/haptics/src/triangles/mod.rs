//! A surface of any shape: triangles, such as a stomach from a scan, touched at a thousand ticks a second.
//!
//! [`TriangleMesh`] is made once from a [`TriangleSoup`], which [`files`] reads from the bytes of an OBJ, STL or glTF file. On it
//! [`MeshProxy`] follows a device and stays on the surface, [`GeodesicDistance`] finds the vertices around a contact, and [`Dent`]
//! sinks them. [`MaterialMap`] says which vertex is of which material and [`BlendedLaw`] has a force model for each.
//! [`TouchedMesh`] puts them together, and [`MeshScene`](crate::scene::MeshScene) adds device and guards. [`shapes`] makes meshes by formula.
//!
//! As in the rest of the crate, everything in a tick is total, deterministic to the bit and free of allocation. Lengths are in mm.
//! The frame is that of the file.

mod blend;
mod build;
mod dent;
mod error;
pub mod files;
mod geodesic;
mod heap;
mod materials;
mod mesh;
mod proxy;
mod shading;
pub mod shapes;
mod touch_loop;
mod tree;
mod triangle;
mod vector;
mod weld;

pub use blend::{BlendError, BlendTick, BlendedLaw};
pub use dent::{Dent, DentSettings, DentTick};
pub use error::TriangleMeshError;
pub use geodesic::GeodesicDistance;
pub(crate) use materials::FIRST_ALONE;
pub use materials::{MOST_MATERIALS, MaterialError, MaterialMap};
pub use mesh::{LARGEST_MM, MOST_FACES, SMALLEST_MM, SurfacePoint, TriangleMesh, TriangleSoup};
pub use proxy::{FAR_MM, MeshProxy, MeshTouch, Shading};
pub use touch_loop::{MeshTick, MeshTouchError, MeshTouchLoop, MeshTouchSettings, TouchedMesh};
pub use tree::MeshHit;
pub use triangle::{TriangleFeature, closest_on_triangle};
