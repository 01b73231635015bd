//! Motion controllers and load cells, real and simulated.
//!
//! This crate turns commands into bytes and bytes into readings. It never decides: what to do
//! with a reading is the engine's business, and nothing here starts a move by itself.
//! Start reading at [`rig`], the trait every rig implements, then [`sim`] for the rig that needs
//! no hardware.
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

mod board_clock;
pub mod cell;
pub mod detect;
pub mod device;
pub mod devices;
pub mod galil;
pub mod grbl;
pub mod hx711;
pub mod mark10;
pub mod open;
pub mod plain_numbers;
pub mod priority;
pub mod rig;
pub mod rig_file;
pub mod rig_search;
pub mod serial;
pub mod sidecar;
pub mod sim;
pub mod split_rig;
pub mod text;
pub mod wire;

pub use open::{is_rig_file, open, open_wired, read_rig_file, read_rig_text};
pub use rig::{Rig, RigError, RigEvent, RigEventBody};
