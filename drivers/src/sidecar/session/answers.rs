//! What the sidecar says: answers to lines, restarts, faults.

use super::{AwaitedMotion, PendingAnswer, Request, SidecarSession};
use crate::rig::RigEventBody;
use crate::sidecar::protocol::{ReceivedItem, SidecarMessage};
use crate::wire::Waiting;
use palpate_model::Nanos;
use palpate_model::rig::{Fault, RigCommand};

/// So many garbled lines in a row stop the axis.
const GARBLED_STOP: u32 = 5;
/// So many end the link.
pub(super) const GARBLED_MAX: u32 = 50;

impl SidecarSession {
    pub(super) fn on_item(&mut self, now: Nanos, item: ReceivedItem) {
        let ReceivedItem::Message(message) = item else {
            return self.on_garbled(now);
        };
        match message {
            SidecarMessage::Sample(sample) => self.on_sample(now, &sample),
            SidecarMessage::Ok { number, .. } => self.on_ok(now, number),
            SidecarMessage::No { number: Some(number), why } => self.on_no(now, number, &why),
            // A line of ours was garbled on its way; its answer does not come in time.
            SidecarMessage::No { number: None, .. } => self.stats.resynchronised += 1,
            SidecarMessage::Fault(why) => self.fail(now, &format!("the sidecar reports: {why}")),
            SidecarMessage::Boot(_) | SidecarMessage::Description(_) => self.on_restart(now),
        }
    }

    pub(super) fn on_garbled(&mut self, now: Nanos) {
        self.stats.resynchronised += 1;
        self.garbled_in_row += 1;
        if self.garbled_in_row == GARBLED_STOP {
            self.fail(
                now,
                "the sidecar sends lines that mean nothing; check its program, cable and baud rate",
            );
        }
    }

    /// The sidecar has restarted, or its clock shows so: its counter may have begun anywhere.
    pub(super) fn on_restart(&mut self, now: Nanos) {
        let is_first = self.locked.is_none();
        self.lock(now, "the sidecar has restarted, so the position is lost; connect the rig again and home the axis");
        self.stop_axis(now, "the sidecar has restarted");
        if is_first {
            self.report(now, [RigEventBody::Fault(Fault::ControllerReset)]);
        }
    }

    fn take_pending(&mut self, number: u64) -> Option<PendingAnswer> {
        let index = self.pending.iter().position(|pending| pending.numbers.contains(&number))?;
        Some(self.pending.remove(index))
    }

    /// An answer that was waited for has come.
    fn note_answer(&mut self, now: Nanos) {
        self.for_answer = Waiting::new(now);
        self.garbled_in_row = 0;
    }

    fn on_ok(&mut self, now: Nanos, number: u64) {
        let Some(pending) = self.take_pending(number) else {
            return;
        };
        self.note_answer(now);
        // Of a stop that was repeated it is not known which line is answered.
        if pending.numbers.len() == 1 {
            self.stats.push(pending.sent.time(now));
        }
        let Request::Command(command) = pending.request else {
            return;
        };
        // A stop behind it may end it before a sample shows it.
        let (is_stopped, since) = (self.is_stop_under_way(), Waiting::new(now));
        self.stop_accepted = match command {
            stop if stop.is_stopping() => Some(since),
            motion if motion.is_motion() => None,
            _ => self.stop_accepted,
        };
        self.awaited = match command {
            motion if motion.is_motion() && is_stopped => None,
            RigCommand::MoveTo(to) => {
                Some(AwaitedMotion { since, end: Some(to.target_pulses + self.zero) })
            }
            RigCommand::Oscillate(_) => Some(AwaitedMotion { since, end: None }),
            _ => self.awaited,
        };
        if let Some(owed) = pending.owed {
            let answers = self.answers.acknowledge(owed, command);
            self.report(now, answers);
        }
    }

    fn on_no(&mut self, now: Nanos, number: u64, why: &str) {
        let is_stop = |pending: &PendingAnswer| {
            pending.request.is_stop() && pending.numbers.contains(&number)
        };
        if self.pending.iter().any(is_stop) {
            // It is repeated until it is accepted, or the link is given up.
            return;
        }
        let Some(pending) = self.take_pending(number) else {
            return;
        };
        self.note_answer(now);
        match pending.request {
            // Nothing but a device that does not know this host refuses these.
            Request::Start | Request::Beat => self.on_restart(now),
            Request::Command(_) => {
                self.refuse(now, pending.owed, &format!("the sidecar refuses: {why}"));
            }
        }
    }
}
