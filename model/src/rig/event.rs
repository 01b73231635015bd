//! What reaches the engine beside samples: acknowledgements and faults.

use super::command::RigCommand;
use crate::units::Seconds;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The controller accepted a command; settings are as it read them back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ack {
    /// The command with the values the controller really set.
    pub command: RigCommand,
}

/// Something outside the plan went wrong.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "fault", rename_all = "snake_case")]
pub enum Fault {
    /// The link to the rig is gone.
    LinkLost {
        /// What the driver saw.
        detail: String,
    },
    /// The controller refused a command.
    CommandRefused {
        /// What the controller said.
        detail: String,
    },
    /// The controller restarted: position and settings are no longer known.
    ControllerReset,
    /// The load cell's signal is not a number.
    SignalInvalid {
        /// Controller tick of the sample.
        tick: u64,
    },
    /// The session log cannot be written.
    LogFailed {
        /// What the disk said.
        detail: String,
    },
    /// The session log is whole so far, but the disk will not take it for much longer.
    LogAtRisk {
        /// What became of the log.
        detail: String,
    },
    /// The computer stood still, as when it is suspended, so that nobody watched the rig.
    HostPaused {
        /// For how long.
        missed: Seconds,
    },
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LinkLost { detail } => write!(f, "the link to the rig is lost ({detail})"),
            Self::CommandRefused { detail } => write!(f, "the rig refused a command ({detail})"),
            Self::ControllerReset => write!(f, "the controller restarted; home the axis again"),
            Self::SignalInvalid { .. } => {
                write!(f, "the load cell's signal is not a number; check its wiring")
            }
            Self::LogFailed { detail } => write!(f, "the session log cannot be written ({detail})"),
            Self::LogAtRisk { detail } => {
                write!(f, "the run ends before the disks take no more ({detail})")
            }
            Self::HostPaused { missed } => {
                write!(f, "the computer stood still for {missed:.1} and nobody watched the rig")
            }
        }
    }
}
