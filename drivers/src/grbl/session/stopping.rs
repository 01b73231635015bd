//! Stops, by command and by the session itself, and what becomes of the motion under way.

use super::{GrblSession, PendingReset};
use crate::grbl::protocol::{GrblState, JOG_CANCEL, RESET};
use crate::grbl::times::{CANCEL_AGAIN, OK_MAX, PAUSE, RESET_AGAIN, SEGMENTS};
use crate::wire::{ATTENDED_MAX, OVERTAKEN};
use palpate_model::Nanos;
use palpate_model::rig::RigCommand;

impl GrblSession {
    /// Refuses commands of a kind that wait, and the motion under way if it is not acknowledged yet.
    fn refuse_waiting(&mut self, now: Nanos, why: &str, is_refused: fn(&RigCommand) -> bool) {
        for (number, order) in std::mem::take(&mut self.orders) {
            if is_refused(&order) {
                self.refuse(now, number, why);
            } else {
                self.orders.push_back((number, order));
            }
        }
        if let Some(number) = self.take_unacknowledged() {
            self.refuse(now, number, why);
        }
    }

    /// The number of the motion under way if it is not acknowledged yet.
    pub(super) fn take_unacknowledged(&mut self) -> Option<u64> {
        self.motion.as_mut()?.owed.take()
    }

    /// Brakes whatever moves.
    pub(super) fn cancel(&mut self, now: Nanos) {
        self.urgent.push_back(vec![JOG_CANCEL]);
        if let Some(motion) = &mut self.motion {
            motion.cancelled.get_or_insert(now);
            motion.repeated = now;
            if motion.started.is_some() && !std::mem::replace(&mut motion.is_braking, true) {
                let from = now + Nanos(SEGMENTS.0 + self.facts.round_trip.0 / 2);
                self.track().begin_braking(from);
            }
        }
        // Its answer shows what has become of it.
        self.queried_at = None;
        self.polled = None;
    }

    /// Ends the motion under way, which may not have been acknowledged yet.
    pub(super) fn end(&mut self, now: Nanos, why: &str) {
        match self.take_unacknowledged() {
            Some(number) => self.refuse(now, number, why),
            None => self.fault(now, why),
        }
        self.cancel(now);
    }

    /// Something is wrong that the operator has to look at.
    pub(super) fn lock(&mut self, now: Nanos, why: &str) {
        if self.locked.is_none() {
            self.locked = Some(why.to_owned());
            self.refuse_waiting(now, why, |_| true);
        }
        self.open = None;
        let here = self.track().at(now).pulses.round() as i64;
        if self.motion.take().is_some() {
            self.track().begin_rest(now, here);
        }
        if self.state.is_moving() {
            // A status that shows it at rest answers them.
            return;
        }
        for (number, command, _) in std::mem::take(&mut self.stops) {
            self.acknowledge(now, number, command);
        }
    }

    pub(super) fn lock_and_report(&mut self, now: Nanos, why: &str) {
        if self.locked.is_none() {
            self.lock(now, why);
            self.fault(now, why);
        }
    }

    /// Jogs that the board has are done though no more come: what is known of the way.
    pub(super) fn settle_track(&mut self, now: Nanos) {
        let Some(motion) = self.motion.take() else {
            return;
        };
        let given = motion.given_profile(self.settings.mm_per_pulse);
        let sign = self.settings.sign() as f64;
        match (motion.started, self.open) {
            (Some(_), _) if !motion.is_braking => self.track().shorten_motion(given),
            (None, Some(written)) => {
                let pulses_per_mm = sign * motion.direction() / self.settings.mm_per_pulse;
                let from = sign * motion.from as f64;
                // It may have begun without an answer.
                self.track().begin_motion(written.min(now), from, given, pulses_per_mm);
            }
            _ => {}
        }
        self.track().finish_motion();
    }

    /// Resets the board, again and again until its welcome.
    fn reset(&mut self, now: Nanos, number: u64, command: RigCommand) {
        self.urgent.push_front(vec![RESET]);
        self.settle_track(now);
        self.open = None;
        self.reset_pending =
            Some(PendingReset { owed: vec![(number, command)], begun: now, written: now });
        self.locked = Some(
            "a reset has interrupted the motion, so the position is lost; open the rig again and home the axis"
                .into(),
        );
        self.refuse_waiting(now, OVERTAKEN, |_| true);
    }

    pub(super) fn stop(&mut self, now: Nanos, command: RigCommand) {
        let number = self.answers.owe();
        self.refuse_waiting(now, OVERTAKEN, RigCommand::is_motion);
        if let Some(reset_pending) = &mut self.reset_pending {
            reset_pending.owed.push((number, command));
            return;
        }
        let is_moving = self.motion.is_some() || self.open.is_some() || self.state.is_moving();
        // Cancelling a jog does not end other motions.
        let is_foreign = matches!(self.state, GrblState::Run | GrblState::Home);
        if is_foreign || command == RigCommand::Halt && is_moving {
            return self.reset(now, number, command);
        }
        self.cancel(now);
        if self.locked.is_some() && !self.state.is_moving() {
            // It stands, and after a limit switch it answers nothing but a reset.
            return self.acknowledge(now, number, command);
        }
        self.stops.push((number, command, now));
    }

    pub(super) fn watch(&mut self, now: Nanos) {
        let pause = now.since(std::mem::replace(&mut self.looked_at, now));
        if pause > PAUSE {
            self.heard_at = self.heard_at + pause;
        }
        if self.open.is_some_and(|at| now.since(at) > OK_MAX) {
            self.open = None;
            self.stats.resynchronised += 1;
            if let Some(motion) = &mut self.motion {
                motion.is_doubtful = true;
                if motion.owed.is_some() || motion.cancelled.is_none() {
                    self.end(
                        now,
                        "an answer of the board was lost, so the axis is stopped; check the cable",
                    );
                }
            }
        }
        if let Some(reset_pending) = &mut self.reset_pending
            && now.since(reset_pending.written) >= RESET_AGAIN
        {
            reset_pending.written = now;
            self.urgent.push_front(vec![RESET]);
        }
        let is_wanted = std::mem::take(&mut self.track().is_stop_wanted);
        let is_unattended = now.since(self.attended_at) > ATTENDED_MAX;
        if is_wanted {
            let why = "the load cell has failed, so the motion was not started";
            self.refuse_waiting(now, why, RigCommand::is_motion);
        } else if is_unattended {
            let why = "no samples were taken for half a second, so the motion was not started";
            self.refuse_waiting(now, why, RigCommand::is_motion);
        }
        let Some(motion) = &mut self.motion else {
            return;
        };
        match motion.cancelled {
            Some(_) if now.since(motion.repeated) >= CANCEL_AGAIN => {
                motion.repeated = now;
                self.urgent.push_back(vec![JOG_CANCEL]);
            }
            Some(_) => {}
            None if is_wanted => self.cancel(now),
            None if is_unattended => {
                self.end(now, "no samples were taken for half a second, so the axis is stopped");
            }
            None => {}
        }
    }
}
