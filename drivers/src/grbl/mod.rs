//! A Grbl 1.1 board with a slide on one of its axes.
//!
//! Read [`protocol`] first, then `session.rs`, the dialogue in progress, then `connect.rs`, what happens once when the
//! board is opened. The board has no load cell: [`crate::parts`] makes a rig of it and one.

mod error;
pub mod protocol;

pub use error::{Alarm, Refusal};
