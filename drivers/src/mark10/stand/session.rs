//! The dialogue with a stand that has been set up: one question at a time, stops before everything.

use super::open::ConnectedStand;
use super::protocol::{
    Crosshead, Force, Pair, STOP, Status, ask_limit, number, set_limit, set_speed,
};
use super::{LAG, MM_PER_PULSE, REST_TOLERANCE_MM, SPEED_TOLERANCE, StandSettings};
use crate::mark10::gauge::GaugeScale;
use crate::rig::RigEventBody;
use crate::text::{Lines, Taken};
use crate::wire::{Dialogue, LinkStats};
use palpate_model::Nanos;
use palpate_model::rig::command::{position_from_pulses, pulses_from_position};
use palpate_model::rig::{Ack, Age, AxisStatus, Fault, MoveTo, Profile, Reading, RigCommand};
use palpate_model::units::{Position, Seconds, Volts};
use std::collections::VecDeque;

/// A tick of the rig's clock, which is the host's.
pub const TICK: Nanos = Nanos::from_millis(1);
/// An answer later than this was lost.
const ANSWER_MAX: Nanos = Nanos::from_millis(400);
/// After a garbled answer the line is left to fall silent for so long.
const QUIET: Nanos = Nanos::from_millis(40);
/// After a lost one for longer: it may only be late, and nothing in an answer tells to which question it belongs.
const QUIET_LOST: Nanos = Nanos::from_millis(1_000);
/// So many answers garbled in a row, and the link counts as dead; a lost one counts for two.
const LOST_MAX: u32 = 3;
/// And so many, and the crosshead is stopped.
const GARBLED_MAX: u32 = 2;
/// How often the crosshead's state is asked for, while it moves without a new travel and while it rests.
const STATUS_MOVING: Nanos = Nanos::from_millis(40);
const STATUS_RESTING: Nanos = Nanos::from_millis(300);
/// A stop is repeated as often until the crosshead rests.
const STOP_AGAIN: Nanos = Nanos::from_millis(100);
/// Motions end when nobody takes samples for so long: palpate hangs.
const ATTENDED_MAX: Nanos = Nanos::from_millis(500);
/// A crosshead that shows no new travel for so long rests, or has not begun; the time of some pulses comes to it.
const STILL: Nanos = Nanos::from_millis(600);
const STILL_PULSES: f64 = 4.0;
/// Commands that wait; as many as may wait on the way here.
const ORDERS_MAX: usize = 64;
const OVERTAKEN: &str = "a stop came first, so it was not begun";

/// How fast the link was when the stand was opened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Between two questions.
    pub every: Nanos,
    /// Whether the stand answers `p`.
    pub has_status: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Asked {
    Sample,
    Status,
    /// The speed as it was set, in tenths of mm/min.
    Speed(i64),
    /// A limit as it was set, in hundredths of mm.
    Limit(i64),
}

/// A move that is being set up or made.
#[derive(Clone, Copy, Debug)]
struct Going {
    command: MoveTo,
    /// In hundredths of mm of the stand's travel.
    target: i64,
    from: i64,
}

#[derive(Clone, Debug)]
enum Motion {
    Rest,
    /// Speed, limit and letter that are still to be written.
    Setting(Going, VecDeque<(String, Option<Asked>)>),
    /// Let go, and not seen to move.
    LetGo(Going, Nanos),
    /// Seen to move; the course began with that sample.
    Moving {
        going: Going,
        course: Profile,
        start_tick: u64,
        stopped_tick: Option<u64>,
    },
}

/// The dialogue.
#[derive(Debug)]
pub struct StandSession {
    settings: StandSettings,
    scale: GaugeScale,
    pace: Pace,
    opened: Nanos,
    lines: Lines,
    pair: Pair,
    asked: Option<(Asked, Nanos)>,
    /// Lines that came since.
    lines_since: usize,
    next_sample: Nanos,
    status_at: Nanos,
    /// No question before this: a late answer may still be coming.
    quiet_until: Option<Nanos>,
    quiet: Nanos,
    lost: u32,
    stop_due: bool,
    stopped_at: Option<Nanos>,
    /// Stops that the next answer confirms.
    unconfirmed: Vec<RigCommand>,
    orders: VecDeque<RigCommand>,
    motion: Motion,
    status: Option<Status>,
    travel: i64,
    travel_changed: Nanos,
    /// Pulses told at the stand's travel zero.
    offset: i64,
    /// Where it was commanded to rest.
    rests_at: Option<i64>,
    tick: Option<u64>,
    /// Of the newest sample's time.
    uncertainty: Nanos,
    counts: i32,
    /// The newest reading was beyond the gauge's range.
    is_beyond: bool,
    attended: Option<Nanos>,
    events: VecDeque<(Nanos, RigEventBody)>,
    stats: LinkStats,
}

impl StandSession {
    /// With a stand that was set up just now.
    #[must_use]
    pub fn new(settings: StandSettings, connected: &ConnectedStand, now: Nanos) -> Self {
        let ConnectedStand {
            scale, pace, stats, ..
        } = *connected;
        Self {
            settings,
            scale,
            pace,
            opened: now,
            lines: Lines::default(),
            pair: Pair::default(),
            asked: None,
            lines_since: 0,
            next_sample: now,
            status_at: now,
            quiet_until: None,
            quiet: QUIET,
            lost: 0,
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
            attended: None,
            events: VecDeque::new(),
            stats: LinkStats {
                in_flight: 1,
                ..stats
            },
        }
    }

    fn report(&mut self, now: Nanos, body: RigEventBody) {
        self.events.push_back((now, body));
    }

    fn acknowledge(&mut self, now: Nanos, command: RigCommand) {
        self.report(now, RigEventBody::Ack(Ack { command }));
    }

    fn refuse(&mut self, now: Nanos, detail: impl Into<String>) {
        let detail = detail.into();
        self.report(now, RigEventBody::Fault(Fault::CommandRefused { detail }));
    }

    /// Pulses as they are told, of a travel of the stand.
    fn told(&self, travel: i64) -> i64 {
        self.settings.pulses(travel) + self.offset
    }

    fn stop(&mut self, now: Nanos, command: RigCommand) {
        let waiting: Vec<RigCommand> = self.orders.drain(..).collect();
        if let Motion::Setting(..) = self.motion {
            self.motion = Motion::Rest;
            self.refuse(now, OVERTAKEN);
        }
        for order in waiting {
            match order {
                RigCommand::MoveTo(_) | RigCommand::Oscillate(_) => self.refuse(now, OVERTAKEN),
                other => self.simple(now, other),
            }
        }
        self.stop_due = true;
        self.unconfirmed.push(command);
    }

    /// A command that is done here.
    fn simple(&mut self, now: Nanos, command: RigCommand) {
        if let RigCommand::DefinePosition { pulses } = command {
            if !matches!(self.motion, Motion::Rest) || self.tick.is_none() {
                return self.refuse(now, "the crosshead moves; a position is defined at rest");
            }
            self.offset = pulses - self.settings.pulses(self.travel);
            self.rests_at = Some(pulses);
        }
        self.acknowledge(now, command);
    }

    fn begin(&mut self, now: Nanos, command: RigCommand) {
        let RigCommand::MoveTo(to) = command else {
            if matches!(command, RigCommand::Oscillate(_)) {
                return self.refuse(now, "the stand moves straight only, not on a sine");
            }
            return self.simple(now, command);
        };
        let target = self.settings.pulses(to.target_pulses - self.offset);
        let tenths = (to.speed.0 * 600.0).round() as i64;
        let is_upper = target > self.travel;
        let (Some(speed), Some(limit)) = (set_speed(tenths), set_limit(is_upper, target)) else {
            return self.refuse(
                now,
                format!(
                    "the stand takes speeds up to 9999.9 mm/min and limits up to 999.99 mm, not {} to {:.2} mm",
                    to.speed,
                    target as f64 * MM_PER_PULSE
                ),
            );
        };
        let going = Going {
            command: to,
            target,
            from: self.travel,
        };
        let letter = if is_upper { "u" } else { "d" };
        let steps = VecDeque::from([
            (format!("{speed}a"), Some(Asked::Speed(tenths))),
            (
                format!("{limit}{}", ask_limit(is_upper)),
                Some(Asked::Limit(target)),
            ),
            (letter.to_owned(), None),
        ]);
        self.motion = Motion::Setting(going, steps);
    }

    fn answered(&mut self, now: Nanos) {
        if let Some((_, sent)) = self.asked.take() {
            self.stats.push(now.since(sent));
        }
        self.lost = 0;
        if !self.stop_due {
            for command in std::mem::take(&mut self.unconfirmed) {
                self.acknowledge(now, command);
            }
        }
    }

    fn on_line(&mut self, now: Nanos, line: &str) {
        let Some((asked, sent)) = self.asked else {
            return;
        };
        match asked {
            Asked::Sample => {
                if let Some((force, travel)) = self.pair.take(line) {
                    self.answered(now);
                    // It was taken somewhere between question and answer.
                    let at = Nanos(sent.0 + now.since(sent).0 / 2);
                    self.on_sample(now, at, force, travel);
                }
            }
            Asked::Status => {
                if let Some(status) = Status::parse(line) {
                    self.answered(now);
                    self.status = Some(status);
                }
            }
            Asked::Speed(tenths) => {
                if let Some(found) = number(line) {
                    self.answered(now);
                    self.check(now, (found * 10.0).round() as i64 == tenths, line, "speed");
                }
            }
            Asked::Limit(hundredths) => {
                if let Some(found) = number(line) {
                    self.answered(now);
                    let is_right = (found * 100.0).round() as i64 == hundredths;
                    self.check(now, is_right, line, "travel limit");
                }
            }
        }
    }

    /// What was set and read back while a move is set up.
    fn check(&mut self, now: Nanos, is_right: bool, line: &str, what: &str) {
        if !is_right && let Motion::Setting(..) = self.motion {
            self.motion = Motion::Rest;
            let line = line.trim();
            self.refuse(
                now,
                format!("the stand reads back {line} for its {what}; check its range and that PC control is on"),
            );
        }
    }

    fn on_sample(&mut self, now: Nanos, at: Nanos, force: Force, travel: i64) {
        if travel != self.travel {
            self.travel_changed = now;
        }
        self.travel = travel;
        let counts = match force {
            Force::Reading(reading)
                if reading.unit == self.scale.unit
                    && reading.number.decimals == self.scale.decimals =>
            {
                reading.number.digits
            }
            Force::Overload if self.counts < 0 => -self.scale.counts_max,
            Force::Overload => self.scale.counts_max,
            // Another unit or another resolution: somebody has pressed a key of the gauge.
            Force::Reading(_) => {
                let tick = self.tick.unwrap_or(0);
                return self.report(now, RigEventBody::Fault(Fault::SignalInvalid { tick }));
            }
        };
        self.counts = counts;
        self.look_for_overload(now);
        let tick = at.since(self.opened).0 / TICK.0;
        if self.tick.is_some_and(|before| tick <= before) {
            return;
        }
        self.tick = Some(tick);
        let (pulses, moving) = self.follow(now, tick);
        let mut status = AxisStatus::MOTOR_ON | moving;
        if self.settings.pulses(travel) <= 0 {
            status = status | AxisStatus::HOME;
        }
        let (upper, lower) = self.status.map_or((false, false), |status| {
            (status.is_at_upper, status.is_at_lower)
        });
        let (forward, reverse) = if self.settings.is_upwards {
            (upper, lower)
        } else {
            (lower, upper)
        };
        if forward {
            status = status | AxisStatus::FORWARD_LIMIT;
        }
        if reverse {
            status = status | AxisStatus::REVERSE_LIMIT;
        }
        let reading = Reading {
            tick,
            counts: Some(counts),
            volts: Volts(f64::from(counts) * self.scale.volts_per_count()),
            pulses,
            status,
            age: Some(Age {
                by: now.since(at),
                within: now.since(at),
            }),
        };
        self.uncertainty = now.since(at) + Nanos(TICK.0 / 2);
        self.report(now, RigEventBody::Reading(reading));
    }

    /// A reading at the end of the range stands for all that is beyond it, and no limit of force may see it.
    fn look_for_overload(&mut self, now: Nanos) {
        let is_beyond = self.counts.saturating_abs() >= self.scale.counts_max;
        if is_beyond && !std::mem::replace(&mut self.is_beyond, is_beyond) {
            self.stop_due |= self.is_going();
            self.refuse(
                now,
                "the force is beyond the gauge's range; take the load off before it is damaged",
            );
        }
        self.is_beyond = is_beyond;
    }

    /// Where the axis is told to be at a sample, and whether it moves.
    fn follow(&mut self, now: Nanos, tick: u64) -> (i64, AxisStatus) {
        let none = AxisStatus(0);
        let true_pulses = self.told(self.travel);
        match self.motion.clone() {
            Motion::Rest | Motion::Setting(..) => (self.at_rest(true_pulses), none),
            Motion::LetGo(going, since) => {
                // A move that a stop has ended at once is told too, or nobody would know that it is over.
                let is_over = going.target == going.from || self.stopped_at.is_some();
                if !is_over && self.travel == going.from && !self.has_status_moved() {
                    if now.since(since) > self.still(going.command) {
                        self.motion = Motion::Rest;
                        self.stop_due = true;
                        self.refuse(
                            now,
                            "the crosshead has not begun to move; check PC control, its emergency stop and its limit switches",
                        );
                    }
                    return (self.at_rest(true_pulses), none);
                }
                let command = going.command;
                let from = self.at_rest(self.told(going.from));
                let course = Profile::to_rest(
                    position_from_pulses(from, MM_PER_PULSE),
                    position_from_pulses(command.target_pulses, MM_PER_PULSE),
                    command.speed,
                    command.acceleration,
                );
                self.rests_at = None;
                // A state that was told before it began is old.
                self.status = None;
                let stopped_tick = self.stopped_at.map(|_| tick);
                self.motion = Motion::Moving {
                    going,
                    course: stopped_tick.map_or(course, |_| course.stopped_at(Seconds(0.0))),
                    start_tick: tick,
                    stopped_tick,
                };
                let stopping = stopped_tick.map_or(none, |_| AxisStatus::STOPPING);
                (from, AxisStatus::MOVING | stopping)
            }
            Motion::Moving {
                going,
                course,
                start_tick,
                stopped_tick,
            } => self.follow_course(now, tick, going, course, (start_tick, stopped_tick)),
        }
    }

    fn follow_course(
        &mut self,
        now: Nanos,
        tick: u64,
        going: Going,
        course: Profile,
        (start_tick, stopped_tick): (u64, Option<u64>),
    ) -> (i64, AxisStatus) {
        let true_pulses = self.told(self.travel);
        let secs = |from: u64| Seconds((tick - from) as f64 * TICK.0 as f64 * 1e-9);
        let is_off = |pulses: i64, tolerance_mm: f64| {
            (true_pulses - pulses).abs() as f64 * MM_PER_PULSE > tolerance_mm
        };
        let is_still = self.is_still(now, going.command);
        let target = going.command.target_pulses;
        if stopped_tick.is_none() {
            let since = secs(start_tick);
            let is_over = since.0 >= course.duration().0;
            let is_there = !is_off(target, REST_TOLERANCE_MM);
            if is_still && is_over && is_there {
                self.motion = Motion::Rest;
                self.rests_at = Some(target);
                return (target, AxisStatus(0));
            }
            let is_cut_short = self.stopped_at.is_some() || is_still && !is_there;
            if !is_cut_short {
                let here = pulses_of(course.position(since));
                let way = (here - self.told(going.from)).abs() as f64 * MM_PER_PULSE;
                let tolerance =
                    REST_TOLERANCE_MM + going.command.speed.0 * LAG.0 + SPEED_TOLERANCE * way;
                // The truth, where it is not the course: who checks the path sees it.
                let told = if is_off(here, tolerance) {
                    true_pulses
                } else {
                    here
                };
                return (told, AxisStatus::MOVING);
            }
            let course = course.stopped_at(since);
            let here = pulses_of(course.position(Seconds(0.0)));
            self.motion = Motion::Moving {
                going,
                course,
                start_tick,
                stopped_tick: Some(tick),
            };
            return (here, AxisStatus::MOVING | AxisStatus::STOPPING);
        }
        if is_still {
            self.motion = Motion::Rest;
            self.rests_at = None;
            return (true_pulses, AxisStatus(0));
        }
        let here = pulses_of(course.position(secs(stopped_tick.unwrap_or(tick))));
        (here, AxisStatus::MOVING | AxisStatus::STOPPING)
    }

    /// Where it was commanded to be as long as it is about there, else where it is.
    fn at_rest(&self, true_pulses: i64) -> i64 {
        let near =
            |told: &i64| (told - true_pulses).abs() as f64 * MM_PER_PULSE <= REST_TOLERANCE_MM;
        self.rests_at.filter(near).unwrap_or(true_pulses)
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

    fn has_status_moved(&self) -> bool {
        self.status
            .is_some_and(|status| status.crosshead != Crosshead::Stopped)
    }

    /// Longest time without a new travel of a crosshead that moves.
    fn still(&self, command: MoveTo) -> Nanos {
        let pulses = STILL_PULSES * MM_PER_PULSE / command.speed.0.max(1e-6);
        Nanos(STILL.0 + (pulses * 1e9) as u64)
    }

    fn is_still(&self, now: Nanos, command: MoveTo) -> bool {
        let is_old = now.since(self.travel_changed) > self.still(command);
        is_old || self.pace.has_status && self.status.is_some() && !self.has_status_moved()
    }

    fn is_going(&self) -> bool {
        matches!(self.motion, Motion::LetGo(..) | Motion::Moving { .. })
    }

    /// Asks for an answer.
    fn ask(&mut self, now: Nanos, text: impl Into<Vec<u8>>, asked: Asked) -> Option<Vec<u8>> {
        self.asked = Some((asked, now));
        self.lines_since = 0;
        self.pair = Pair::default();
        Some(text.into())
    }

    /// The answer did not come, or came and made no sense.
    fn lose_answer(&mut self, now: Nanos, quiet: Nanos) {
        self.asked = None;
        self.lost += if quiet == QUIET_LOST { 2 } else { 1 };
        self.stats.resynchronised += 1;
        self.lines.clear();
        self.quiet_until = Some(now + quiet);
        self.quiet = quiet;
        if let Motion::Setting(..) = self.motion {
            self.motion = Motion::Rest;
            self.refuse(
                now,
                "its answer was lost or garbled, so it was not begun; check the cable",
            );
        }
        // It stops at its limit by itself; no reason to wait for that.
        self.stop_due |= self.is_going() && self.lost >= GARBLED_MAX;
    }

    fn on_taken(&mut self, now: Nanos, taken: Taken) {
        if self.asked.is_none() {
            return;
        }
        self.lines_since += 1;
        if let Taken::Line(line) = taken {
            self.on_line(now, &line);
        }
        let lines = match self.asked {
            Some((Asked::Sample, _)) => 2,
            _ => 1,
        };
        if self.asked.is_some() && self.lines_since >= lines {
            self.lose_answer(now, QUIET);
        }
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
    fn attended(&mut self, at: Nanos) {
        self.attended = Some(at);
    }

    fn command(&mut self, now: Nanos, command: RigCommand) {
        if command.is_stopping() {
            return self.stop(now, command);
        }
        if self.orders.len() >= ORDERS_MAX {
            return self.refuse(now, "too many commands at once");
        }
        self.orders.push_back(command);
    }

    fn overtaken(&mut self, now: Nanos, command: RigCommand) {
        self.command(now, command);
    }

    fn received(&mut self, now: Nanos, bytes: &[u8]) {
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
        let is_unattended = self.attended.is_some_and(|at| now.since(at) > ATTENDED_MAX);
        let is_stopped = self.stopped_at.is_some();
        let is_again = self
            .stopped_at
            .is_some_and(|at| now.since(at) >= STOP_AGAIN && self.is_going());
        if self.stop_due || is_again || is_unattended && self.is_going() && !is_stopped {
            return Some(self.write_stop(now));
        }
        if !self.is_going() {
            self.stopped_at = None;
        }
        if let Some((_, sent)) = self.asked {
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
        // Before the first sample nobody knows which way a target is.
        if matches!(self.motion, Motion::Rest)
            && self.tick.is_some()
            && let Some(command) = self.orders.pop_front()
        {
            self.begin(now, command);
        } else if self.is_going()
            && let Some(command) = self.orders.pop_front()
        {
            match command {
                RigCommand::MoveTo(_) | RigCommand::Oscillate(_) => {
                    self.refuse(now, "the crosshead still moves; stop it first");
                }
                other => self.simple(now, other),
            }
        }
        if let Motion::Setting(going, steps) = &mut self.motion
            && let Some((text, asked)) = steps.pop_front()
        {
            if let Some(asked) = asked {
                return self.ask(now, text, asked);
            }
            let going = *going;
            self.motion = Motion::LetGo(going, now);
            // What it said before the letter is old.
            self.status = None;
            self.stopped_at = None;
            self.travel_changed = now;
            self.next_sample = now;
            self.status_at = now;
            self.acknowledge(now, RigCommand::MoveTo(going.command));
            let is_there = going.target == going.from;
            return Some(if is_there { Vec::new() } else { text.into() });
        }
        if self.is_status_due(now) {
            self.status_at = now;
            return self.ask(now, "p", Asked::Status);
        }
        if now >= self.next_sample {
            self.next_sample = now + self.pace.every;
            return self.ask(now, "n", Asked::Sample);
        }
        None
    }

    fn next_at(&self, now: Nanos) -> Nanos {
        match self.asked {
            Some((_, sent)) => sent + ANSWER_MAX,
            None => self.next_sample.max(now),
        }
    }

    fn take_event(&mut self) -> Option<(Nanos, RigEventBody)> {
        self.events.pop_front()
    }

    fn is_dead(&self, _now: Nanos) -> Option<String> {
        (self.lost >= LOST_MAX && !self.stop_due).then(|| {
            "the stand gives no sensible answers any more; it stops at its travel limit; check cable and power"
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
