//! The picture of a deforming surface and a probe, drawn by the graphics processor, for the window and off the screen.
//!
//! The picture shows the numbers that it is given. Heights and places go to the graphics processor as they are; normals are central
//! differences of the heights; nothing is smoothed. It never reads a clock, a file or a scene: times, surfaces and
//! colours are handed in. Lengths are in mm, z is up, tissue is below.
//!
//! Start at [`Picture`], then `src/gpu/mod.rs`; the looks are in `src/shaders/tissue.wgsl`.

mod callback;
mod camera;
mod gpu;
mod legend;
mod level;
mod look;
mod mesh;
mod off_screen;
mod picture;
mod probe;
mod quantity;
mod surface;
mod thinning;

pub use callback::TissueCallback;
pub use camera::{Camera, Eye, FIELD_OF_VIEW, PictureShape, ProjectedPoint, Vec3};
pub use gpu::{AdapterAbilities, RefusedError, TissueRenderer};
pub use legend::{GrowingRange, Legend, LegendTick};
pub use level::{DetailLevel, LEVELS, LevelChooser, Shading};
pub use look::{ColourRamp, Rgb, SurfaceColours, SurfaceStyle};
pub use mesh::{MeshData, MeshShape, MovedNode};
pub use off_screen::{Image, OffScreen, OffScreenError, Screen};
pub use picture::{EyeLayout, Picture};
pub use probe::{Probe, ProbeError, ProbeKind};
pub use quantity::{ElasticModel, ModelQuantity};
pub use surface::{FieldData, SurfaceData, SurfaceError};
