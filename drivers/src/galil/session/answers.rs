//! Answers: each belongs to the oldest question without one.

use super::Outgoing;
use super::{ExpectedReply, GalilSession, PendingStop, RESET};
use crate::galil::clock_alignment::ClockAlignment;
use crate::galil::order::OrderStep;
use crate::galil::protocol::{GalilReply, parse_error};
use crate::galil::recording::{RecordingOutput, RecordingStatus};
use crate::galil::sampling::{SampleOutcome, Sampler};
use crate::rig::RigEventBody;
use palpate_model::Nanos;
use palpate_model::rig::{Fault, RigCommand};

/// After so many `?` to a stop, `AB 1` is sent in its place; after one more it counts as refused.
const REFUSALS_MAX: u32 = 3;

impl GalilSession {
    pub(super) fn on_reply(&mut self, now: Nanos, reply: &GalilReply) {
        if self.resync.is_some() {
            return self.on_reply_while_resynchronising(now, reply);
        }
        let Some((expects, sent)) = self.expected.pop_front() else {
            return self.resynchronise(now);
        };
        self.answered_at = now;
        match expects {
            ExpectedReply::Sample => self.on_answer(now, sent, reply, None),
            ExpectedReply::Marked(is_begun) => self.on_answer(now, sent, reply, Some(is_begun)),
            ExpectedReply::Elements => self.on_elements(now, reply),
            ExpectedReply::Segment => {
                if !reply.is_accepted && self.sine.take().is_some() {
                    self.end_sine(now, "the controller refuses further segments of the sine");
                }
            }
            ExpectedReply::Renewal => {
                // A refusal means that the program is gone, as after a reset, which the clock shows.
                if !reply.bytes.is_empty() {
                    self.resynchronise(now);
                }
            }
            ExpectedReply::Part => {
                let settings = self.settings.clone();
                // Answers to an order that a stop has ended are dropped.
                if let Some((_, order)) = &mut self.order {
                    let next = order.take(reply, &settings);
                    self.apply_step(now, next);
                }
            }
            ExpectedReply::Stop(stop) if reply.is_accepted && reply.bytes.is_empty() => {
                if let Some(number) = stop.number {
                    self.acknowledge(now, number, stop.command);
                }
            }
            ExpectedReply::Stop(stop) if reply.is_accepted => {
                self.confirm_later(stop);
                self.resynchronise(now);
            }
            ExpectedReply::Stop(stop) => self.on_refused_stop(now, stop),
            ExpectedReply::RefusalReason => {
                let why = parse_error(reply).map(|err| err.to_string());
                let why = why.unwrap_or_else(|| "the controller gives no reason".into());
                self.apply_step(now, OrderStep::Refused(why));
            }
            ExpectedReply::Marker(_) => {}
        }
    }

    /// A `?` to a stop: it was garbled on the way there, or its `:` on the way back. It is sent again at once, at the
    /// third `?` as the stop that asks for least, and only then given up.
    fn on_refused_stop(&mut self, now: Nanos, stop: PendingStop) {
        let refusals = stop.refusals + 1;
        let again = ExpectedReply::Stop(PendingStop { refusals, ..stop });
        match refusals {
            0..REFUSALS_MAX => self.send_urgent(stop.command, again),
            REFUSALS_MAX => self.send_urgent(RigCommand::Halt, again),
            _ => {
                let detail = format!("the controller refuses {:?}", stop.command);
                match stop.number {
                    Some(number) => self.refuse(now, number, detail),
                    None => self.report_in_order(now, RigEventBody::refusal(detail)),
                }
            }
        }
    }

    /// The answer to the question, polled or while recording.
    pub(super) fn on_answer(
        &mut self,
        now: Nanos,
        sent: Nanos,
        reply: &GalilReply,
        marked: Option<bool>,
    ) {
        self.stats.push(now.since(sent));
        let is_whole = reply.is_accepted && reply.begins_with_volts();
        let Some(numbers) = reply.numbers().filter(|_| is_whole) else {
            return self.resynchronise(now);
        };
        let Some(recording) = &mut self.recording else {
            // Without a recording `_RD` means nothing; a question with it may still be on its way.
            let poll =
                RecordingStatus::read(&numbers).map_or(numbers, |status| status.poll.to_vec());
            return self.on_sample(now, Some(sent), &poll, marked == Some(true));
        };
        let Some(status) = RecordingStatus::read(&numbers) else {
            return self.resynchronise(now);
        };
        if self.sampler.is_reset(status.time) {
            if self.sampler.doubts(status.time as u64) {
                // A sample that shows what a command has done is not thrown away.
                if marked.is_some() {
                    self.resynchronise(now);
                }
                return;
            }
            return self.end_recording(now, sent, &status, false);
        }
        if !recording.take_status(status, sent, marked) {
            return self.end_recording(now, sent, &status, marked == Some(true));
        }
        self.stats.samples_lost = recording.samples_lost;
        self.timing.push(status.time as u64, self.pace.tick, sent, now);
        self.fetch(now);
    }

    /// A recording that has ended by itself, such as by a reset.
    fn end_recording(&mut self, now: Nanos, sent: Nanos, status: &RecordingStatus, is_begun: bool) {
        self.abandon_recording(now);
        // What waited has been reported meanwhile with a right clock; this clock stays doubtful all the same.
        self.sampler.doubts(status.time as u64);
        self.on_sample(now, Some(sent), &status.poll, is_begun);
        if !self.is_reset {
            let detail =
                "the controller has stopped recording, and samples were lost; open the rig again";
            self.report(now, RigEventBody::refusal(detail));
        }
    }

    pub(super) fn abandon_recording(&mut self, now: Nanos) {
        let Some(mut recording) = self.recording.take() else {
            return;
        };
        self.question = Sampler::question(&self.settings);
        for out in recording.drain() {
            self.emit(now, out);
        }
    }

    /// Asks for elements that are there, and reports what waited when there are none.
    pub(super) fn fetch(&mut self, now: Nanos) {
        let Some(recording) = &mut self.recording else {
            return;
        };
        if let Some(commands) = recording.fetch() {
            self.fetches.extend(Outgoing::packed(&commands, ExpectedReply::Elements));
        } else if !recording.is_fetching() {
            for out in recording.release_settled() {
                self.emit(now, out);
            }
        }
    }

    pub(super) fn on_elements(&mut self, now: Nanos, reply: &GalilReply) {
        let Some(recording) = &mut self.recording else {
            // An answer for a recording that was abandoned.
            return;
        };
        let column = reply.numbers().filter(|_| reply.is_accepted);
        let out = column.and_then(|column| recording.take(now, column, &self.settings));
        let Some(out) = out else {
            return self.resynchronise(now);
        };
        for out in out {
            self.emit(now, out);
        }
        if self.resync.is_none() {
            self.fetch(now);
        }
    }

    pub(super) fn emit(&mut self, now: Nanos, out: RecordingOutput) {
        match out {
            RecordingOutput::Event(event) => self.report(now, event),
            RecordingOutput::Sample(poll, is_begun) => self.on_sample(now, None, &poll, is_begun),
        }
    }

    /// The numbers of a sample, as a poll gives them.
    pub(super) fn on_sample(
        &mut self,
        now: Nanos,
        sent: Option<Nanos>,
        numbers: &[f64],
        is_begun: bool,
    ) {
        let is_begun = is_begun || self.is_motion_begun;
        match self.sampler.take(numbers, is_begun) {
            Some(SampleOutcome::Reading(reading)) => {
                self.is_motion_begun = false;
                if let Some(sent) = sent {
                    self.timing.push(reading.tick, self.pace.tick, sent, now);
                }
                self.report(now, RigEventBody::Reading(reading));
            }
            Some(SampleOutcome::Same | SampleOutcome::Doubtful) => self.is_motion_begun = is_begun,
            Some(SampleOutcome::Reset) => {
                self.is_motion_begun = false;
                self.on_reset(now);
            }
            None => self.resynchronise(now),
        }
    }

    /// A sine that cannot go on: the axis is stopped.
    pub(super) fn end_sine(&mut self, now: Nanos, why: &str) {
        self.send_urgent(RigCommand::Stop, ExpectedReply::Stop(PendingStop::QUIET));
        let detail = format!("the sine was aborted: {why}");
        self.report_in_order(now, RigEventBody::refusal(detail));
    }

    /// The controller has forgotten its settings: nothing may move before it is opened again.
    pub(super) fn on_reset(&mut self, now: Nanos) {
        self.is_reset = true;
        self.timing = ClockAlignment::default();
        self.sine = None;
        self.tracking = None;
        self.has_watchdog = false;
        self.beginning = None;
        let under_way = self.order.take().map(|(number, _)| number);
        let waiting: Vec<u64> = self.orders.drain(..).map(|(number, _)| number).collect();
        for number in under_way.into_iter().chain(waiting) {
            self.refuse(now, number, RESET);
        }
        self.report(now, RigEventBody::Fault(Fault::ControllerReset));
    }
}
