//! The dialogue with a sidecar that is a rig: commands and beats to it, samples and answers from it.

mod answers;
mod samples;
mod watch;

use super::budget::{FaultLimit, LinkBudget};
use super::connect::ConnectedSidecar;
use super::description::{SidecarAxis, SidecarCell, SidecarDescription};
use super::protocol::{HostMessage, SidecarParser};
use super::sensors::SensorReports;
use super::{SidecarSettings, worst_case_mm};
use crate::board_clock::BoardClock;
use crate::rig::RigEventBody;
use crate::split_rig::CellClock;
use crate::wire::{
    AnswerQueue, Dialogue, LinkStats, ORDERS_MAX, OVERTAKEN, TOO_MANY_COMMANDS, Waiting,
};
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, MoveTo, RigCommand};
use palpate_model::units::{MmPerS, MmPerS2};
use std::collections::VecDeque;

/// Beats in the time after which the axis brakes by itself: one may be lost, and one may be late.
const BEATS_PER_SILENCE: u64 = 4;
/// A beat so often at least, so that a dead link is noticed.
const BEAT_MAX: Nanos = Nanos::from_millis(200);

/// A line that has no answer yet.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Request {
    Start,
    Beat,
    Command(RigCommand),
}

impl Request {
    fn is_stop(self) -> bool {
        matches!(self, Self::Command(command) if command.is_stopping())
    }
}

#[derive(Clone, Debug)]
struct PendingAnswer {
    request: Request,
    /// Numbers of its lines: a stop is repeated.
    numbers: Vec<u64>,
    sent: Waiting,
    repeated: Nanos,
    /// The command's number among those that the rig's owner waits for.
    owed: Option<u64>,
}

/// A motion that was acknowledged and has not been seen.
#[derive(Clone, Copy, Debug)]
struct AwaitedMotion {
    since: Waiting,
    /// Pulses of its end; `None` for a sine.
    end: Option<i64>,
}

#[derive(Clone, Copy, Debug)]
struct NewestSample {
    /// The device's clock.
    time: Nanos,
    /// By the device's counter.
    pulses: i64,
    status: AxisStatus,
}

/// What cannot change while the link is open.
#[derive(Clone, Debug)]
struct Facts {
    axis: SidecarAxis,
    cell: SidecarCell,
    speed_max: MmPerS,
    acceleration: MmPerS2,
    has_checksum: bool,
    has_frames: bool,
    tick_ns: u64,
    period: Nanos,
    beat_every: Nanos,
    worst_case_mm: f64,
}

impl Facts {
    fn new(
        settings: &SidecarSettings,
        about: &SidecarDescription,
        axis: SidecarAxis,
        cell: SidecarCell,
    ) -> Self {
        let (speed_max, acceleration) = (settings.speed_max(&axis), settings.acceleration(&axis));
        Self {
            axis,
            cell,
            speed_max,
            acceleration,
            has_checksum: about.crc,
            has_frames: about.binary,
            tick_ns: about.tick_ns,
            period: about.period(),
            beat_every: Nanos(about.silence().0 / BEATS_PER_SILENCE).min(BEAT_MAX),
            worst_case_mm: worst_case_mm(speed_max, acceleration, about.silence()),
        }
    }
}

pub struct SidecarSession {
    facts: Facts,
    parser: SidecarParser,
    /// The number of the newest line.
    number: u64,
    answers: AnswerQueue,
    orders: VecDeque<(u64, RigCommand)>,
    /// To be written before everything else.
    stops: VecDeque<(Option<u64>, RigCommand)>,
    pending: Vec<PendingAnswer>,
    is_started: bool,
    beat_at: Option<Nanos>,
    board_clock: BoardClock,
    host_clock: CellClock,
    newest: Option<NewestSample>,
    /// Offset of the caller's pulses from the device's.
    zero: i64,
    awaited: Option<AwaitedMotion>,
    /// Since a stop was accepted that no sample has shown.
    stop_accepted: Option<Waiting>,
    /// Why no command but a stop is passed on.
    locked: Option<String>,
    sensors: SensorReports,
    attended_at: Nanos,
    /// For the next sample that is good, and for the next answer.
    for_sample: Waiting,
    for_answer: Waiting,
    looked_at: Nanos,
    is_silent: bool,
    is_beyond: bool,
    /// Lines and samples that mean nothing since the last one that was good.
    garbled_in_row: u32,
    budget: LinkBudget,
    fault_limit: FaultLimit,
    is_flooded: bool,
    events: VecDeque<(Nanos, RigEventBody)>,
    stats: LinkStats,
}

impl SidecarSession {
    /// Goes on with a sidecar that has introduced itself, from `now`.
    #[must_use]
    pub fn new(
        settings: &SidecarSettings,
        connected: &ConnectedSidecar,
        (axis, cell): (SidecarAxis, SidecarCell),
        sensors: SensorReports,
        now: Nanos,
    ) -> Self {
        let about = &connected.description;
        Self {
            facts: Facts::new(settings, about, axis, cell),
            parser: SidecarParser::new(about.crc, about.binary),
            number: connected.number,
            answers: AnswerQueue::default(),
            orders: VecDeque::new(),
            stops: VecDeque::new(),
            pending: Vec::new(),
            is_started: false,
            beat_at: None,
            board_clock: BoardClock::new(about.tick_ns),
            host_clock: CellClock::default(),
            newest: None,
            zero: 0,
            awaited: None,
            stop_accepted: None,
            locked: None,
            sensors,
            attended_at: now,
            for_sample: Waiting::new(now),
            for_answer: Waiting::new(now),
            looked_at: now,
            is_silent: false,
            is_beyond: false,
            garbled_in_row: 0,
            budget: LinkBudget::new(about.rate, now),
            fault_limit: FaultLimit::default(),
            is_flooded: false,
            events: VecDeque::new(),
            stats: connected.stats,
        }
    }

    fn report(&mut self, now: Nanos, bodies: impl IntoIterator<Item = RigEventBody>) {
        self.events.extend(bodies.into_iter().map(|body| (now, body)));
    }

    fn refuse(&mut self, now: Nanos, owed: Option<u64>, why: &str) {
        match owed {
            Some(owed) => {
                let answers = self.answers.refuse(owed, why);
                self.report(now, answers);
            }
            None => self.report(now, [RigEventBody::refusal(why)]),
        }
    }

    /// Something is wrong: the axis is stopped, and the rig's owner learns why.
    fn fail(&mut self, now: Nanos, why: &str) {
        self.stop_axis(now, why);
        if self.fault_limit.allows(now) {
            self.report(now, [RigEventBody::refusal(why)]);
        }
    }

    /// Stops the axis without a command, unless a stop is on its way.
    fn stop_axis(&mut self, now: Nanos, why: &str) {
        self.refuse_waiting(now, why, RigCommand::is_motion);
        self.awaited = None;
        if !self.is_stop_under_way() {
            self.stops.push_back((None, RigCommand::Stop));
        }
    }

    /// Whether a stop is to be written or answered.
    fn is_stop_under_way(&self) -> bool {
        !self.stops.is_empty() || self.pending.iter().any(|pending| pending.request.is_stop())
    }

    fn refuse_waiting(&mut self, now: Nanos, why: &str, is_refused: fn(&RigCommand) -> bool) {
        for (owed, order) in std::mem::take(&mut self.orders) {
            if is_refused(&order) {
                self.refuse(now, Some(owed), why);
            } else {
                self.orders.push_back((owed, order));
            }
        }
    }

    /// Position or identity can no longer be trusted: no motion before the rig is connected again.
    fn lock(&mut self, now: Nanos, why: &str) {
        if self.locked.is_none() {
            self.locked = Some(why.to_owned());
            self.refuse_waiting(now, why, |_| true);
        }
    }

    /// Whether the axis moves or may begin to.
    fn is_moving(&self) -> bool {
        let is_seen = self.newest.is_some_and(|newest| newest.status.has(AxisStatus::MOVING));
        let is_motion = |pending: &PendingAnswer| matches!(pending.request, Request::Command(command) if command.is_motion());
        is_seen || self.awaited.is_some() || self.pending.iter().any(is_motion)
    }

    fn write(
        &mut self,
        now: Nanos,
        request: Request,
        owed: Option<u64>,
        message: HostMessage,
    ) -> Vec<u8> {
        self.number += 1;
        self.budget.note_written();
        let numbers = vec![self.number];
        let sent = Waiting::new(now);
        self.pending.push(PendingAnswer { request, numbers, sent, repeated: now, owed });
        message.line(self.number, self.facts.has_checksum)
    }

    fn write_stop(&mut self, now: Nanos, owed: Option<u64>, command: RigCommand) -> Vec<u8> {
        self.awaited = None;
        self.write(now, Request::Command(command), owed, stop_message(command))
    }

    /// Begins a command; gives its line, if it is not done without one.
    fn begin(&mut self, now: Nanos, owed: u64, command: RigCommand) -> Option<Vec<u8>> {
        if let Some(why) = self.locked.clone() {
            self.refuse(now, Some(owed), &why);
            return None;
        }
        let message = match command {
            RigCommand::EnableMotor => Ok(HostMessage::Enable),
            RigCommand::MoveTo(to) => self.move_message(&to),
            RigCommand::Oscillate(sine) if self.facts.axis.sine => Ok(HostMessage::Sine {
                amplitude: sine.amplitude_pulses,
                period: sine.period_ticks,
                cycles: sine.cycles,
                acceleration: sine.acceleration,
            }),
            RigCommand::Track(_) => {
                Err("the sidecar takes no target on the way; move the axis from rest".into())
            }
            RigCommand::Oscillate(_) => {
                Err("the sidecar cannot follow a sine; choose a protocol with ramps only".into())
            }
            RigCommand::DefinePosition { pulses } => {
                self.define_position(now, owed, pulses);
                return None;
            }
            RigCommand::Stop | RigCommand::Halt => Ok(stop_message(command)),
        };
        match message {
            Ok(message) => Some(self.write(now, Request::Command(command), Some(owed), message)),
            Err(why) => {
                self.refuse(now, Some(owed), &why);
                None
            }
        }
    }

    fn move_message(&self, to: &MoveTo) -> Result<HostMessage, String> {
        // A product of a quantum may be a little more than the limit itself.
        let slack = 1.0 + 1e-9;
        let (speed_max, acceleration) = (self.facts.speed_max, self.facts.acceleration);
        if !(to.speed.0 > 0.0 && to.speed.0 <= speed_max.0 * slack) {
            let speed = to.speed;
            return Err(format!(
                "a speed of {speed} is above the largest one of the rig, {speed_max}"
            ));
        }
        if !(to.acceleration.0 > 0.0 && to.acceleration.0 <= acceleration.0 * slack) {
            let wanted = to.acceleration;
            return Err(format!(
                "an acceleration of {wanted} is above the largest one of the rig, {acceleration}"
            ));
        }
        let target = to.target_pulses + self.zero;
        Ok(HostMessage::Move { to: target, speed: to.speed, acceleration: to.acceleration })
    }

    fn define_position(&mut self, now: Nanos, owed: u64, pulses: i64) {
        match self.newest {
            Some(newest) if !self.is_moving() => {
                self.zero = newest.pulses - pulses;
                let answers = self.answers.acknowledge(owed, RigCommand::DefinePosition { pulses });
                self.report(now, answers);
            }
            _ => self.refuse(
                now,
                Some(owed),
                "the position cannot be defined while the axis moves or before its first sample; stop the axis first",
            ),
        }
    }

    /// A command that waits, when its turn has come.
    fn take_order(&mut self, now: Nanos) -> Option<Vec<u8>> {
        let is_busy = |pending: &PendingAnswer| matches!(pending.request, Request::Command(_));
        while !self.pending.iter().any(is_busy) {
            // A position is defined where the motion before it has ended.
            let (owed, command) = self.orders.pop_front()?;
            if let Some(line) = self.begin(now, owed, command) {
                return Some(line);
            }
        }
        None
    }
}

fn stop_message(command: RigCommand) -> HostMessage {
    if command == RigCommand::Halt { HostMessage::Halt } else { HostMessage::Stop }
}

impl Dialogue for SidecarSession {
    fn note_attendance(&mut self, at: Nanos) {
        self.attended_at = at;
    }

    fn command(&mut self, now: Nanos, command: RigCommand) {
        let owed = self.answers.owe();
        if command.is_stopping() {
            self.refuse_waiting(now, OVERTAKEN, RigCommand::is_motion);
            self.stops.push_back((Some(owed), command));
        } else if self.orders.len() >= ORDERS_MAX {
            self.refuse(now, Some(owed), TOO_MANY_COMMANDS);
        } else {
            self.orders.push_back((owed, command));
        }
    }

    fn handle_bytes(&mut self, now: Nanos, bytes: &[u8]) {
        self.budget.take_bytes(now, bytes.len());
        for byte in bytes {
            let mut item = self.parser.take(*byte);
            while let Some(received) = item {
                self.budget.take_item(now);
                if self.check_flood(now) {
                    return;
                }
                self.on_item(now, received);
                item = self.parser.next_ready();
            }
        }
        self.check_flood(now);
    }

    fn take_line(&mut self, now: Nanos) -> Option<Vec<u8>> {
        self.watch(now);
        if let Some((owed, command)) = self.stops.pop_front() {
            return Some(self.write_stop(now, owed, command));
        }
        if let Some(line) = self.repeat_stop(now) {
            return Some(line);
        }
        if self.beat_at.is_none_or(|at| now.since(at) >= self.facts.beat_every) {
            self.beat_at = Some(now);
            return Some(self.write(now, Request::Beat, None, HostMessage::Beat));
        }
        if !std::mem::replace(&mut self.is_started, true) {
            let is_binary = self.facts.has_frames;
            return Some(self.write(now, Request::Start, None, HostMessage::Start { is_binary }));
        }
        self.take_order(now)
    }

    fn next_at(&self, now: Nanos) -> Nanos {
        // A millisecond is short against all that is waited for here.
        now + Nanos::from_millis(1)
    }

    fn take_event(&mut self) -> Option<(Nanos, RigEventBody)> {
        self.events.pop_front()
    }

    fn is_dead(&self, now: Nanos) -> Option<String> {
        self.why_dead(now)
    }

    fn stats(&self) -> LinkStats {
        self.stats
    }
}
