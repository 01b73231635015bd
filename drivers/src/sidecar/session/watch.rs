//! What does not come: answers, samples, motions, and the rig's owner.

use super::answers::GARBLED_MAX;
use super::{PendingAnswer, Request, SidecarSession, stop_message};
use crate::sidecar::FLOODED;
use crate::wire::ATTENDED_MAX;
use palpate_model::Nanos;
use palpate_model::rig::RigCommand;

/// An answer is lost after so long: it is due within 100 ms, and computers and converters pause for as long again.
const ANSWER_MAX: Nanos = Nanos::from_millis(250);
const STOP_AGAIN: Nanos = Nanos::from_millis(100);
/// The link counts as dead after so long without what must come.
const DEAD: Nanos = Nanos::from_millis(1_000);
/// And after so many samples.
const DEAD_PERIODS: u64 = 10;
/// The axis is stopped after so many samples that did not come, and at least this time.
const SILENT_PERIODS: u64 = 5;
const SILENT_MIN: Nanos = Nanos::from_millis(250);
/// A motion that was acknowledged is seen after so long, and two samples.
const MOTION_MAX: Nanos = Nanos::from_millis(300);
/// This thread looks every half a millisecond. When it did not for so long, it was not the sidecar that was silent.
const PAUSE: Nanos = Nanos::from_millis(20);

impl SidecarSession {
    pub(super) fn watch(&mut self, now: Nanos) {
        let pause = now.since(std::mem::replace(&mut self.looked_at, now));
        if pause > PAUSE {
            self.excuse(pause);
        }
        if pause > ATTENDED_MAX {
            // A motion from before the pause may no longer be wanted.
            let why = "the computer stood still for half a second, so the motion was not started";
            self.refuse_waiting(now, why, RigCommand::is_motion);
        }
        self.watch_answers(now);
        let periods = Nanos(SILENT_PERIODS * self.facts.period.0);
        if self.for_sample.time(now) > periods.max(SILENT_MIN)
            && !std::mem::replace(&mut self.is_silent, true)
        {
            self.fail(now, "the sidecar sends no samples; check its program and cable");
        }
        let seen_by = MOTION_MAX + Nanos(2 * self.facts.period.0);
        if self.awaited.is_some_and(|awaited| awaited.since.time(now) > seen_by) {
            self.fail(
                now,
                "the sidecar has acknowledged a motion but does not move; check its drive",
            );
        }
        self.watch_attendance(now);
    }

    fn excuse(&mut self, pause: Nanos) {
        for waiting in [&mut self.for_sample, &mut self.for_answer] {
            waiting.excuse(pause);
        }
        for pending in &mut self.pending {
            pending.sent.excuse(pause);
        }
        if let Some(awaited) = &mut self.awaited {
            awaited.since.excuse(pause);
        }
        if let Some(accepted) = &mut self.stop_accepted {
            accepted.excuse(pause);
        }
    }

    fn watch_answers(&mut self, now: Nanos) {
        let is_late = |pending: &PendingAnswer| {
            !pending.request.is_stop() && pending.sent.time(now) > ANSWER_MAX
        };
        let is_moving = self.is_moving();
        let late: Vec<PendingAnswer> = self.pending.extract_if(.., |one| is_late(one)).collect();
        for pending in late {
            self.stats.resynchronised += 1;
            match pending.request {
                Request::Command(_) => {
                    let why = "the sidecar has not answered a command within 0.25 s, so the axis is stopped; check its program and cable";
                    self.stop_axis(now, why);
                    self.refuse(now, pending.owed, why);
                }
                Request::Start | Request::Beat if is_moving => {
                    self.fail(now, "the sidecar does not answer, so the axis is stopped; check its program and cable");
                }
                Request::Start | Request::Beat => {}
            }
        }
    }

    fn watch_attendance(&mut self, now: Nanos) {
        if now.since(self.attended_at) <= ATTENDED_MAX {
            return;
        }
        let has_motion = self.orders.iter().any(|(_, command)| command.is_motion());
        if has_motion || self.is_moving() && !self.is_stop_under_way() {
            self.attended_at = now;
            self.fail(now, "no samples were taken for half a second, so the axis is stopped");
        }
    }

    /// A stop that is not answered is written again.
    pub(super) fn repeat_stop(&mut self, now: Nanos) -> Option<Vec<u8>> {
        let is_due = |pending: &&mut PendingAnswer| {
            pending.request.is_stop() && now.since(pending.repeated) >= STOP_AGAIN
        };
        let pending = self.pending.iter_mut().find(is_due)?;
        let Request::Command(command) = pending.request else {
            return None;
        };
        self.number += 1;
        self.budget.note_written();
        pending.numbers.push(self.number);
        pending.repeated = now;
        Some(stop_message(command).line(self.number, self.facts.has_checksum))
    }

    pub(super) fn why_dead(&self, now: Nanos) -> Option<String> {
        // What stops the axis is written first.
        if !self.stops.is_empty() {
            return None;
        }
        let far = self.facts.worst_case_mm;
        let by_itself = format!("if the axis moves, it stops by itself within {far:.1} mm");
        let is_unstopped = |one: &PendingAnswer| one.request.is_stop() && one.sent.time(now) > DEAD;
        let silence = DEAD.max(Nanos(DEAD_PERIODS * self.facts.period.0));
        if self.pending.iter().any(is_unstopped) {
            return Some("the sidecar has not accepted a stop for 1 s, so the axis may still move; use the emergency stop".into());
        }
        if self.stop_accepted.is_some_and(|accepted| accepted.time(now) > silence) {
            // Without beats its own watchdog brakes.
            return Some(format!(
                "the sidecar has accepted a stop, but the axis moves on; {by_itself}; use the emergency stop"
            ));
        }
        if self.is_flooded {
            return Some(format!("{FLOODED}; {by_itself}"));
        }
        if self.garbled_in_row >= GARBLED_MAX {
            return Some(format!("the sidecar sends nothing that means anything; {by_itself}"));
        }
        if self.for_sample.time(now) > silence {
            return Some(format!(
                "the sidecar sends no samples; {by_itself}; check its program and cable"
            ));
        }
        let is_mute = self.for_answer.time(now) > DEAD;
        is_mute.then(|| {
            format!("the sidecar does not answer; {by_itself}; check its program and cable")
        })
    }
}
