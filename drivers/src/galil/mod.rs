//! A Galil DMC controller on a serial line or a network, with a pulse-driven slide on one axis and the load cell on an
//! analog input.
//!
//! Read [`protocol`] first, then `session`, the dialogue in progress, then `connect.rs`, what happens once when the
//! controller is opened. [`GalilRig`] puts a session on a link.

mod capture;
mod clock_alignment;
mod codes;
mod connect;
mod console;
mod error;
mod model;
mod order;
pub mod protocol;
mod recording;
mod rig;
mod sampling;
mod session;
mod settings;
mod sine;
mod watchdog;

use crate::devices::{DeviceKind, Role, find_line};

pub use codes::ErrorCode;
pub use connect::{Connected, connect};
pub use error::GalilError;
pub use model::{GalilBoard, GalilOpenError};
pub use rig::{GalilDevice, GalilRig};
pub use session::Session;
pub use settings::{AnalogRange, GalilSettings, Levels, MotorType, Sampling};

pub(crate) const KIND: DeviceKind = DeviceKind {
    word: "galil",
    title: "a Galil controller",
    introduction: "Galil controller, ",
    role: Role::Axis(crate::rig_file::galil),
    recognise: |lines| find_line(lines, |line| line.starts_with("DMC") || line.starts_with("RIO")),
};
