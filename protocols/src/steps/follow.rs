//! A slave that goes where it is led. Where the controller takes a new target only at rest, the slave makes one move after
//! another and is behind its lead by about the duration of a move. Where it takes targets on the way, the slave gets every
//! one, and is behind by the time in which it brakes from its speed.
//!
//! In doubt it stops: a lead that stops coming leaves it where it is, and after a while the step ends.

use super::prelude::*;
use crate::preview::SETTLE_SECS;
use palpate_model::Nanos;
use palpate_model::rig::AxisStatus;
use palpate_model::rig::command::pulses_from_position;

/// Go where a lead from outside says, such as the master of a master-slave system, within bounds that no lead can
/// move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Follow {
    pub duration: Seconds,
    pub speed: MmPerS,
    pub depth_max: Depth,
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Follow the depths that a master sends. Only a run with a master has this step: `palpate haptics slave --protocol FILE`.",
    keys: &[
        Key::needed("for", QuantityKind::Time, "duration"),
        Key::needed("speed", QuantityKind::Speed, "greatest speed of the slave"),
        Key::needed(
            "depth_max",
            QuantityKind::Length,
            "greatest depth; the slave goes no deeper, wherever the master is",
        ),
    ],
    build: Some(|args| {
        Ok(Follow {
            duration: args.seconds("for")?,
            speed: args.speed("speed")?,
            depth_max: Depth(args.number("depth_max")?),
        }
        .into())
    }),
    needs: FROM_SURFACE,
    gives: &[Need::Inside],
    is_measuring: true,
    label: "follow",
    // What leads may be elsewhere by then, and the slave goes there.
    ..StepFacts::of("follow", Phase::Follow, PauseBehaviour::Repeat)
};

impl StepKind for Follow {
    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_speed(self.speed);
        walk.check_depth(self.depth_max);
        walk.check_span(self.duration);
        let (duration, way) = (self.duration.0, self.depth_max.0);
        // Where it goes is not known before; what bounds it is.
        let there = walk.move_secs(way - walk.expected.depth(), self.speed);
        walk.expected.go(walk.phase, way, there.min(duration));
        walk.expected.stay(walk.phase, (duration - there).max(0.0));
        walk.reach = Reach { low: -walk.limits.travel_max.0, high: way };
        walk.note(format!(
            "the slave follows the master at up to {} and down to a depth of {}",
            self.speed, self.depth_max
        ));
        // The move under way is braked first.
        let braking = self.speed.0 / walk.rig.acceleration.0;
        DurationEstimate(duration, duration + braking + SETTLE_SECS, false)
    }

    fn judge(&self, done: &mut StepResult<'_>) {
        // The move under way is braked first.
        done.duration(self.duration, self.speed.0 / done.rig.acceleration.0);
    }
}

/// Time without a lead after which the slave stops: a hand that is followed is never still for so long to what leads,
/// which says where it is all the time.
const SILENT_MAX: Seconds = Seconds(0.5);

/// Time without a lead after which the step ends, so that the plan leaves the tissue: long enough for a program that
/// hangs to come back.
const LOST: Seconds = Seconds(5.0);

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FollowRun {
    speed: MmPerS,
    until_tick: u64,
    /// The surface, and the furthest pulse that is neither deeper than the plan allows nor beyond the travel.
    surface: Position,
    deepest_pulses: i64,
    /// Where it is to be; none before the first lead.
    wanted: Option<Depth>,
    led_at: Nanos,
    is_lost: bool,
    is_stopping: bool,
    /// The newest target of a rig that takes them on the way, since the last stop.
    tracked: Option<i64>,
    is_refusal_reported: bool,
}

impl Executable for Follow {
    type Run = FollowRun;

    fn begin(&self, cx: &mut Context<'_>) -> Result<FollowRun, String> {
        let contact = cx.contact()?;
        let deepest = self.depth_max.position_from(contact.position);
        let deepest = deepest.0.min(cx.limits().travel_max.0);
        Ok(FollowRun {
            speed: self.speed,
            until_tick: cx.tick_after(self.duration),
            surface: contact.position,
            // 1e-6 of a pulse forgives the rounding of what is a whole number of them.
            deepest_pulses: (deepest / cx.rig().mm_per_pulse + 1e-6).floor() as i64,
            wanted: None,
            led_at: cx.now,
            is_lost: false,
            is_stopping: false,
            tracked: None,
            is_refusal_reported: false,
        })
    }
}

impl FollowRun {
    /// The pulse to go to: where it is led, as far as the plan and the travel allow.
    fn target(&self, cx: &Context<'_>) -> Option<i64> {
        let wanted = self.wanted?.position_from(self.surface);
        let wanted = pulses_from_position(wanted, cx.rig().mm_per_pulse);
        // Home is the end of the way out.
        Some(wanted.clamp(0, self.deepest_pulses.max(0)))
    }

    fn is_at_rest(&self, cx: &mut Context<'_>) -> Result<bool, String> {
        // A controller may show motion for as long as it takes targets, so only a stop has a time limit there.
        if self.tracked.is_some() && cx.status().has(AxisStatus::MOVING) {
            return Ok(false);
        }
        cx.at_rest()
    }

    fn stop(&mut self, cx: &mut Context<'_>) {
        self.is_stopping = true;
        self.tracked = None;
        cx.stop_move();
    }

    /// Sends the newest target, where the one before was accepted.
    fn track(&mut self, cx: &mut Context<'_>) -> Result<(), String> {
        let Some(target) = self.target(cx) else {
            return Ok(());
        };
        let before = self.tracked.unwrap_or(cx.pulses());
        if target != before && cx.is_acknowledged() {
            cx.track_to_pulses(target, self.speed)?;
            self.tracked = Some(target);
        }
        Ok(())
    }
}

impl RunningStep for FollowRun {
    fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Result<Progress, String> {
        let at_rest = self.is_at_rest(cx)?;
        let silent = cx.now.since(self.led_at).seconds();
        let is_lost = silent > SILENT_MAX;
        if is_lost && !self.is_lost {
            self.wanted = None;
            cx.record(Record::LeadLost { silent });
        }
        self.is_lost = is_lost;
        let is_over = reading.tick >= self.until_tick || silent > LOST;
        // At rest too a controller that takes targets is stopped, so that it takes no more.
        if (is_lost || is_over) && !self.is_stopping && (!at_rest || self.tracked.is_some()) {
            self.stop(cx);
            return Ok(Progress::Continue);
        }
        // Behind a stop that waits for its answer a controller could drop the next target.
        let is_stopped = at_rest && (!cx.rig().takes_targets || cx.is_acknowledged());
        if self.is_stopping && !is_stopped {
            return Ok(Progress::Continue);
        }
        self.is_stopping = false;
        if is_over && at_rest {
            return Ok(Progress::Done);
        }
        if cx.rig().takes_targets {
            self.track(cx)?;
        } else if at_rest
            && let Some(target) = self.target(cx)
            && target != cx.pulses()
        {
            cx.move_to_pulses(target, self.speed)?;
        }
        Ok(Progress::Continue)
    }

    fn on_event(&mut self, cx: &mut Context<'_>, event: &StepEvent) -> Option<Progress> {
        let StepEvent::Lead(depth) = event else {
            return None;
        };
        match depth.filter(|depth| depth.0.is_finite()) {
            Some(depth) => {
                self.wanted = Some(depth);
                self.led_at = cx.now;
            }
            // It is as good as none: should no other come, the slave stops.
            None if self.is_refusal_reported => {}
            None => {
                self.is_refusal_reported = true;
                cx.refuse("the master sent no valid position; check the master");
            }
        }
        Some(Progress::Continue)
    }
}
