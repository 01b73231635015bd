//! The description that a rig reports about itself when it is connected.

use super::command::Oscillation;
use super::oscillation::SinePath;
use super::sensor::RigSensors;
use crate::is_default;
use crate::units::{MmPerS, MmPerS2, Position, Seconds, Volts};
use serde::{Deserialize, Serialize};

/// The converter between the load cell and the host.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AdcDescription {
    pub counts_min: i32,
    pub counts_max: i32,
    /// Volts of one count.
    pub volts_per_count: f64,
}

/// A rig's identity and its physical truths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RigDescription {
    /// Name as the operator knows it, such as `sim`.
    pub name: String,
    /// Model and firmware as the rig reports them.
    pub identity: String,
    /// Settings that reproduce a simulated rig exactly (profile, seed, clock); empty on a real one.
    pub settings: std::collections::BTreeMap<String, String>,
    /// Travel of one pulse, in mm.
    pub mm_per_pulse: f64,
    /// End of the travel; home is position 0.
    pub travel: Position,
    /// True length of one controller clock count, in nanoseconds.
    pub tick_nanos: u64,
    /// Speeds are whole multiples of this.
    pub speed_quantum: MmPerS,
    /// Fastest speed allowed.
    pub speed_max: MmPerS,
    /// Acceleration used for every move, as the controller reads it back.
    pub acceleration: MmPerS2,
    /// The load cell's converter; `None` where volts arrive without one.
    pub adc: Option<AdcDescription>,
    /// White noise of the signal expected at rest (standard deviation).
    pub noise_expected: Volts,
    /// By how long reported pulses may be behind or before the commanded path: filters of the drive, and the time from
    /// a command to the sample behind it. Zero on a simulated rig.
    #[serde(default, skip_serializing_if = "is_default")]
    pub pulse_lag: Seconds,
    /// How long before it was sent a value of the load cell was measured, because of a filter of its own. Zero where it has none.
    #[serde(default, skip_serializing_if = "is_default")]
    pub cell_delay: Seconds,
    /// On average a sample comes in so many ticks of the controller. One on a rig that reports every tick; more on one that
    /// is asked for its samples over a link, or whose load cell is slower than its clock.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub ticks_per_sample: f64,
    /// How far the probe may go while no sample comes; from 0.02 to 0.5 mm.
    #[serde(default = "usual_unseen", skip_serializing_if = "is_usual_unseen")]
    pub unseen_max: Position,
    /// Whether its axis takes a new target while it moves.
    #[serde(default, skip_serializing_if = "is_default")]
    pub takes_targets: bool,
    /// What it reports apart from load cell and axis.
    #[serde(default, skip_serializing_if = "is_default")]
    pub sensors: RigSensors,
}

const fn usual_unseen() -> Position {
    RigDescription::UNSEEN_USUAL
}

fn is_usual_unseen(distance: &Position) -> bool {
    *distance == RigDescription::UNSEEN_USUAL
}

const fn one() -> f64 {
    1.0
}

fn is_one(count: &f64) -> bool {
    *count == one()
}

impl RigDescription {
    /// How far a probe may usually go while no sample comes: into tissue that resists with 0.5 N/mm, more than that of the
    /// thesis does at 20 mm, until 0.05 N more than was last seen.
    pub const UNSEEN_USUAL: Position = Position(0.1);

    /// Length of one controller clock count.
    pub fn tick(&self) -> Seconds {
        Seconds(self.tick_nanos as f64 * 1e-9)
    }

    /// Samples in a millisecond, or thereabouts: 1 on a rig that samples a thousand times a second, be its millisecond
    /// of 976 us, and 20 on one that does so twenty thousand times. What is meant to last as long as so many samples of
    /// the one takes as many times more of the other.
    pub fn samples_per_ms(&self) -> u32 {
        // Saturates for a tick of zero, which no rig has.
        let nanos = self.tick_nanos.max(1) as f64 * self.ticks_per_sample.max(1.0);
        (1e6 / nanos).round().max(1.0) as u32
    }

    /// What a filter of so many milliseconds holds: a mean of each millisecond, or as many samples as come in them where
    /// they come more seldom, one at least.
    pub fn means_in(&self, ms: usize) -> usize {
        let apart_ms = self.tick_nanos as f64 * 1e-6 * self.ticks_per_sample;
        if self.ticks_per_sample <= 1.0 || apart_ms <= 1.0 {
            return ms;
        }
        ((ms as f64 / apart_ms).round() as usize).clamp(1, ms.max(1))
    }

    /// Whether the signal's own noise changes its counts, so that many equal samples are a dead cell. Half a count of
    /// white noise leaves two samples equal two times in five; a hundred in a row never happen.
    pub fn shows_noise(&self) -> bool {
        self.adc.is_none_or(|adc| self.noise_expected.0 >= 0.5 * adc.volts_per_count)
    }

    /// Checks that the rig can follow an oscillation, and explains a refusal.
    pub fn check_oscillation(&self, command: &Oscillation) -> Result<(), String> {
        SinePath::new(Position(0.0), command, self.mm_per_pulse, self.tick())
            .check(self.speed_max, self.acceleration)
            .map_err(|why| format!("rig {} cannot do this: {why}", self.name))
    }

    /// Checks a speed against range and quantum, and explains a refusal.
    pub fn check_speed(&self, speed: MmPerS) -> Result<(), String> {
        let quantum = self.speed_quantum.0;
        if !speed.is_finite() {
            return Err("the speed is not a number; give millimetres per second".into());
        }
        if speed.0 < quantum * (1.0 - 1e-9) || speed.0 > self.speed_max.0 * (1.0 + 1e-9) {
            return Err(format!(
                "a speed of {speed} is outside the range of rig {}; choose from {} to {}",
                self.name, self.speed_quantum, self.speed_max
            ));
        }
        let multiple = speed.0 / quantum;
        // 1e-6 of a quantum forgives decimal rounding of the request, nothing more.
        if (multiple - multiple.round()).abs() > 1e-6 {
            let below = multiple.floor() * quantum;
            let above = below + quantum;
            let nearest = if above > self.speed_max.0 * (1.0 + 1e-9) {
                format!("the nearest is {below:.4} mm/s")
            } else {
                format!("the nearest are {below:.4} and {above:.4} mm/s")
            };
            return Err(format!(
                "rig {} cannot move at {speed}: its speeds are multiples of {}; {nearest}",
                self.name, self.speed_quantum
            ));
        }
        Ok(())
    }
}
