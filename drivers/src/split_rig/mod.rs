//! A rig from parts: a motion controller and a load cell, each on a wire and with a clock of its own.
//!
//! Each has a thread that talks to it. The axis' thread writes what the axis does into a [`AxisTrack`]; samples of the
//! cell, with their time on the host's clock, look up there where the axis was when they were taken. Whatever goes
//! wrong with the cell stops the axis, without the rig's owner.

mod cell_clock;
mod cell_line;
mod rig;
mod track;

pub use cell_clock::CellClock;
pub use cell_line::{CellLine, TICK};
pub use rig::{OpenedAxis, SplitRigDevices};
pub use track::{AxisState, AxisTrack};
