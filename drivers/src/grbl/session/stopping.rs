//! Stops, those that nobody asked for among them, and what becomes of what was under way.

use super::{OVERTAKEN, PendingReset, Session};
use crate::grbl::protocol::{GrblState, JOG_CANCEL, RESET};
use crate::grbl::times::{ATTENDED_MAX, CANCEL_AGAIN, OK_MAX, PAUSE, RESET_AGAIN, SEGMENTS};
use palpate_model::Nanos;
use palpate_model::rig::RigCommand;

impl Session {
    fn drop_orders(&mut self, now: Nanos, why: &str) {
        let waiting: Vec<u64> = self.orders.drain(..).map(|(number, _)| number).collect();
        for number in waiting {
            self.refuse(now, number, why);
        }
        if let Some(number) = self.motion.as_mut().and_then(|motion| motion.owed.take()) {
            self.refuse(now, number, why);
        }
    }

    pub(super) fn drop_motions(&mut self, now: Nanos, why: &str) {
        for (number, order) in std::mem::take(&mut self.orders) {
            if matches!(order, RigCommand::MoveTo(_) | RigCommand::Oscillate(_)) {
                self.refuse(now, number, why);
            } else {
                self.orders.push_back((number, order));
            }
        }
        if let Some(number) = self.motion.as_mut().and_then(|motion| motion.owed.take()) {
            self.refuse(now, number, why);
        }
    }

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

    /// Ends the motion under way, which may be one that nobody was told of yet.
    pub(super) fn end(&mut self, now: Nanos, why: &str) {
        match self.motion.as_mut().and_then(|motion| motion.owed.take()) {
            Some(number) => self.refuse(now, number, why),
            None => self.fault(now, why),
        }
        self.cancel(now);
    }

    /// Something is wrong that the operator has to look at.
    pub(super) fn lock(&mut self, now: Nanos, why: &str) {
        if self.locked.is_none() {
            self.locked = Some(why.to_owned());
            self.drop_orders(now, why);
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
        let given = motion.given(self.settings.mm_per_pulse);
        let sign = self.settings.sign() as f64;
        match (motion.started, self.open) {
            (Some(_), _) if !motion.is_braking => self.track().shorten_motion(given),
            (None, Some(written)) => {
                let pulses_per_mm = sign * motion.side() / self.settings.mm_per_pulse;
                let from = sign * motion.from as f64;
                // It may have begun; nobody has said so.
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
            "it was cut short by a reset and its position is lost; open the rig again and home it"
                .into(),
        );
        self.drop_orders(now, OVERTAKEN);
    }

    pub(super) fn stop(&mut self, now: Nanos, command: RigCommand) {
        let number = self.answers.owe();
        self.drop_motions(now, OVERTAKEN);
        if let Some(reset_pending) = &mut self.reset_pending {
            reset_pending.owed.push((number, command));
            return;
        }
        let is_moving = self.motion.is_some() || self.open.is_some() || self.state.is_moving();
        // What is no jog is not ended by the cancel of a jog.
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
            }
            if let Some(number) = self.motion.as_mut().and_then(|motion| motion.owed.take()) {
                self.refuse(
                    now,
                    number,
                    "its answer was lost, so the axis was stopped; check the cable",
                );
                self.cancel(now);
            } else if self.motion.as_ref().is_some_and(|motion| motion.cancelled.is_none()) {
                self.fault(
                    now,
                    "an answer was lost in a motion, so the axis is stopped; check the cable",
                );
                self.cancel(now);
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
            self.drop_motions(now, "the load cell has failed, so it was not begun");
        } else if is_unattended {
            let why = "nobody took samples for half a second, so it was not begun";
            self.drop_motions(now, why);
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
                self.end(now, "nobody took samples for half a second, so the axis is stopped");
            }
            None => {}
        }
    }
}
