//! Acknowledgements and faults, which reach the engine between samples.

use super::command::RigCommand;
use crate::units::Seconds;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The controller accepted a command; settings are as it read them back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ack {
    /// The command with the values the controller really set.
    pub command: RigCommand,
}

/// Something outside the plan went wrong. A `detail` is in the words of the driver or the system.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Error)]
#[serde(tag = "fault", rename_all = "snake_case")]
pub enum Fault {
    #[error("the link to the rig is lost ({detail})")]
    LinkLost { detail: String },
    #[error("the rig refused a command ({detail})")]
    CommandRefused { detail: String },
    /// Position and settings are no longer known.
    #[error("the controller restarted; home the axis again")]
    ControllerReset,
    #[error("the load cell's signal is not a number; check its wiring")]
    SignalInvalid {
        /// Controller tick of the sample.
        tick: u64,
    },
    #[error("the session log cannot be written ({detail})")]
    LogFailed { detail: String },
    /// The session log is whole so far, but the disk will not take it for much longer.
    #[error("the run ends, because the session log may soon fail ({detail})")]
    LogAtRisk { detail: String },
    /// As when the computer is suspended: interlocks were not checked meanwhile.
    #[error(
        "the computer was suspended for {missed:.1}, and the rig was not supervised in that time"
    )]
    HostPaused { missed: Seconds },
}
