//! Haply's Inverse3 through the Inverse service 3.5: WebSocket and HTTP on port 10001 of this computer.
//!
//! Sources: Haply's public pages (docs.haply.co, Inverse SDK 3.5) and the crate `haply` 1.3.1. The service answers every
//! message with one report of all devices; forces are in N, places in m.

mod device;
mod discover;
mod exchange;
mod link;
mod message;

pub use device::{InverseOptions, open_inverse};
pub use discover::{FoundDevice, InverseError, find};
pub use exchange::{BEAT, Exchange};
pub use message::{ArmReport, ArmStatus, ReportFault, ServiceReport, write_force};
