//! Answers: each belongs to the one open question.

use super::{GARBLED_MAX, Motion, QUIET, QUIET_LOST, StandQuestion, StandSession};
use crate::mark10::stand::protocol::{StandStatus, number};
use crate::text::ReceivedLine;
use palpate_model::Nanos;

impl StandSession {
    fn answered(&mut self, now: Nanos) {
        if let Some((_, sent)) = self.question.take() {
            self.stats.push(now.since(sent));
        }
        self.lost_answers = 0;
        if !self.stop_due {
            for command in std::mem::take(&mut self.unconfirmed) {
                self.acknowledge(now, command);
            }
        }
    }

    fn on_line(&mut self, now: Nanos, line: &str) {
        let Some((question, sent)) = self.question else {
            return;
        };
        match question {
            StandQuestion::Sample => {
                if let Some((force, travel)) = self.pair.take(line) {
                    self.answered(now);
                    // It was taken at a time between question and answer.
                    let at = Nanos(sent.0 + now.since(sent).0 / 2);
                    self.on_sample(now, at, force, travel);
                }
            }
            StandQuestion::Status => {
                if let Some(status) = StandStatus::parse(line) {
                    self.answered(now);
                    self.status = Some(status);
                }
            }
            StandQuestion::Value { what, per_unit, expected } => {
                if let Some(found) = number(line) {
                    self.answered(now);
                    let is_right = (found * per_unit).round() as i64 == expected;
                    self.check(now, is_right, line, what);
                }
            }
        }
    }

    /// Checks a value that was set and read back for a move.
    fn check(&mut self, now: Nanos, is_right: bool, line: &str, what: &str) {
        if !is_right && let Motion::Setting(..) = self.motion {
            self.motion = Motion::Rest;
            let line = line.trim();
            self.refuse(
                now,
                format!("the stand reports {line} as its {what}; check the range of the stand and that PC control is on"),
            );
        }
    }

    /// The answer did not come, or came and made no sense.
    pub(super) fn lose_answer(&mut self, now: Nanos, quiet: Nanos) {
        self.question = None;
        self.lost_answers += if quiet == QUIET_LOST { 2 } else { 1 };
        self.stats.resynchronised += 1;
        self.lines.clear();
        self.quiet_until = Some(now + quiet);
        self.quiet = quiet;
        if let Motion::Setting(..) = self.motion {
            self.motion = Motion::Rest;
            let why = "the stand's answer was lost or garbled, so the motion was not started; check the cable";
            self.refuse(now, why);
        }
        // It stops at its limit by itself; no reason to wait for that.
        self.stop_due |= self.is_going() && self.lost_answers >= GARBLED_MAX;
    }

    pub(super) fn on_taken(&mut self, now: Nanos, taken: ReceivedLine) {
        if self.question.is_none() {
            return;
        }
        self.lines_since += 1;
        if let ReceivedLine::Line(line) = taken {
            self.on_line(now, &line);
        }
        let lines = match self.question {
            Some((StandQuestion::Sample, _)) => 2,
            _ => 1,
        };
        if self.question.is_some() && self.lines_since >= lines {
            self.lose_answer(now, QUIET);
        }
    }
}
