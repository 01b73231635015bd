//! Figures and pages as data, and their painters for files: SVG, PNG, HTML.
//!
//! What a figure shows is decided above; here is how it looks. No window library is needed, so a
//! computer without a display draws the same figures.
//!
//! Start reading at [`figure`] for what a figure is, [`drawing`] for how one becomes a file, [`tokens`] for every
//! colour.
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

pub mod drawing;
pub mod figure;
pub mod page;
pub mod panel;
pub mod raster;
pub mod thin;
pub mod tokens;
pub mod uncertain;
