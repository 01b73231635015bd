//! A Grbl 1.1 board with a slide on one of its axes.
//!
//! Read [`protocol`] first, then `session.rs`, the dialogue in progress, then `connect.rs`, what happens once when the
//! board is opened. The board has no load cell: [`crate::parts`] makes a rig of it and one.

mod axis;
mod connect;
mod console;
mod error;
mod fitness;
mod motion;
mod pace;
mod pins;
pub mod protocol;
mod session;
mod settings;
mod times;

pub use axis::open;
pub use connect::{Connected, connect};
pub use error::{Alarm, GrblOpenError, Refusal};
pub use fitness::MM_PER_STEP_MIN;
pub use motion::worst_case_mm;
pub use session::{Session, SharedTrack};
pub use settings::{Facts, GrblSettings, HomeSwitch};
