//! Homing: find the home switch fast, back off, touch it slowly, call that pulse zero.

use super::prelude::*;
use palpate_model::rig::{AxisStatus, RigCommand};

/// Find the home switch, unless the axis is homed already.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Home {
    pub speed: MmPerS,
    /// Speed of the second touch, which defines position zero.
    pub touch_speed: MmPerS,
}

pub(super) const KEYS: &[Key] = &[
    Key::usual("speed", QuantityKind::Speed, "9 mm/s", "speed of the search"),
    Key::usual(
        "touch_speed",
        QuantityKind::Speed,
        "0.3 mm/s",
        "speed of the second touch, which defines position zero",
    ),
];

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Find the home switch, unless the axis is homed already.",
    keys: KEYS,
    build: Some(|args| Ok(Home::read(args)?.into())),
    needs: &[Need::Motor],
    may_touch: false,
    label: "home",
    ..StepFacts::of("home", Phase::Home, PauseBehaviour::Repeat)
};

impl Home {
    pub(super) fn read(args: &Args) -> Result<Self, String> {
        Ok(Self { speed: args.speed("speed")?, touch_speed: args.speed("touch_speed")? })
    }

    /// Times of a search that begins at these shares of the travel from the switch.
    pub(super) fn expect_from(&self, walk: &mut Walk<'_>, near_share: f64) -> DurationEstimate {
        let travel = walk.limits.travel_max.0;
        // Back off 2 mm and touch again.
        let touch =
            walk.move_secs(BACK_OFF_MM, self.speed) + walk.move_secs(BACK_OFF_MM, self.touch_speed);
        let near = walk.move_secs(near_share * travel, self.speed) + touch;
        let far = walk.move_secs(travel, self.speed) + touch;
        walk.unknown(near, far)
    }

    pub(super) fn check_speeds(&self, walk: &mut Walk<'_>) {
        walk.check_speed(self.speed);
        walk.check_speed(self.touch_speed);
    }
}

impl StepKind for Home {
    fn pass(&self, known: &mut Preconditions) {
        // An axis that is homed already stays where it is.
        known.is_inside &= known.home;
        known.home = true;
    }

    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        self.check_speeds(walk);
        if walk.known.home {
            return DurationEstimate(0.0, 0.0, true);
        }
        self.expect_from(walk, 0.1)
    }
}

impl Executable for Home {
    type Run = HomingRun;

    fn is_done_already(&self, cx: &Context<'_>) -> bool {
        cx.is_homed()
    }

    fn begin(&self, cx: &mut Context<'_>) -> Result<HomingRun, String> {
        HomingRun::begin(cx, *self, HomingPurpose::Define)
    }
}

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

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum HomingPurpose {
    Define,
    /// Only look where home is: position zero stays what it is.
    Check,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HomingRun {
    plan: Home,
    back_off_mm: f64,
    stage: Stage,
    purpose: HomingPurpose,
}

impl HomingRun {
    pub fn begin(cx: &mut Context<'_>, plan: Home, purpose: HomingPurpose) -> Result<Self, String> {
        cx.set_homed(false);
        let mut homing = Self { plan, back_off_mm: BACK_OFF_MM, stage: Stage::Searching, purpose };
        if cx.status().has(AxisStatus::HOME) {
            // Parked on the switch, perhaps on the limit behind it: leave it first.
            homing.back_off_mm = LEAVE_MM;
            homing.stage = Stage::BackingOff;
            cx.move_to_pulses(cx.pulses() + cx.pulses_of(LEAVE_MM), plan.speed)?;
        } else {
            // The axis can be anywhere on its travel, so the search covers all of it and a margin.
            let reach = cx.pulses_of(cx.limits().travel_max.0 + 10.0);
            cx.move_to_pulses(cx.pulses() - reach, plan.speed)?;
        }
        cx.set_homed(purpose == HomingPurpose::Check);
        Ok(homing)
    }
}

impl RunningStep for HomingRun {
    fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Result<Progress, String> {
        let is_at_switch = reading.status.has(AxisStatus::HOME);
        let at_rest = cx.at_rest()?;
        match self.stage {
            Stage::Searching if is_at_switch => {
                cx.stop_move();
                self.stage = Stage::Braking;
            }
            Stage::Braking if at_rest => {
                let target = reading.pulses + cx.pulses_of(BACK_OFF_MM);
                cx.move_to_pulses(target, self.plan.speed)?;
                self.stage = Stage::BackingOff;
            }
            Stage::BackingOff if at_rest => {
                if is_at_switch {
                    return Err("the home switch stays closed; check the switch".into());
                }
                let target = reading.pulses - cx.pulses_of(self.back_off_mm + TOUCH_REACH_MM);
                cx.move_to_pulses(target, self.plan.touch_speed)?;
                self.stage = Stage::Touching;
            }
            Stage::Touching if is_at_switch => {
                cx.stop_move();
                self.stage = Stage::TouchBraking { edge_pulses: reading.pulses };
            }
            Stage::Searching | Stage::Touching if at_rest => {
                return Err("the home switch was not found; check the switch and its cable".into());
            }
            Stage::TouchBraking { edge_pulses }
                if at_rest && self.purpose == HomingPurpose::Check =>
            {
                cx.record(Record::HomeChecked { missed_pulses: edge_pulses });
                return Ok(Progress::Done);
            }
            Stage::TouchBraking { edge_pulses } if at_rest => {
                cx.command(RigCommand::DefinePosition { pulses: reading.pulses - edge_pulses });
                cx.record(Record::Homed { edge_pulses });
                self.stage = Stage::Defining;
            }
            Stage::Defining if cx.is_acknowledged() => {
                cx.set_homed(true);
                return Ok(Progress::Done);
            }
            _ => {}
        }
        Ok(Progress::Continue)
    }
}
