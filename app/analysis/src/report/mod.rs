//! Results as people read them: the strings of a fit and of a selection that window, command line and
//! pictures share, the pictures themselves, and the page of the extremes.

mod band;
pub mod calibration;
pub mod calibration_plot;
pub mod catalog;
pub mod cycles;
pub mod dossier;
pub mod extremes;
pub mod family;
pub(crate) mod family_json;
pub mod figures;
pub mod haptics;
pub(crate) mod imported;
pub mod kept;
mod page;
pub mod picture;
pub mod plan_picture;
pub mod programme;
mod raster;
pub mod said;
pub mod scene;
pub mod selection;
mod selection_plot;
pub mod session;
pub(crate) mod svg;
pub mod text;
pub mod thin;

pub use selection_plot::of_selection;
