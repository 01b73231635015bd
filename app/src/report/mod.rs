//! A fit as people read it: the strings that window, command line and pictures share, and the
//! picture itself.

pub mod picture;
pub(crate) mod svg;
pub mod text;
pub mod thin;
