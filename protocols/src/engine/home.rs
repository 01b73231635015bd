//! Homing: find the home switch fast, back off, touch it slowly, call that pulse zero.

use super::context::{Context, Progress};
use super::input::Record;
use palpate_model::rig::{AxisStatus, Reading, RigCommand};
use palpate_model::units::MmPerS;

/// Distance to back off from the switch before the slow touch, in mm: over ten times the braking
/// distance of the fast search.
const BACK_OFF_MM: f64 = 2.0;

/// Distance to leave a switch on which the probe was parked, in mm: from behind the rear limit
/// switch, 2 mm behind home, with margin.
const LEAVE_MM: f64 = 8.0;

/// How far past the back-off distance the slow touch may look, in mm.
const TOUCH_REACH_MM: f64 = 2.0;

#[derive(Clone, Debug, PartialEq)]
enum Stage {
    Searching,
    Braking,
    BackingOff,
    Touching,
    TouchBraking { edge_pulses: i64 },
    Defining,
}

/// Data of a homing in progress.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Homing {
    speed: MmPerS,
    touch_speed: MmPerS,
    /// How far the probe was moved off the switch.
    back_off_mm: f64,
    stage: Stage,
    /// Only look where home is: position zero stays what it is.
    is_check: bool,
}

impl Homing {
    pub fn begin_check(
        cx: &mut Context<'_>,
        speed: MmPerS,
        touch_speed: MmPerS,
    ) -> Result<Self, String> {
        let homing = Self::begin(cx, speed, touch_speed)?;
        cx.state.is_homed = true;
        Ok(Self {
            is_check: true,
            ..homing
        })
    }

    pub fn begin(cx: &mut Context<'_>, speed: MmPerS, touch_speed: MmPerS) -> Result<Self, String> {
        cx.state.is_homed = false;
        let mut homing = Self {
            speed,
            touch_speed,
            back_off_mm: BACK_OFF_MM,
            stage: Stage::Searching,
            is_check: false,
        };
        if cx.state.status.has(AxisStatus::HOME) {
            // Parked on the switch, perhaps on the limit behind it: leave it first.
            homing.back_off_mm = LEAVE_MM;
            homing.stage = Stage::BackingOff;
            cx.move_to_pulses(cx.state.pulses + pulses(cx, LEAVE_MM), speed)?;
            return Ok(homing);
        }
        // The axis can be anywhere on its travel, so the search covers all of it and a margin.
        let reach = pulses(cx, cx.state.config.limits.travel_max.0 + 10.0);
        cx.move_to_pulses(cx.state.pulses - reach, speed)?;
        Ok(homing)
    }

    pub fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Progress {
        match self.advance(cx, reading) {
            Ok(progress) => progress,
            Err(reason) => Progress::Fail(format!("home: {reason}")),
        }
    }

    fn advance(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Result<Progress, String> {
        let is_at_switch = reading.status.has(AxisStatus::HOME);
        let at_rest = cx.at_rest()?;
        match self.stage {
            Stage::Searching if is_at_switch => {
                cx.stop_move();
                self.stage = Stage::Braking;
            }
            Stage::Braking if at_rest => {
                let target = reading.pulses + pulses(cx, BACK_OFF_MM);
                cx.move_to_pulses(target, self.speed)?;
                self.stage = Stage::BackingOff;
            }
            Stage::BackingOff if at_rest => {
                if is_at_switch {
                    return Err("the home switch stays closed; check it".into());
                }
                let target = reading.pulses - pulses(cx, self.back_off_mm + TOUCH_REACH_MM);
                cx.move_to_pulses(target, self.touch_speed)?;
                self.stage = Stage::Touching;
            }
            Stage::Touching if is_at_switch => {
                cx.stop_move();
                self.stage = Stage::TouchBraking {
                    edge_pulses: reading.pulses,
                };
            }
            Stage::Searching | Stage::Touching if at_rest => {
                return Err("the home switch was not found; check it and its cable".into());
            }
            Stage::TouchBraking { edge_pulses } if at_rest && self.is_check => {
                cx.record(Record::HomeChecked {
                    missed_pulses: edge_pulses,
                });
                return Ok(Progress::Done);
            }
            Stage::TouchBraking { edge_pulses } if at_rest => {
                cx.command(RigCommand::DefinePosition {
                    pulses: reading.pulses - edge_pulses,
                });
                cx.record(Record::Homed { edge_pulses });
                self.stage = Stage::Defining;
            }
            Stage::Defining if cx.state.unacknowledged.is_empty() => {
                cx.state.is_homed = true;
                return Ok(Progress::Done);
            }
            _ => {}
        }
        Ok(Progress::Continue)
    }
}

fn pulses(cx: &Context<'_>, distance_mm: f64) -> i64 {
    (distance_mm / cx.state.config.rig.mm_per_pulse).round() as i64
}
