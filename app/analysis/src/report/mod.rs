//! Results as people read them: the strings of a fit and of a selection that window, command line and
//! pictures share, the pictures themselves, and the page of the extremes.

pub mod budget;
pub mod calibration;
pub mod calibration_plot;
pub mod catalog;
pub mod cycles;
pub mod dossier;
mod dynamic;
#[cfg(feature = "extremes")]
pub mod extremes;
pub mod figures;
pub mod fit_json;
#[cfg(feature = "haptics")]
pub mod haptics;
pub mod live;
pub mod master_curve;
mod material;
pub mod panels;
pub mod picture;
pub mod plan_picture;
pub mod plan_plot;
pub mod programme;
pub mod property;
pub mod property_plot;
pub mod queue;
mod relaxation;
pub mod scatter;
#[cfg(feature = "haptics")]
pub mod scene;
pub mod selection;
pub mod selection_plot;
pub mod session;
pub mod session_text;
pub mod stored_analysis;
pub mod text;
mod unloading;

pub use selection_plot::of_selection;
