//! Commands to a rig. Only the runner sends these, and only because the engine asked.

use crate::units::{MmPerS, MmPerS2, Position};
use serde::{Deserialize, Serialize};

/// A move to an absolute pulse position on a trapezoidal profile.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MoveTo {
    /// Target in pulses of the controller's own counter.
    pub target_pulses: i64,
    /// Cruise speed; a rig only makes whole multiples of its speed quantum.
    pub speed: MmPerS,
    /// Acceleration and deceleration.
    pub acceleration: MmPerS2,
}

/// Whole cycles of a sine from where the axis rests, which is one of its turning points:
/// `x(t) = x(0) + amplitude (1 - cos(2 pi t / period))`. [`super::Sine`] is the path it makes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Oscillation {
    /// Half the way between the turning points, in pulses; negative starts away from the tissue.
    pub amplitude_pulses: i64,
    /// Controller ticks of one cycle, so that the frequency is exact on the clock that stamps the samples.
    pub period_ticks: u32,
    /// Cycles before the axis rests again where it started.
    pub cycles: u32,
    /// Deceleration when it is stopped on the way.
    pub acceleration: MmPerS2,
}

/// One command to a rig.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "command", rename_all = "snake_case")]
pub enum RigCommand {
    /// Energise the motor and hold position (Galil `SH`).
    EnableMotor,
    /// Move to an absolute position (Galil `PA`, `SP`, `AC`, `BG`).
    MoveTo(MoveTo),
    /// Move to an absolute position from rest or from any motion of this kind, whose target it replaces: speed and
    /// acceleration stay within those of the command, and the axis brakes before it turns (Galil position tracking: `PT`,
    /// then `PA` at any time). Only a rig that takes targets on the way has it.
    Track(MoveTo),
    /// Go in and out on a sine, by itself (Galil contour mode: `CM`, then `DT` and `CD` for increments over
    /// 2^n samples, between which the controller interpolates, from its program; DMC-1700/1800 user manual, chapter 6).
    Oscillate(Oscillation),
    /// Decelerate to rest and hold (Galil `ST`).
    Stop,
    /// Cut the motion at once (Galil `AB`).
    Halt,
    /// Give the present position a new count (Galil `DP`).
    DefinePosition {
        /// The count the present position gets.
        pulses: i64,
    },
}

impl RigCommand {
    /// Whether it moves the axis.
    pub const fn is_motion(&self) -> bool {
        matches!(self, Self::MoveTo(_) | Self::Track(_) | Self::Oscillate(_))
    }

    /// Whether a controller that acknowledges `set` does what this command asks. It counts speed and acceleration
    /// in quanta of its own, so 0.9 mm/s may come back as thirty times 0.03 mm/s, which is not the same float.
    pub fn is_answered_by(&self, set: &Self) -> bool {
        // Far below any quantum of speed, far above the rounding of a product.
        let is_near = |requested: f64, set: f64| (requested - set).abs() <= 1e-9 * requested.abs();
        match (self, set) {
            (Self::MoveTo(requested), Self::MoveTo(set))
            | (Self::Track(requested), Self::Track(set)) => {
                requested.target_pulses == set.target_pulses
                    && is_near(requested.speed.0, set.speed.0)
                    && is_near(requested.acceleration.0, set.acceleration.0)
            }
            (Self::Oscillate(requested), Self::Oscillate(set)) => {
                let acceleration = set.acceleration;
                *set == Oscillation { acceleration, ..*requested }
                    && is_near(requested.acceleration.0, acceleration.0)
            }
            _ => self == set,
        }
    }

    /// Whether this command takes speed out of the axis; such commands overtake all others.
    pub fn is_stopping(&self) -> bool {
        matches!(self, Self::Stop | Self::Halt)
    }
}

/// Machine position of a pulse count.
#[must_use]
pub fn position_from_pulses(pulses: i64, mm_per_pulse: f64) -> Position {
    Position(pulses as f64 * mm_per_pulse)
}

/// The whole pulse nearest to a machine position.
#[must_use]
pub fn pulses_from_position(position: Position, mm_per_pulse: f64) -> i64 {
    (position.0 / mm_per_pulse).round() as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_speed_counted_in_quanta_is_the_speed_asked_for() {
        let to = |speed: f64, target_pulses| {
            RigCommand::MoveTo(MoveTo {
                target_pulses,
                speed: MmPerS(speed),
                acceleration: MmPerS2(61.44),
            })
        };
        // Thirty quanta are 0.8999999999999999.
        assert!(to(0.9, 10).is_answered_by(&to(30.0 * 0.03, 10)));
        assert!(!to(0.9, 10).is_answered_by(&to(0.87, 10)));
        assert!(!to(0.9, 10).is_answered_by(&to(0.9, 11)));
        assert!(!to(0.9, 10).is_answered_by(&RigCommand::Stop));
    }
}
