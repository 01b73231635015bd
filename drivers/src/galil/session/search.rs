//! Questions and answers that do not belong together any more: the line is left to fall silent, then a number that must
//! come back shows where answers are.

use super::{Asked, Halting, Outgoing, Session};
use crate::galil::protocol::Reply;
use palpate_model::Nanos;
use palpate_model::rig::RigCommand;

/// The line is quiet after so long without a byte.
pub const QUIET: Nanos = Nanos::from_millis(25);
/// So long a marker may take to come back; a controller needs a third of a second to start again.
const MARKER_MAX: Nanos = Nanos::from_millis(350);
/// Markers sent before the link counts as dead: on a line that spoils one byte in fifty all come back spoilt once in
/// four thousand times.
pub const MARKERS_MAX: u32 = 6;
/// The order of questions and answers is lost and looked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    pub last_byte: Nanos,
    pub marker_at: Option<Nanos>,
    pub markers: u32,
}

impl Search {
    /// Whether enough was asked.
    pub fn is_over(&self, now: Nanos) -> bool {
        let is_late = |at: Nanos| now.since(at) >= MARKER_MAX;
        self.markers >= MARKERS_MAX && self.marker_at.is_some_and(is_late)
    }
}

impl Session {
    /// Answers and questions do not belong together any more: bytes were lost, doubled or spoilt.
    pub(super) fn lose_order(&mut self, now: Nanos) {
        self.stats.resynchronised += 1;
        self.parser.clear();
        for (asked, _) in std::mem::take(&mut self.expected) {
            if let Asked::Stop(halting) = asked {
                self.confirm_later(halting);
            }
        }
        self.lines.clear();
        self.fetches.clear();
        self.beginning = None;
        self.is_motion_begun = false;
        if let Some((number, _)) = self.order.take() {
            // It may or may not be under way: to be safe, it is not.
            self.refuse(
                now,
                number,
                "its answer was garbled, so the axis was stopped; check the cable",
            );
            self.urge(RigCommand::Stop, Asked::Stop(Halting::QUIET));
        }
        if let Some(recording) = &mut self.recording {
            recording.give_up_fetch();
        }
        if self.sine.take().is_some() {
            self.end_sine(now, "answers were garbled; check the cable");
        }
        self.search = Some(Search { last_byte: now, marker_at: None, markers: 0 });
    }

    pub(super) fn on_reply_while_searching(&mut self, now: Nanos, reply: &Reply) {
        let Some((Asked::Marker(number), _)) = self.expected.front() else {
            return;
        };
        if reply.numbers() == Some(vec![f64::from(*number)]) {
            self.expected.clear();
            self.search = None;
            self.answered_at = now;
            for halting in std::mem::take(&mut self.unconfirmed) {
                self.urge(halting.command, Asked::Stop(halting));
            }
        }
    }

    /// Keeps a stop whose answer nobody sees, until answers belong to questions again. Of those that nobody waits for
    /// one is enough.
    pub(super) fn confirm_later(&mut self, halting: Halting) {
        let is_known = |one: &Halting| halting.number.is_none() && one.number.is_none();
        if !self.unconfirmed.iter().any(is_known) {
            self.unconfirmed.push(halting);
        }
    }

    /// The next marker, once the line has become quiet.
    pub(super) fn search_line(&mut self, now: Nanos) -> Option<Outgoing> {
        let search = self.search.as_mut()?;
        let is_due = match search.marker_at {
            None => now.since(search.last_byte) >= QUIET,
            Some(at) => now.since(at) >= MARKER_MAX,
        };
        if !is_due || search.markers >= MARKERS_MAX {
            return None;
        }
        search.markers += 1;
        search.marker_at = Some(now);
        self.parser.clear();
        self.expected.clear();
        // A number that no sample begins with, and another one each time.
        let number = 27_180 + search.markers;
        Some(Outgoing { text: format!("MG {number}\r"), asked: vec![Asked::Marker(number)] })
    }
}
