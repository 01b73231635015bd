//! A fit and a selection as people read them: the strings that window, command line and pictures
//! share, and the pictures themselves.

pub mod family;
pub mod picture;
pub mod selection;
mod selection_plot;
mod svg;
pub mod text;
pub mod thin;

pub use selection_plot::of_selection;
