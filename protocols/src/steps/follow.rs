//! A slave that goes where it is led. Where the controller takes a new target only at rest, the slave makes one move after
//! another and is behind its lead by about the duration of a move. Where it takes targets on the way, the slave gets every
//! one. Going at `v` to where it can stop at `a`, it would be `v^2 / (2 a)` behind, and so it is sent ahead by as much.
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

/// Time over which the speed of a lead is averaged: some leads, 5 ms apart, and short beside the motion of a hand.
const LEAD_SPEED_OVER: Seconds = Seconds(0.02);

/// Longest time between two leads of one motion: ten of them.
const LEAD_GAP: Seconds = Seconds(0.05);

/// Time from a lead to its effect: half the 5 ms between two leads, and a sample or two of the controller.
const LEAD_ANSWER: Seconds = Seconds(0.004);

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
    /// Speed of the lead towards the tissue, at most that of the slave.
    lead_speed: MmPerS,
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
            lead_speed: MmPerS(0.0),
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

    /// The pulse to go to on the way: ahead of the lead by the way of the brake and that of the lead until it has effect.
    fn target_ahead(&self, cx: &Context<'_>) -> Option<i64> {
        let (wanted, speed) = (self.wanted?, self.lead_speed.0);
        let brake = speed * speed.abs() / (2.0 * cx.rig().acceleration.0);
        let ahead = Depth(wanted.0 + brake + speed * LEAD_ANSWER.0);
        let pulses = ahead.position_from(self.surface).0 / cx.rig().mm_per_pulse;
        // A counter shows the last whole pulse below the place, so that it follows within one where the target is above.
        // 1e-6 of a pulse forgives the rounding of what is a whole number of them.
        Some(((pulses - 1e-6).ceil() as i64).clamp(0, self.deepest_pulses.max(0)))
    }

    /// Takes a lead and its speed.
    fn lead(&mut self, depth: Depth, now: Nanos) {
        let passed = now.since(self.led_at).seconds();
        let before = self.wanted.replace(depth);
        self.led_at = now;
        self.lead_speed = match before {
            Some(before) if passed > Seconds(0.0) && passed <= LEAD_GAP => {
                let way = ((depth.0 - before.0) / passed.0).clamp(-self.speed.0, self.speed.0);
                let share = passed.0 / (passed.0 + LEAD_SPEED_OVER.0);
                MmPerS(self.lead_speed.0 + share * (way - self.lead_speed.0))
            }
            _ => MmPerS(0.0),
        };
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
        let Some(target) = self.target_ahead(cx) else {
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
            Some(depth) => self.lead(depth, cx.now),
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
