//! Questions and answers that do not belong together any more: the line is left to fall silent, then a number that must
//! come back shows where answers are.

use super::{ExpectedReply, GalilSession, Outgoing, PendingStop};
use crate::galil::protocol::GalilReply;
use palpate_model::Nanos;
use palpate_model::rig::RigCommand;

/// The line is quiet after so long without a byte.
pub const QUIET: Nanos = Nanos::from_millis(25);
/// Longest time for a marker to come back; a controller needs a third of a second to restart.
const MARKER_MAX: Nanos = Nanos::from_millis(350);
/// Markers sent before the link counts as dead: on a line that spoils one byte in fifty all come back spoilt once in
/// four thousand times.
pub const MARKERS_MAX: u32 = 6;
/// The order of questions and answers is lost and looked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resynchronisation {
    pub last_byte: Nanos,
    pub marker_at: Option<Nanos>,
    pub markers: u32,
}

impl Resynchronisation {
    pub fn is_over(&self, now: Nanos) -> bool {
        let is_late = |at: Nanos| now.since(at) >= MARKER_MAX;
        self.markers >= MARKERS_MAX && self.marker_at.is_some_and(is_late)
    }
}

impl GalilSession {
    /// Answers and questions do not belong together any more: bytes were lost, doubled or spoilt.
    pub(super) fn resynchronise(&mut self, now: Nanos) {
        self.stats.resynchronised += 1;
        self.parser.clear();
        for (expects, _) in std::mem::take(&mut self.expected) {
            if let ExpectedReply::Stop(stop) = expects {
                self.confirm_later(stop);
            }
        }
        self.lines.clear();
        self.fetches.clear();
        self.beginning = None;
        self.is_motion_begun = false;
        if let Some((number, _)) = self.order.take() {
            // It may or may not be under way: to be safe, it is not.
            let why =
                "the controller's answer was garbled, so the axis was stopped; check the cable";
            self.refuse(now, number, why);
            self.send_urgent(RigCommand::Stop, ExpectedReply::Stop(PendingStop::QUIET));
        }
        if let Some(recording) = &mut self.recording {
            recording.abandon_fetch();
        }
        if self.sine.take().is_some() {
            self.end_sine(now, "the controller's answers were garbled; check the cable");
        }
        self.resync = Some(Resynchronisation { last_byte: now, marker_at: None, markers: 0 });
    }

    pub(super) fn on_reply_while_resynchronising(&mut self, now: Nanos, reply: &GalilReply) {
        let Some((ExpectedReply::Marker(number), _)) = self.expected.front() else {
            return;
        };
        if reply.numbers() == Some(vec![f64::from(*number)]) {
            self.expected.clear();
            self.resync = None;
            self.answered_at = now;
            for stop in std::mem::take(&mut self.unconfirmed) {
                self.send_urgent(stop.command, ExpectedReply::Stop(stop));
            }
        }
    }

    /// Keeps a stop whose answer cannot be recognised until answers belong to questions again. Of stops without a
    /// command one is enough.
    pub(super) fn confirm_later(&mut self, stop: PendingStop) {
        let is_known = |one: &PendingStop| stop.number.is_none() && one.number.is_none();
        if !self.unconfirmed.iter().any(is_known) {
            self.unconfirmed.push(stop);
        }
    }

    /// The next marker, once the line has become quiet.
    pub(super) fn next_marker(&mut self, now: Nanos) -> Option<Outgoing> {
        let resync = self.resync.as_mut()?;
        let is_due = match resync.marker_at {
            None => now.since(resync.last_byte) >= QUIET,
            Some(at) => now.since(at) >= MARKER_MAX,
        };
        if !is_due || resync.markers >= MARKERS_MAX {
            return None;
        }
        resync.markers += 1;
        resync.marker_at = Some(now);
        self.parser.clear();
        self.expected.clear();
        // A number that no sample begins with, and another one each time.
        let number = 27_180 + resync.markers;
        Some(Outgoing::one(&format!("MG {number}"), ExpectedReply::Marker(number)))
    }
}
