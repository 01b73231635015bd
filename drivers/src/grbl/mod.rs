//! A Grbl 1.1 board with a slide on one of its axes.
//!
//! Read [`protocol`] first, then `session.rs`, the dialogue in progress, then `connect.rs`, what happens once when the
//! board is opened. The board has no load cell: [`crate::parts`] makes a rig of it and one.

mod axis;
mod connect;
mod console;
mod error;
mod feed_correction;
mod fitness;
mod motion;
mod pins;
pub mod protocol;
mod session;
mod settings;
mod times;

use crate::devices::{DeviceKind, Role, find_line};
use protocol::Incoming;

pub use axis::open;
pub use connect::{Connected, connect};
pub use error::{GrblCode, GrblOpenError};
pub use fitness::MM_PER_STEP_MIN;
pub use motion::worst_case_mm;
pub use session::{Session, SharedTrack};
pub use settings::{BoardParameters, GrblSettings, HomeSwitch};

pub(crate) const KIND: DeviceKind = DeviceKind {
    word: "grbl",
    title: "a Grbl controller",
    introduction: "Grbl, ",
    role: Role::Axis(crate::rig_file::grbl),
    recognise: |lines| find_line(lines, is_of_grbl),
};

/// Its banner, a status report, an error, an alarm or a message.
fn is_of_grbl(line: &str) -> bool {
    match Incoming::parse(line) {
        Incoming::Hello(_) | Incoming::Status(_) => true,
        Incoming::Refused(refusal) => refusal.code.is_some(),
        Incoming::Alarm(alarm) => alarm.code.is_some(),
        Incoming::Message(message) => message.starts_with("MSG:"),
        _ => false,
    }
}
