//! Results as people read them: the strings of a fit that window, command line and pictures share,
//! the picture itself, and the page of the extremes.

pub mod extremes;
pub mod picture;
mod svg;
pub mod text;
pub mod thin;
