//! From the numbers of a poll to a sample.

use super::settings::GalilSettings;
use crate::rig::axis_status;
use palpate_model::rig::{AxisStatus, Reading};
use palpate_model::units::Volts;

/// `TIME` counts samples in a number of the controller, which has 31 bits before the point (DMC-40x0 user manual,
/// variables). Where it wraps is not confirmed; at a millisecond each it takes 24 days.
const TIME_WRAPS: u64 = 1 << 31;
/// A clock that goes back has wrapped only from within a minute (half of one at `TM 500`) before [`TIME_WRAPS`] to
/// within one behind zero; any other has restarted.
const WRAP_NEAR: u64 = 60 * 1024;

/// Bits of `TS` (DMC-1400 user manual, page 211).
pub mod ts {
    pub const MOVING: u32 = 1 << 7;
    pub const MOTOR_OFF: u32 = 1 << 5;
    pub const FORWARD: u32 = 1 << 3;
    pub const REVERSE: u32 = 1 << 2;
    pub const HOME: u32 = 1 << 1;
}

/// Stop codes of a motion that ends or has ended before its target: limits, `ST`, abort, faults (DMC-40x0 command
/// reference, `SC`: "decelerating or stopped by").
pub const EARLY: [u32; 9] = [2, 3, 4, 6, 7, 8, 11, 15, 16];

/// Outcome of a poll.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SampleOutcome {
    Reading(Reading),
    /// The same sample again: two polls fell between two of them.
    Same,
    /// The clock went back, or a digit of it was lost: the next answer decides.
    Doubtful,
    /// The clock went back twice: the controller has been reset.
    Reset,
}

/// Reads answers to the poll, one after the other.
#[derive(Clone, Debug)]
pub struct Sampler {
    settings: GalilSettings,
    /// `TIME` of the newest sample, and what to add to it for a count that never goes back.
    time: Option<u64>,
    offset: u64,
    /// A clock that had gone back in the answer before.
    doubtful: Option<u64>,
    was_moving: bool,
}

impl Sampler {
    #[must_use]
    pub fn new(settings: GalilSettings) -> Self {
        Self { settings, time: None, offset: 0, doubtful: None, was_moving: false }
    }

    /// The command that asks for a sample: signal, pulses given, commanded position, switches, stop code, clock. All
    /// are sent in one answer, so that they belong to one sample of the controller or two.
    #[must_use]
    pub fn question(settings: &GalilSettings) -> String {
        let (input, a) = (settings.input, settings.axis);
        format!("MG @AN[{input}]{{F2.4}},_TD{a},_RP{a},_TS{a},_SC{a},TIME")
    }

    pub const fn is_moving(&self) -> bool {
        self.was_moving
    }

    /// Whether a clock that shows this has restarted since the newest sample.
    pub fn is_reset(&self, time: i64) -> bool {
        self.time.is_some_and(|last| u64::try_from(time).is_ok_and(|time| time < last))
    }

    /// Whether a clock that shows this has gone back for the first time, so that it may be a garbled one: a reset is
    /// believed when a second answer, no earlier than the first, says so too.
    pub fn doubts(&mut self, time: u64) -> bool {
        let is_back = self.time.is_some_and(|last| time < last && !is_wrapped(last, time));
        let is_first = is_back && self.doubtful.is_none_or(|before| time < before);
        self.doubtful = is_back.then_some(time);
        is_first
    }

    /// Takes an answer; `None` when it is none. `is_begun` says that a motion was begun just before this was asked:
    /// the axis moves, whatever its first sample shows.
    pub fn take(&mut self, numbers: &[f64], is_begun: bool) -> Option<SampleOutcome> {
        let &[volts, pulses_given, commanded, switches, stop_code, time] = numbers else {
            return None;
        };
        let (switches, stop_code) = (parse_whole(switches)? as u32, parse_whole(stop_code)? as u32);
        let (pulses_given, commanded) = (parse_register(pulses_given)?, parse_register(commanded)?);
        let time = parse_whole(time)?;
        if !(volts.abs() <= 100.0 && switches < 256 && stop_code < 256) {
            return None;
        }
        if self.doubts(time) {
            return Some(SampleOutcome::Doubtful);
        }
        match self.time {
            Some(last) if time < last => {
                // Either it wrapped or it restarted; what it counted stays counted.
                let is_wrapped = is_wrapped(last, time);
                self.offset += if is_wrapped { TIME_WRAPS } else { last + 1 };
                if !is_wrapped {
                    self.time = Some(time);
                    self.doubtful = None;
                    self.was_moving = false;
                    return Some(SampleOutcome::Reset);
                }
            }
            Some(last) if time == last => return Some(SampleOutcome::Same),
            _ => {}
        }
        self.time = Some(time);
        let status = self.status(switches, stop_code, commanded != pulses_given || is_begun);
        self.was_moving = status.has(AxisStatus::MOVING);
        let counts = volts / self.settings.volts_per_count();
        Some(SampleOutcome::Reading(Reading {
            tick: time + self.offset,
            // Volts are within 100 and a converter has 24 bits at most.
            counts: Some(counts.round() as i32),
            volts: Volts(volts),
            pulses: self.settings.sign() * pulses_given,
            status,
            age: None,
        }))
    }

    fn status(&self, switches: u32, stop_code: u32, has_pulses_left: bool) -> AxisStatus {
        let s = &self.settings;
        let is_high = |bit: u32| switches & bit != 0;
        // `_BG` falls before the smoothing filter has given its last pulses (DMC-2x00 user manual, page 117).
        let is_moving = is_high(ts::MOVING) || has_pulses_left;
        let is_early = EARLY.contains(&stop_code);
        let (mut forward, mut reverse) =
            (s.limits.is_closed(is_high(ts::FORWARD)), s.limits.is_closed(is_high(ts::REVERSE)));
        if s.is_reversed {
            std::mem::swap(&mut forward, &mut reverse);
        }
        axis_status([
            (is_moving, AxisStatus::MOVING),
            (is_early && (is_moving || self.was_moving), AxisStatus::STOPPING),
            (s.home.is_closed(is_high(ts::HOME)), AxisStatus::HOME),
            (forward, AxisStatus::FORWARD_LIMIT),
            (reverse, AxisStatus::REVERSE_LIMIT),
            (!is_high(ts::MOTOR_OFF), AxisStatus::MOTOR_ON),
        ])
    }
}

/// Whether a clock that went back from `last` to `time` did so because it wrapped.
fn is_wrapped(last: u64, time: u64) -> bool {
    last.abs_diff(TIME_WRAPS) < WRAP_NEAR && time < WRAP_NEAR
}

pub fn parse_whole(value: f64) -> Option<u64> {
    (value.fract() == 0.0 && (0.0..=4_294_967_295.0).contains(&value)).then_some(value as u64)
}

/// A position register: 32 bits with a sign.
pub fn parse_register(value: f64) -> Option<i64> {
    (value.fract() == 0.0 && value.abs() <= 2_147_483_648.0).then_some(value as i64)
}

#[cfg(test)]
mod tests;
