//! The limits that interlocks hold on every sample. No plan can loosen or skip them.

use crate::units::{MmPerS, Newtons, Position, Seconds, Volts};
use serde::{Deserialize, Serialize};

/// Interlock thresholds of one rig.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Furthest machine position.
    pub travel_max: Position,
    /// Highest force above tare.
    pub force_max: Newtons,
    /// Lowest force above tare: a cell that reads tension is unplugged or broken.
    pub force_min: Newtons,
    /// Highest raw signal, independent of any calibration.
    pub volts_max: Volts,
    /// Fastest change of force between two means of 10 ms, in N/s.
    pub force_rate_max: f64,
}

impl Limits {
    /// Limits for the thesis's cell: 9 N above tare, below the heaviest calibration weight
    /// (10.199 N), and 2.80 V, below its voltage (2.84 V). Soft tissue at the fastest speed
    /// offered changes by under 10 N/s; five times that is a collision or a broken wire.
    #[must_use]
    pub fn for_travel(travel_max: Position) -> Self {
        Self {
            travel_max,
            force_max: Newtons(9.0),
            force_min: Newtons(-1.0),
            volts_max: Volts(2.80),
            force_rate_max: 50.0,
        }
    }

    /// Longest tolerated age of the newest sample at a speed: the time in which the probe moves
    /// as far as it may `unseen`, kept between 20 ms (two scheduler slices of a desktop host) and 250 ms. A rig whose samples come `apart`,
    /// as those of a slow load cell, has that time in addition to the 20 ms: its newest sample is as old by itself.
    #[must_use]
    pub fn sample_age_max(speed: MmPerS, unseen: Position, apart: Seconds) -> Seconds {
        let span = if speed.0.abs() > 0.0 { unseen.0 / speed.0.abs() } else { f64::INFINITY };
        // Apart by more than 230 ms there is no room for a computer's slices: nothing moves on such a rig.
        Seconds(span.clamp((0.020 + apart.0.max(0.0)).min(0.250), 0.250))
    }
}
