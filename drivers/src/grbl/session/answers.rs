//! Lines of the board and what follows from them.

use super::GrblSession;
use crate::grbl::error::GrblCode;
use crate::grbl::protocol::{CYCLE_START, GrblState, GrblStatus};
use crate::grbl::times::STOP_MAX;
use crate::rig::RigEventBody;
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Fault, RigCommand};

const LOCKED: &str = "the board is locked; check the axis, then open the rig again";

impl GrblSession {
    pub(super) fn on_ok(&mut self, now: Nanos) {
        let Some(written) = self.open.take() else {
            // An answer that came late, after its line was given up.
            self.stats.resynchronised += 1;
            return;
        };
        self.stats.push(now.since(written));
        let sign = self.settings.sign() as f64;
        let Some(motion) = self.motion.as_mut() else {
            return;
        };
        if motion.started.is_none() && motion.cancelled.is_none() {
            // Grbl begins as soon as it has planned the first jog, and says `ok` then.
            let started = Nanos(now.0.saturating_sub(self.facts.round_trip.0 / 2)).max(written);
            motion.started = Some(started);
            let from = sign * motion.from as f64;
            let pulses_per_mm = sign * motion.direction() / self.settings.mm_per_pulse;
            let (profile, owed, wanted) = (motion.profile, motion.owed.take(), motion.wanted);
            self.track().begin_motion(started, from, profile, pulses_per_mm);
            if let Some(number) = owed {
                self.acknowledge(now, number, RigCommand::MoveTo(wanted));
            }
        }
    }

    pub(super) fn on_refusal(&mut self, now: Nanos, refusal: &GrblCode) {
        if self.open.take().is_none() {
            self.stats.resynchronised += 1;
            return;
        }
        let Some(motion) = self.motion.as_mut() else {
            return;
        };
        if let Some(number) = motion.owed.take() {
            self.motion = None;
            self.refuse(now, number, refusal.to_string());
        } else if motion.cancelled.is_none() {
            let why =
                format!("the board refused a part of a motion, so the axis is stopped: {refusal}");
            self.end(now, &why);
        }
    }

    pub(super) fn on_alarm(&mut self, now: Nanos, alarm: &GrblCode) {
        if self.reset_pending.is_some() {
            return;
        }
        self.state = GrblState::Alarm;
        self.lock(now, &alarm.to_string());
        self.fault(now, alarm.to_string());
    }

    pub(super) fn on_hello(&mut self, now: Nanos) {
        self.heard_at = now;
        self.queried_at = None;
        // Nothing is in motion after a reset.
        self.state = GrblState::Idle;
        if let Some(reset_pending) = self.reset_pending.take() {
            let here = self.track().at(now).pulses.round() as i64;
            self.track().begin_rest(now, here);
            for (number, command) in reset_pending.owed {
                self.acknowledge(now, number, command);
            }
        } else {
            self.lock(now, "the board was reset; open the rig again");
        }
        self.is_motor_on = false;
        self.report(now, RigEventBody::Fault(Fault::ControllerReset));
    }

    /// Machine position of the axis in steps of the board.
    fn steps_of(&self, status: &GrblStatus) -> Option<i64> {
        let mm = status.machine.as_ref()?.get(self.settings.index())?;
        Some((mm * self.facts.steps_per_mm).round() as i64)
    }

    pub(super) fn on_status(&mut self, now: Nanos, status: &GrblStatus) {
        self.heard_at = now;
        let queried_at = self.queried_at.take();
        if let Some(queried_at) = queried_at {
            self.stats.push(now.since(queried_at));
        }
        self.state = status.state;
        if self.reset_pending.is_some() {
            return;
        }
        let queried_at = queried_at.unwrap_or(now);
        // A stop is done when nothing moves, and no jog is on its way that would.
        let is_at_rest = !status.state.is_moving() && self.open.is_none();
        let braking = self.motion.as_ref().map_or(Nanos::ZERO, |motion| {
            Nanos((motion.wanted.speed.0 / motion.wanted.acceleration.0 * 1e9) as u64)
        });
        let is_jog = status.state == GrblState::Jog;
        // An axis that brakes slowly is braking still.
        let is_slow = |at| is_jog && now.since(at) > STOP_MAX && now.since(at) < braking;
        let (confirmed, waiting): (Vec<_>, Vec<_>) = std::mem::take(&mut self.stops)
            .into_iter()
            .partition(|(_, _, at)| *at <= queried_at && (is_at_rest || is_slow(*at)));
        self.stops = waiting;
        for (number, command, _) in confirmed {
            self.acknowledge(now, number, command);
        }
        let Some(steps) = self.steps_of(status) else {
            return self.lock_and_report(now, "the board reports no machine position; set $10=1");
        };
        self.on_pins(now, status, steps);
        match status.state {
            GrblState::Idle => self.on_idle(now, queried_at, steps),
            GrblState::Jog => self.on_jog(now, queried_at, steps),
            GrblState::Alarm if self.locked.is_some() => {}
            GrblState::Alarm => self.lock_and_report(now, LOCKED),
            other => {
                let why = format!(
                    "the board is in state {other:?}, which palpate never commands; reset the board and open the rig again"
                );
                self.lock_and_report(now, &why);
            }
        }
    }

    /// Takes the pins, and stops at those at which Grbl does not stop.
    fn on_pins(&mut self, now: Nanos, status: &GrblStatus, steps: i64) {
        let is_known = self.track().at(now).status;
        let pulses = self.pulses(steps);
        let mut inputs = self.ends.inputs(&self.settings, status, is_known, pulses);
        let going = self.motion.as_ref().filter(|it| it.cancelled.is_none());
        let is_far = inputs.has(AxisStatus::FORWARD_LIMIT);
        let is_closing = is_far && !is_known.has(AxisStatus::FORWARD_LIMIT);
        match going.map(|motion| self.is_outwards(motion)) {
            // Grbl ends the jogs that it has and begins the next (doc/markdown/jogging.md).
            Some(_) if status.has_pin('H') => self.end(
                now,
                "the hold button of the board is pressed, so the axis is stopped",
            ),
            Some(true) if is_far => {
                // For a motion under way the samples show it.
                if let Some(number) = self.take_unacknowledged() {
                    let why = "the far limit switch is closed; move the axis the other way";
                    self.refuse(now, number, why);
                }
                self.cancel(now);
            }
            // Whichever end it is.
            Some(false) if is_closing => self.end(
                now,
                "a limit switch closed unexpectedly during homing, so the axis is stopped; check the switch",
            ),
            _ => {}
        }
        if self.is_motor_on {
            inputs = inputs | AxisStatus::MOTOR_ON;
        }
        self.track().set_inputs(now, inputs);
    }

    fn on_idle(&mut self, now: Nanos, queried_at: Nanos, steps: i64) {
        let Some(motion) = &self.motion else {
            if steps != self.steps {
                let by = self.pulses(steps - self.steps);
                self.steps = steps;
                let here = self.pulses(steps);
                self.track().begin_rest(now, here);
                self.fault(
                    now,
                    format!(
                        "the axis has moved by {by} pulses without a command; home the axis again"
                    ),
                );
            }
            return;
        };
        if self.open.is_some() {
            return;
        }
        match (motion.cancelled, motion.started) {
            (Some(cancelled), _) if queried_at >= cancelled => {
                self.urgent.push_back(vec![CYCLE_START]);
                if motion.is_doubtful
                    && let Some(motion) = &mut self.motion
                {
                    // A jog that was not read yet begins now; it is cancelled until a report after this shows rest.
                    motion.is_doubtful = false;
                    motion.cancelled = Some(now);
                    return;
                }
            }
            (None, Some(started)) if queried_at > started + Nanos::from_millis(20) => {
                if !motion.is_all_sent() {
                    self.fault(now, "the link is too slow to keep the axis moving, so the axis has stopped; lower the speed or use a faster link");
                } else if steps != motion.to {
                    let (there, wanted) = (self.pulses(steps), self.pulses(motion.to));
                    self.fault(now, format!("the board reports a stop at pulse {there}, but the target is pulse {wanted}; home the axis again"));
                }
            }
            _ => return,
        }
        self.steps = steps;
        self.motion = None;
        let here = self.pulses(steps);
        self.track().begin_rest(now, here);
    }

    fn on_jog(&mut self, now: Nanos, queried_at: Nanos, steps: i64) {
        let Some(motion) = &self.motion else {
            if self.open.is_none() {
                self.cancel(now);
            }
            return;
        };
        if motion.cancelled.is_some() || motion.started.is_none() {
            return;
        }
        // The report is of a time between its question and now.
        let early = self.track().at(queried_at).pulses;
        let late = self.track().at(now).pulses;
        let here = self.pulses(steps) as f64;
        // Start and segments are known to some hundredths of a second; a garbled target is further off.
        let slack = (0.15 * motion.wanted.speed.0 + 0.1) / self.settings.mm_per_pulse;
        if here < early.min(late) - slack || here > early.max(late) + slack {
            self.fault(now, format!("the board reports pulse {here:.0} instead of the commanded pulse {late:.0}, so the axis is stopped; check the cable and home the axis"));
            return self.cancel(now);
        }
        let sampled = queried_at + Nanos(self.facts.round_trip.0 / 2);
        if let Some(ahead) = motion.lead(sampled, steps, self.settings.mm_per_pulse) {
            let step = self.settings.mm_per_pulse / motion.wanted.speed.0;
            self.feed_correction.update(queried_at, now, ahead.0, step);
        }
    }
}
