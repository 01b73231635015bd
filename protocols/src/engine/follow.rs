//! A slave that goes where it is led, one move after another: a controller takes a new target only at rest, so the
//! slave is behind its lead by about the duration of a move.
//!
//! In doubt it stops: a lead that stops coming leaves it where it is, and after a while the step ends.

use super::context::{Context, Progress};
use super::input::Record;
use super::state::{Active, Activity};
use crate::plans::Follow;
use palpate_model::Nanos;
use palpate_model::rig::Reading;
use palpate_model::rig::command::pulses_from_position;
use palpate_model::units::{Depth, Position, Seconds};

/// Time without a lead after which the slave stops: a hand that is followed is never still for so long to what leads,
/// which says where it is all the time.
const SILENT_MAX: Seconds = Seconds(0.5);

/// Time without a lead after which the step ends, so that the plan leaves the tissue: long enough for a program that
/// hangs to come back.
const LOST: Seconds = Seconds(5.0);

/// Data of a slave that follows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Following {
    plan: Follow,
    until_tick: u64,
    /// The surface, and the furthest pulse that is neither deeper than the plan allows nor beyond the travel.
    surface: Position,
    deepest_pulses: i64,
    /// Where it is to be; none before the first lead.
    wanted: Option<Depth>,
    /// When the last lead came, or the step began.
    led_at: Nanos,
    is_lost: bool,
    is_stopping: bool,
    is_refusal_told: bool,
}

impl Following {
    pub fn begin(cx: &Context<'_>, plan: Follow) -> Result<Self, String> {
        let contact = cx
            .state
            .contact
            .ok_or("contact is not known; find it first")?;
        let config = &cx.state.config;
        let deepest = plan.depth_max.position_from(contact.position);
        let deepest = deepest.0.min(config.limits.travel_max.0);
        Ok(Self {
            plan,
            until_tick: cx.state.tick + cx.state.ticks(plan.duration),
            surface: contact.position,
            // 1e-6 of a pulse forgives the rounding of what is a whole number of them.
            deepest_pulses: (deepest / config.rig.mm_per_pulse + 1e-6).floor() as i64,
            wanted: None,
            led_at: cx.now,
            is_lost: false,
            is_stopping: false,
            is_refusal_told: false,
        })
    }

    pub fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Progress {
        match self.advance(cx, reading) {
            Ok(progress) => progress,
            Err(reason) => Progress::Fail(format!("follow: {reason}")),
        }
    }

    fn advance(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Result<Progress, String> {
        let at_rest = cx.at_rest()?;
        let silent = cx.now.since(self.led_at).seconds();
        let is_lost = silent > SILENT_MAX;
        if is_lost && !self.is_lost {
            self.wanted = None;
            cx.record(Record::LeadLost { silent });
        }
        self.is_lost = is_lost;
        let is_over = reading.tick >= self.until_tick || silent > LOST;
        if !at_rest {
            if (is_lost || is_over) && !self.is_stopping {
                self.is_stopping = true;
                cx.stop_move();
            }
            return Ok(Progress::Continue);
        }
        self.is_stopping = false;
        if is_over {
            return Ok(Progress::Done);
        }
        if let Some(wanted) = self.wanted {
            let rig = &cx.state.config.rig;
            let wanted = pulses_from_position(wanted.position_from(self.surface), rig.mm_per_pulse);
            // Home is the end of the way out.
            let target = wanted.clamp(0, self.deepest_pulses.max(0));
            if target != cx.state.pulses {
                cx.move_to_pulses(target, self.plan.speed)?;
            }
        }
        Ok(Progress::Continue)
    }
}

/// A lead came; it counts only in a step that follows.
pub(super) fn on_lead(cx: &mut Context<'_>, depth: Option<Depth>) {
    let now = cx.now;
    let Activity::Step(Active::Follow(following)) = &mut cx.state.activity else {
        return;
    };
    match depth.filter(|depth| depth.0.is_finite()) {
        Some(depth) => {
            following.wanted = Some(depth);
            following.led_at = now;
        }
        // It is as good as none: should no other come, the slave stops.
        None if following.is_refusal_told => {}
        None => {
            following.is_refusal_told = true;
            cx.record(Record::Refused {
                reason: "what leads the slave gave no number; check what leads it".into(),
            });
        }
    }
}
