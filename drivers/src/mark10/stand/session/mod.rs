//! The dialogue with a stand that has been set up: one question at a time, stops before everything.

mod answers;
mod following;

use super::open::ConnectedStand;
use super::protocol::{ForceTravelPair, STOP, StandStatus, ask_limit, set_limit, set_speed};
use super::{MM_PER_PULSE, StandSettings};
use crate::mark10::gauge::GaugeScale;
use crate::rig::RigEventBody;
use crate::text::Lines;
use crate::wire::{ATTENDED_MAX, Dialogue, LinkStats, ORDERS_MAX, OVERTAKEN, TOO_MANY_COMMANDS};
use palpate_model::Nanos;
use palpate_model::rig::command::pulses_from_position;
use palpate_model::rig::{Ack, MotionProfile, MoveTo, RigCommand};
use palpate_model::units::Position;
use std::collections::VecDeque;

/// A tick of the rig's clock, which is the host's.
pub const TICK: Nanos = Nanos::from_millis(1);
const ANSWER_MAX: Nanos = Nanos::from_millis(400);
/// After a garbled answer the line is left to fall silent for so long.
const QUIET: Nanos = Nanos::from_millis(40);
/// After a lost one for longer: it may only be late, and an answer does not show to which question it belongs.
const QUIET_LOST: Nanos = Nanos::from_millis(1_000);
/// The link counts as dead after so many garbled answers in a row; a lost answer counts for two.
const LOST_MAX: u32 = 3;
/// After so many the crosshead is stopped.
const GARBLED_MAX: u32 = 2;
/// Interval of questions for the crosshead's state while it moves without a new travel, and while it rests.
const STATUS_MOVING: Nanos = Nanos::from_millis(40);
const STATUS_RESTING: Nanos = Nanos::from_millis(300);
/// A stop is repeated as often until the crosshead rests.
const STOP_AGAIN: Nanos = Nanos::from_millis(100);
/// A crosshead that shows no new travel for so long rests, or has not begun; the time of some pulses comes to it.
const STILL: Nanos = Nanos::from_millis(600);
const STILL_PULSES: f64 = 4.0;

/// Speed of the link, measured when the stand was opened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandPace {
    pub every: Nanos,
    /// Whether the stand answers `p`.
    pub has_status: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum StandQuestion {
    Sample,
    Status,
    /// A value that was set: its name, steps per unit (mm/min or mm), and the steps that were set.
    Value {
        what: &'static str,
        per_unit: f64,
        expected: i64,
    },
}

#[derive(Clone, Copy, Debug)]
struct StandMove {
    command: MoveTo,
    /// In hundredths of mm of the stand's travel.
    target: i64,
    from: i64,
}

#[derive(Clone, Debug)]
enum Motion {
    Rest,
    /// Speed, limit and letter that are still to be written.
    Setting(StandMove, VecDeque<(String, Option<StandQuestion>)>),
    LetGo(StandMove, Nanos),
    /// Seen to move; the course began with that sample.
    Moving {
        stand_move: StandMove,
        course: MotionProfile,
        start_tick: u64,
        stopped_tick: Option<u64>,
    },
}

#[derive(Debug)]
pub struct StandSession {
    settings: StandSettings,
    scale: GaugeScale,
    pace: StandPace,
    opened: Nanos,
    lines: Lines,
    pair: ForceTravelPair,
    question: Option<(StandQuestion, Nanos)>,
    lines_since: usize,
    next_sample: Nanos,
    status_at: Nanos,
    /// No question before this: a late answer may still be coming.
    quiet_until: Option<Nanos>,
    quiet: Nanos,
    lost_answers: u32,
    stop_due: bool,
    stopped_at: Option<Nanos>,
    /// Stops that the next answer confirms.
    unconfirmed: Vec<RigCommand>,
    orders: VecDeque<RigCommand>,
    motion: Motion,
    status: Option<StandStatus>,
    travel: i64,
    travel_changed: Nanos,
    /// Reported pulses at the stand's travel zero.
    offset: i64,
    rests_at: Option<i64>,
    tick: Option<u64>,
    /// Uncertainty of the newest sample's time.
    uncertainty: Nanos,
    counts: i32,
    /// The newest reading was beyond the gauge's range.
    is_beyond: bool,
    attended_at: Option<Nanos>,
    events: VecDeque<(Nanos, RigEventBody)>,
    stats: LinkStats,
}

impl StandSession {
    #[must_use]
    pub fn new(settings: StandSettings, connected: &ConnectedStand, now: Nanos) -> Self {
        let ConnectedStand { scale, pace, stats, .. } = *connected;
        Self {
            settings,
            scale,
            pace,
            opened: now,
            lines: Lines::default(),
            pair: ForceTravelPair::default(),
            question: None,
            lines_since: 0,
            next_sample: now,
            status_at: now,
            quiet_until: None,
            quiet: QUIET,
            lost_answers: 0,
            stop_due: false,
            stopped_at: None,
            unconfirmed: Vec::new(),
            orders: VecDeque::new(),
            motion: Motion::Rest,
            status: None,
            travel: 0,
            travel_changed: now,
            offset: 0,
            rests_at: None,
            tick: None,
            uncertainty: Nanos::ZERO,
            counts: 0,
            is_beyond: false,
            attended_at: None,
            events: VecDeque::new(),
            stats: LinkStats { in_flight: 1, ..stats },
        }
    }

    fn report(&mut self, now: Nanos, body: RigEventBody) {
        self.events.push_back((now, body));
    }

    fn acknowledge(&mut self, now: Nanos, command: RigCommand) {
        self.report(now, RigEventBody::Ack(Ack { command }));
    }

    fn refuse(&mut self, now: Nanos, detail: impl Into<String>) {
        self.report(now, RigEventBody::refusal(detail));
    }

    fn reported_pulses(&self, travel: i64) -> i64 {
        self.settings.pulses(travel) + self.offset
    }

    fn stop(&mut self, now: Nanos, command: RigCommand) {
        let waiting: Vec<RigCommand> = self.orders.drain(..).collect();
        if let Motion::Setting(..) = self.motion {
            self.motion = Motion::Rest;
            self.refuse(now, OVERTAKEN);
        }
        for order in waiting {
            self.finish_order(now, order, OVERTAKEN);
        }
        self.stop_due = true;
        self.unconfirmed.push(command);
    }

    /// Refuses a motion; does anything else.
    fn finish_order(&mut self, now: Nanos, command: RigCommand, why: &str) {
        if command.is_motion() {
            self.refuse(now, why);
        } else {
            self.execute_now(now, command);
        }
    }

    fn execute_now(&mut self, now: Nanos, command: RigCommand) {
        if let RigCommand::DefinePosition { pulses } = command {
            if !matches!(self.motion, Motion::Rest) || self.tick.is_none() {
                return self.refuse(
                    now,
                    "the position cannot be defined while the crosshead moves; stop the crosshead first",
                );
            }
            self.offset = pulses - self.settings.pulses(self.travel);
            self.rests_at = Some(pulses);
        }
        self.acknowledge(now, command);
    }

    fn begin(&mut self, now: Nanos, command: RigCommand) {
        let RigCommand::MoveTo(to) = command else {
            let why = match command {
                RigCommand::Track(_) => "the stand takes no target on the way; move it from rest",
                _ => "the stand cannot follow a sine; choose a protocol with ramps only",
            };
            return self.finish_order(now, command, why);
        };
        let target = self.settings.pulses(to.target_pulses - self.offset);
        let tenths = (to.speed.0 * 600.0).round() as i64;
        let is_upper = target > self.travel;
        let (Some(speed), Some(limit)) = (set_speed(tenths), set_limit(is_upper, target)) else {
            return self.refuse(
                now,
                format!(
                    "the stand accepts speeds up to 9999.9 mm/min and travel limits up to 999.99 mm, but the command has a speed of {} and a limit of {:.2} mm",
                    to.speed,
                    target as f64 * MM_PER_PULSE
                ),
            );
        };
        let stand_move = StandMove { command: to, target, from: self.travel };
        let letter = if is_upper { "u" } else { "d" };
        let value = |what, per_unit, expected| StandQuestion::Value { what, per_unit, expected };
        let steps = VecDeque::from([
            (format!("{speed}a"), Some(value("speed", 10.0, tenths))),
            (format!("{limit}{}", ask_limit(is_upper)), Some(value("travel limit", 100.0, target))),
            (letter.to_owned(), None),
        ]);
        self.motion = Motion::Setting(stand_move, steps);
    }

    /// A crosshead whose travel grows moves; asking would only cost samples.
    fn is_status_due(&self, now: Nanos) -> bool {
        let (every, since) = if self.is_going() && self.stopped_at.is_none() {
            (STATUS_MOVING, self.status_at.max(self.travel_changed))
        } else if self.is_going() {
            (STATUS_MOVING, self.status_at)
        } else {
            (STATUS_RESTING, self.status_at)
        };
        self.pace.has_status && now.since(since) >= every
    }

    fn is_going(&self) -> bool {
        matches!(self.motion, Motion::LetGo(..) | Motion::Moving { .. })
    }

    fn ask(
        &mut self,
        now: Nanos,
        text: impl Into<Vec<u8>>,
        question: StandQuestion,
    ) -> Option<Vec<u8>> {
        self.question = Some((question, now));
        self.lines_since = 0;
        self.pair = ForceTravelPair::default();
        Some(text.into())
    }

    fn write_stop(&mut self, now: Nanos) -> Vec<u8> {
        self.stop_due = false;
        if self.is_going() {
            self.stopped_at = Some(now);
        }
        STOP.into()
    }
}

fn pulses_of(position: Position) -> i64 {
    pulses_from_position(position, MM_PER_PULSE)
}

impl Dialogue for StandSession {
    fn note_attendance(&mut self, at: Nanos) {
        self.attended_at = Some(at);
    }

    fn command(&mut self, now: Nanos, command: RigCommand) {
        if command.is_stopping() {
            return self.stop(now, command);
        }
        if self.orders.len() >= ORDERS_MAX {
            return self.refuse(now, TOO_MANY_COMMANDS);
        }
        self.orders.push_back(command);
    }

    fn handle_bytes(&mut self, now: Nanos, bytes: &[u8]) {
        if let Some(until) = self.quiet_until.as_mut().filter(|_| !bytes.is_empty()) {
            *until = now + self.quiet;
            return;
        }
        for byte in bytes {
            if let Some(taken) = self.lines.take(*byte) {
                self.on_taken(now, taken);
            }
        }
    }

    fn take_line(&mut self, now: Nanos) -> Option<Vec<u8>> {
        let is_unattended = self.attended_at.is_some_and(|at| now.since(at) > ATTENDED_MAX);
        let is_stopped = self.stopped_at.is_some();
        let is_again =
            self.stopped_at.is_some_and(|at| now.since(at) >= STOP_AGAIN && self.is_going());
        if self.stop_due || is_again || is_unattended && self.is_going() && !is_stopped {
            return Some(self.write_stop(now));
        }
        if !self.is_going() {
            self.stopped_at = None;
        }
        if let Some((_, sent)) = self.question {
            if now.since(sent) <= ANSWER_MAX {
                return None;
            }
            self.lose_answer(now, QUIET_LOST);
            if self.stop_due {
                return Some(self.write_stop(now));
            }
        }
        if self.quiet_until.is_some_and(|until| now < until) {
            return None;
        }
        self.quiet_until = None;
        // Before the first sample the direction to a target is not known.
        if matches!(self.motion, Motion::Rest)
            && self.tick.is_some()
            && let Some(command) = self.orders.pop_front()
        {
            self.begin(now, command);
        } else if self.is_going()
            && let Some(command) = self.orders.pop_front()
        {
            self.finish_order(
                now,
                command,
                "the crosshead is still moving; stop the crosshead first",
            );
        }
        if let Motion::Setting(stand_move, steps) = &mut self.motion
            && let Some((text, question)) = steps.pop_front()
        {
            if let Some(question) = question {
                return self.ask(now, text, question);
            }
            let stand_move = *stand_move;
            self.motion = Motion::LetGo(stand_move, now);
            // A state reported before the letter is old.
            self.status = None;
            self.stopped_at = None;
            self.travel_changed = now;
            self.next_sample = now;
            self.status_at = now;
            self.acknowledge(now, RigCommand::MoveTo(stand_move.command));
            let is_there = stand_move.target == stand_move.from;
            return Some(if is_there { Vec::new() } else { text.into() });
        }
        if self.is_status_due(now) {
            self.status_at = now;
            return self.ask(now, "p", StandQuestion::Status);
        }
        if now >= self.next_sample {
            self.next_sample = now + self.pace.every;
            return self.ask(now, "n", StandQuestion::Sample);
        }
        None
    }

    fn next_at(&self, now: Nanos) -> Nanos {
        match self.question {
            Some((_, sent)) => sent + ANSWER_MAX,
            None => self.next_sample.max(now),
        }
    }

    fn take_event(&mut self) -> Option<(Nanos, RigEventBody)> {
        self.events.pop_front()
    }

    fn is_dead(&self, _now: Nanos) -> Option<String> {
        (self.lost_answers >= LOST_MAX && !self.stop_due).then(|| {
            "the stand no longer gives valid answers; if the crosshead moves, it stops at its travel limit at the latest; check cable and power"
                .into()
        })
    }

    fn stats(&self) -> LinkStats {
        self.stats
    }

    fn host_time(&self, tick: u64) -> Option<Nanos> {
        Some(Nanos(self.opened.0 + tick * TICK.0))
    }

    fn uncertainty(&self, _at: Nanos) -> Option<Nanos> {
        Some(self.uncertainty)
    }
}
