//! What a rig reports with every sample.

use crate::Nanos;
use crate::units::Volts;
use serde::{Deserialize, Serialize};
use std::ops::BitOr;

/// Bits that describe the axis at the instant of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct AxisStatus(pub u32);

impl AxisStatus {
    /// A profiled move is in progress.
    pub const MOVING: Self = Self(1);
    /// The move in progress is ending early because of a stop command or a limit switch.
    pub const STOPPING: Self = Self(1 << 1);
    /// The home switch is closed (at or behind home).
    pub const HOME: Self = Self(1 << 2);
    /// The limit switch at the far end of travel is closed.
    pub const FORWARD_LIMIT: Self = Self(1 << 3);
    /// The limit switch behind home is closed.
    pub const REVERSE_LIMIT: Self = Self(1 << 4);
    /// The motor is energised.
    pub const MOTOR_ON: Self = Self(1 << 5);

    /// Whether every bit of `other` is set.
    #[must_use]
    pub const fn has(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

impl BitOr for AxisStatus {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// One sample: the raw signal and the axis, taken at the same tick of the controller clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Controller clock, in its own counts.
    pub tick: u64,
    /// Converter counts; `None` on a rig without a converter.
    pub counts: Option<i32>,
    /// Signal in volts, as received.
    pub volts: Volts,
    /// Commanded position of the axis in whole pulses.
    pub pulses: i64,
    /// State of the axis.
    pub status: AxisStatus,
    /// Age of the sample when it reached the host, if the link reports it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub age: Option<SampleAge>,
}

/// How long before its arrival at the host a sample was taken: what ties the controller's time to the host's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SampleAge {
    /// The best estimate.
    pub by: Nanos,
    /// Largest error of the estimate either way.
    pub within: Nanos,
}
