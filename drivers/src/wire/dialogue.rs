//! The interface between a protocol and the thread that owns its link.

use crate::rig::RigEventBody;
use palpate_model::Nanos;
use palpate_model::rig::{Ack, RigCommand};
use std::collections::VecDeque;

/// Commands that wait in a dialogue; as many as may wait on the way to it.
pub(crate) const ORDERS_MAX: usize = 64;
/// Without samples being taken for so long, palpate hangs and the axis is stopped.
pub(crate) const ATTENDED_MAX: Nanos = Nanos::from_millis(500);
pub(crate) const OVERTAKEN: &str =
    "a stop came before the command, so the command was not executed";
pub(crate) const TOO_MANY_COMMANDS: &str = "too many commands are waiting in the queue";

/// Statistics of a link, for the operator and the log.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkStats {
    /// Questions asked and answered since the link was opened.
    pub answers: u64,
    /// Shortest time from writing a question to the end of its answer.
    pub round_trip_min: Nanos,
    pub round_trip_mean: Nanos,
    pub round_trip_max: Nanos,
    /// Questions that may wait for their answers at once.
    pub in_flight: usize,
    /// Largest distance of the middle of a question from the time of its answer by the device's clock, as that was
    /// known before.
    pub deviation_max: Nanos,
    /// Samples that a device took and overwrote before they were fetched.
    pub samples_lost: u64,
    /// Count of resynchronisations of questions and answers.
    pub resynchronised: u64,
    /// Whether the system grants the link's thread real time, so that other programs do not make a stop late.
    pub is_real_time: bool,
}

impl LinkStats {
    pub fn push(&mut self, round_trip: Nanos) {
        let sum = self.round_trip_mean.0 as f64 * self.answers as f64 + round_trip.0 as f64;
        self.round_trip_min =
            if self.answers == 0 { round_trip } else { self.round_trip_min.min(round_trip) };
        self.round_trip_max = self.round_trip_max.max(round_trip);
        self.answers += 1;
        self.round_trip_mean = Nanos((sum / self.answers as f64).round() as u64);
    }

    /// Half the difference of the longest and the shortest round trip: how far a sample's time at the host is
    /// uncertain against its controller's.
    pub fn jitter(&self) -> Nanos {
        Nanos(self.round_trip_max.since(self.round_trip_min).0 / 2)
    }
}

/// Commands are answered in the order in which they came, in whatever order they are done.
#[derive(Clone, Debug, Default)]
pub struct AnswerQueue {
    owed: VecDeque<(u64, Option<RigEventBody>)>,
    count: u64,
}

impl AnswerQueue {
    pub fn owe(&mut self) -> u64 {
        self.count += 1;
        self.owed.push_back((self.count, None));
        self.count
    }

    /// Answers a command. Returns the answers that may be given now, in order: those with none missing before them.
    fn answer(&mut self, number: u64, body: RigEventBody) -> Vec<RigEventBody> {
        if let Some((_, answer)) = self.owed.iter_mut().find(|(owed, _)| *owed == number) {
            *answer = Some(body);
        }
        let ready = self.owed.iter().take_while(|(_, answer)| answer.is_some()).count();
        self.owed.drain(..ready).filter_map(|(_, answer)| answer).collect()
    }

    pub fn acknowledge(&mut self, number: u64, command: RigCommand) -> Vec<RigEventBody> {
        self.answer(number, RigEventBody::Ack(Ack { command }))
    }

    pub fn refuse(&mut self, number: u64, detail: impl Into<String>) -> Vec<RigEventBody> {
        self.answer(number, RigEventBody::refusal(detail))
    }
}

/// A protocol in progress. Times never go backwards. It must neither wait nor read a clock.
pub trait Dialogue: Send {
    /// The rig's owner has asked for reports. Without such calls the dialogue stops the axis.
    fn note_attendance(&mut self, at: Nanos);

    /// A command from the host. Commands that stop are written before all that wait, and motions that wait are not
    /// begun. Whatever the order of writing, commands are acknowledged or refused in the order in which they came.
    fn command(&mut self, now: Nanos, command: RigCommand);

    /// A command that a stop has overtaken before it got here; the stop comes next. A motion is not begun.
    fn overtaken(&mut self, now: Nanos, command: RigCommand) {
        self.command(now, command);
    }

    fn handle_bytes(&mut self, now: Nanos, bytes: &[u8]);

    /// Whole lines to be written now, if there are any.
    fn take_line(&mut self, now: Nanos) -> Option<Vec<u8>>;

    /// When it must be asked again at the latest.
    fn next_at(&self, now: Nanos) -> Nanos;

    /// The next report, with its arrival.
    fn take_event(&mut self) -> Option<(Nanos, RigEventBody)>;

    /// Why the link counts as dead although it is open, such as silence.
    fn is_dead(&self, now: Nanos) -> Option<String>;

    /// Time of a device's tick on the host's clock, as far as is known.
    fn host_time(&self, _tick: u64) -> Option<Nanos> {
        None
    }

    /// Largest error of [`Dialogue::host_time`] at a time of the host.
    fn uncertainty(&self, _at: Nanos) -> Option<Nanos> {
        None
    }

    fn stats(&self) -> LinkStats;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_trips_have_minimum_mean_and_maximum() {
        let mut stats = LinkStats::default();
        for trip in [3_000, 1_000, 2_000] {
            stats.push(Nanos(trip));
        }
        assert_eq!(stats.round_trip_min, Nanos(1_000));
        assert_eq!(stats.round_trip_mean, Nanos(2_000));
        assert_eq!(stats.round_trip_max, Nanos(3_000));
        assert_eq!(stats.jitter(), Nanos(1_000));
    }

    #[test]
    fn answers_come_in_the_order_of_the_commands() {
        let mut answers = AnswerQueue::default();
        let (first, second) = (answers.owe(), answers.owe());
        assert_eq!(answers.acknowledge(second, RigCommand::Stop), []);
        let both = answers.refuse(first, "no");
        assert!(matches!(both[..], [RigEventBody::Fault(_), RigEventBody::Ack(_)]));
    }
}
