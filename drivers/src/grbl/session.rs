//! The dialogue with a board that has been set up: ways cut into short jogs, status asked for now and then, stops
//! before everything.
//!
//! A jog that Grbl has is done whether anybody is there or not. So it gets no more way than it needs to keep its speed:
//! when the link dies, the axis comes to rest by itself. The newest jog in the planner ends at rest (gnea/grbl,
//! planner.c), so what is sent ahead is the way of braking and a little more.

use super::error::{Alarm, Refusal};
use super::motion::Motion;
use super::pace::Pace;
use super::pins::Ends;
use super::protocol::{
    self, CYCLE_START, Incoming, JOG_CANCEL, Parser, QUERY, RESET, State, Status,
};
use super::settings::{Facts, GrblSettings};
use super::times::{
    ATTENDED_MAX, CANCEL_AGAIN, OK_MAX, PAUSE, POLL, POLL_CLOSELY, REPORT_MAX, RESET_AGAIN,
    RESET_MAX, SEGMENTS, SILENCE_MAX, STOP_MAX,
};
use crate::parts::Track;
use crate::rig::RigEventBody;
use crate::wire::{Answers, Dialogue, LinkStats};
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Fault, MoveTo, RigCommand};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Slowest feed that Grbl makes: 1 mm/min (`MINIMUM_FEED_RATE`, config.h).
const FEED_MIN: f64 = 1.0;
/// Commands that wait; as many as may wait on the way here.
const ORDERS_MAX: usize = 64;

/// Why a motion is not begun.
const OVERTAKEN: &str = "a stop came first, so it was not begun";

/// What happens with an axis, shared with whoever needs its past.
pub type SharedTrack = Arc<Mutex<Track>>;

/// A reset whose welcome is to come.
struct Halt {
    /// The stops that it does.
    owed: Vec<(u64, RigCommand)>,
    begun: Nanos,
    written: Nanos,
}

/// The dialogue.
pub struct Session {
    settings: GrblSettings,
    facts: Facts,
    track: SharedTrack,
    parser: Parser,
    /// The jog whose `ok` is to come.
    open: Option<Nanos>,
    urgent: VecDeque<Vec<u8>>,
    orders: VecDeque<(u64, RigCommand)>,
    answers: Answers,
    motion: Option<Motion>,
    pace: Pace,
    ends: Ends,
    /// Where it rests, in steps of the board.
    steps: i64,
    /// What the board's steps, in the direction of the rig, are more than the host's pulses.
    zero: i64,
    is_motor_on: bool,
    asked: Option<Nanos>,
    polled: Option<Nanos>,
    heard: Nanos,
    looked: Nanos,
    /// Stops that a status after them will confirm.
    stops: Vec<(u64, RigCommand, Nanos)>,
    halt: Option<Halt>,
    /// The newest state that is known.
    state: State,
    /// Why nothing but stops is done any more.
    locked: Option<String>,
    attended: Nanos,
    events: VecDeque<(Nanos, RigEventBody)>,
    stats: LinkStats,
}

impl Session {
    /// With a board that was set up just now.
    #[must_use]
    pub fn new(
        settings: GrblSettings,
        facts: Facts,
        track: SharedTrack,
        stats: LinkStats,
        now: Nanos,
    ) -> Self {
        Self {
            steps: facts.steps,
            settings,
            facts,
            track,
            parser: Parser::default(),
            open: None,
            urgent: VecDeque::new(),
            orders: VecDeque::new(),
            answers: Answers::default(),
            motion: None,
            pace: Pace::default(),
            ends: Ends::default(),
            zero: 0,
            is_motor_on: false,
            asked: None,
            polled: None,
            heard: now,
            looked: now,
            stops: Vec::new(),
            halt: None,
            state: State::Idle,
            locked: None,
            attended: now,
            events: VecDeque::new(),
            stats,
        }
    }

    fn track(&self) -> MutexGuard<'_, Track> {
        self.track.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn report(&mut self, now: Nanos, body: RigEventBody) {
        self.events.push_back((now, body));
    }

    fn fault(&mut self, now: Nanos, detail: impl Into<String>) {
        let detail = detail.into();
        self.report(now, RigEventBody::Fault(Fault::CommandRefused { detail }));
    }

    fn acknowledge(&mut self, now: Nanos, number: u64, command: RigCommand) {
        self.answers.acknowledge(number, command);
        self.tell_answers(now);
    }

    fn refuse(&mut self, now: Nanos, number: u64, detail: impl Into<String>) {
        self.answers.refuse(number, detail);
        self.tell_answers(now);
    }

    fn tell_answers(&mut self, now: Nanos) {
        while let Some(body) = self.answers.take() {
            self.report(now, body);
        }
    }

    /// Steps of the board in the direction of the rig.
    fn pulses(&self, steps: i64) -> i64 {
        self.settings.sign() * steps
    }

    /// Nothing that waits is begun any more.
    fn drop_orders(&mut self, now: Nanos, why: &str) {
        let waiting: Vec<u64> = self.orders.drain(..).map(|(number, _)| number).collect();
        for number in waiting {
            self.refuse(now, number, why);
        }
        if let Some(number) = self.motion.as_mut().and_then(|motion| motion.owed.take()) {
            self.refuse(now, number, why);
        }
    }

    /// No motion that waits is begun any more.
    fn drop_motions(&mut self, now: Nanos, why: &str) {
        for (number, order) in std::mem::take(&mut self.orders) {
            if matches!(order, RigCommand::MoveTo(_) | RigCommand::Oscillate(_)) {
                self.refuse(now, number, why);
            } else {
                self.orders.push_back((number, order));
            }
        }
        if let Some(number) = self.motion.as_mut().and_then(|motion| motion.owed.take()) {
            self.refuse(now, number, why);
        }
    }

    /// Brakes whatever moves.
    fn cancel(&mut self, now: Nanos) {
        self.urgent.push_back(vec![JOG_CANCEL]);
        if let Some(motion) = &mut self.motion {
            motion.cancelled.get_or_insert(now);
            motion.repeated = now;
            if motion.started.is_some() && !std::mem::replace(&mut motion.is_braking, true) {
                let from = now + Nanos(SEGMENTS.0 + self.facts.round_trip.0 / 2);
                self.track().brakes(from);
            }
        }
        // Its answer shows what has become of it.
        self.asked = None;
        self.polled = None;
    }

    /// Ends the motion under way, which may be one that nobody was told of yet.
    fn end(&mut self, now: Nanos, why: &str) {
        match self.motion.as_mut().and_then(|motion| motion.owed.take()) {
            Some(number) => self.refuse(now, number, why),
            None => self.fault(now, why),
        }
        self.cancel(now);
    }

    /// Something is wrong that the operator has to look at.
    fn lock(&mut self, now: Nanos, why: &str) {
        if self.locked.is_none() {
            self.locked = Some(why.to_owned());
            self.drop_orders(now, why);
        }
        self.open = None;
        let here = self.track().at(now).pulses.round() as i64;
        if self.motion.take().is_some() {
            self.track().rest(now, here);
        }
        if self.state.is_moving() {
            // A status that shows it at rest answers them.
            return;
        }
        for (number, command, _) in std::mem::take(&mut self.stops) {
            self.acknowledge(now, number, command);
        }
    }

    /// Jogs that the board has are done though no more come: what is known of the way.
    fn leave(&mut self, now: Nanos) {
        let Some(motion) = self.motion.take() else {
            return;
        };
        let given = motion.given(self.settings.mm_per_pulse);
        let sign = self.settings.sign() as f64;
        match (motion.started, self.open) {
            (Some(_), _) if !motion.is_braking => self.track().shortened(given),
            (None, Some(written)) => {
                let pulses_per_mm = sign * motion.side() / self.settings.mm_per_pulse;
                let from = sign * motion.from as f64;
                // It may have begun; nobody has said so.
                self.track()
                    .moves(written.min(now), from, given, pulses_per_mm);
            }
            _ => {}
        }
        self.track().ends();
    }

    /// Resets the board, again and again until its welcome.
    fn reset(&mut self, now: Nanos, number: u64, command: RigCommand) {
        self.urgent.push_front(vec![RESET]);
        self.leave(now);
        self.open = None;
        self.halt = Some(Halt {
            owed: vec![(number, command)],
            begun: now,
            written: now,
        });
        self.locked = Some(
            "it was cut short by a reset and its position is lost; open the rig again and home it"
                .into(),
        );
        self.drop_orders(now, OVERTAKEN);
    }

    fn stop(&mut self, now: Nanos, command: RigCommand) {
        let number = self.answers.owe();
        self.drop_motions(now, OVERTAKEN);
        if let Some(halt) = &mut self.halt {
            halt.owed.push((number, command));
            return;
        }
        let is_moving = self.motion.is_some() || self.open.is_some() || self.state.is_moving();
        // What is no jog is not ended by the cancel of a jog.
        let is_foreign = matches!(self.state, State::Run | State::Home);
        if is_foreign || command == RigCommand::Halt && is_moving {
            return self.reset(now, number, command);
        }
        self.cancel(now);
        if self.locked.is_some() && !self.state.is_moving() {
            // It stands, and after a limit switch it answers nothing but a reset.
            return self.acknowledge(now, number, command);
        }
        self.stops.push((number, command, now));
    }

    fn begin(&mut self, now: Nanos, number: u64, command: RigCommand) {
        match command {
            RigCommand::EnableMotor => {
                // With $1=255 the motor is always on; a lock would have been noticed.
                self.is_motor_on = true;
                self.acknowledge(now, number, command);
            }
            RigCommand::DefinePosition { pulses } => {
                self.zero = self.pulses(self.steps) - pulses;
                self.acknowledge(now, number, command);
            }
            RigCommand::MoveTo(wanted) => self.begin_move(now, number, wanted),
            RigCommand::Oscillate(_) => self.refuse(
                now,
                number,
                "Grbl makes no sines; choose a protocol of ramps",
            ),
            RigCommand::Stop | RigCommand::Halt => self.stop(now, command),
        }
    }

    fn begin_move(&mut self, now: Nanos, number: u64, wanted: MoveTo) {
        if !self.is_motor_on {
            return self.refuse(now, number, "the motor is off; enable it first");
        }
        let settings = &self.settings;
        let scale = 1.0 / (settings.mm_per_pulse * self.facts.steps_per_mm);
        let feed = wanted.speed.0 * scale * 60.0;
        if wanted.speed.0 > settings.speed_max.0 * (1.0 + 1e-9) || feed < FEED_MIN {
            let (speed, most) = (wanted.speed, settings.speed_max);
            let least = FEED_MIN / 60.0;
            return self.refuse(
                now,
                number,
                format!("a speed of {speed} is not between {least:.4} mm/s, the slowest of Grbl, and the {most} of the rig file"),
            );
        }
        if (wanted.acceleration.0 / settings.acceleration.0 - 1.0).abs() > 1e-6 {
            let (wanted, own) = (wanted.acceleration, settings.acceleration);
            return self.refuse(
                now,
                number,
                format!("an acceleration of {wanted} is not the {own} that the board is set to"),
            );
        }
        let to = self.settings.sign() * (wanted.target_pulses + self.zero);
        // Grbl reads eight digits of a number.
        if (to as f64 / self.facts.steps_per_mm).abs() > 9_999.0 {
            return self.refuse(now, number, "the target is more than ten metres away");
        }
        if to == self.steps {
            // Grbl makes nothing of a way that is none; a sample shows it as a motion all the same.
            let profile = Motion::profile(0.0, &wanted);
            let here = self.pulses(self.steps) as f64;
            self.track().moves(now, here, profile, 0.0);
            self.track().rest(now, here as i64);
            return self.acknowledge(now, number, RigCommand::MoveTo(wanted));
        }
        self.pace.begin();
        let mm_per_pulse = self.settings.mm_per_pulse;
        let motion = Motion::new(number, wanted, self.steps, to, feed, mm_per_pulse);
        self.ends.leave(self.is_outwards(&motion));
        self.motion = Some(motion);
    }

    fn on_ok(&mut self, now: Nanos) {
        let Some(written) = self.open.take() else {
            // An answer that came late, after its line was given up.
            self.stats.resynchronised += 1;
            return;
        };
        self.stats.push(now.since(written));
        let sign = self.settings.sign() as f64;
        let Some(motion) = self.motion.as_mut() else {
            return;
        };
        if motion.started.is_none() && motion.cancelled.is_none() {
            // Grbl begins as soon as it has planned the first jog, and says `ok` then.
            let started = Nanos(now.0.saturating_sub(self.facts.round_trip.0 / 2)).max(written);
            motion.started = Some(started);
            let from = sign * motion.from as f64;
            let pulses_per_mm = sign * motion.side() / self.settings.mm_per_pulse;
            let (profile, owed, wanted) = (motion.profile, motion.owed.take(), motion.wanted);
            self.track().moves(started, from, profile, pulses_per_mm);
            if let Some(number) = owed {
                self.acknowledge(now, number, RigCommand::MoveTo(wanted));
            }
        }
    }

    fn on_refusal(&mut self, now: Nanos, refusal: &Refusal) {
        if self.open.take().is_none() {
            self.stats.resynchronised += 1;
            return;
        }
        let Some(motion) = self.motion.as_mut() else {
            return;
        };
        if let Some(number) = motion.owed.take() {
            self.motion = None;
            self.refuse(now, number, refusal.to_string());
        } else if motion.cancelled.is_none() {
            self.fault(
                now,
                format!("a part of a motion was refused and the axis is stopped: {refusal}"),
            );
            self.cancel(now);
        }
    }

    fn on_alarm(&mut self, now: Nanos, alarm: &Alarm) {
        if self.halt.is_some() {
            return;
        }
        self.state = State::Alarm;
        self.lock(now, &alarm.to_string());
        self.fault(now, alarm.to_string());
    }

    fn on_hello(&mut self, now: Nanos) {
        self.heard = now;
        self.asked = None;
        // Nothing is in motion after a reset.
        self.state = State::Idle;
        if let Some(halt) = self.halt.take() {
            let here = self.track().at(now).pulses.round() as i64;
            self.track().rest(now, here);
            for (number, command) in halt.owed {
                self.acknowledge(now, number, command);
            }
        } else {
            self.lock(now, "the board was reset; open the rig again");
        }
        self.is_motor_on = false;
        self.report(now, RigEventBody::Fault(Fault::ControllerReset));
    }

    /// Machine position of the axis in steps of the board.
    fn steps_of(&self, status: &Status) -> Option<i64> {
        let mm = status.machine.as_ref()?.get(self.settings.index())?;
        Some((mm * self.facts.steps_per_mm).round() as i64)
    }

    fn on_status(&mut self, now: Nanos, status: &Status) {
        self.heard = now;
        let asked = self.asked.take();
        if let Some(asked) = asked {
            self.stats.push(now.since(asked));
        }
        self.state = status.state;
        if self.halt.is_some() {
            return;
        }
        let asked = asked.unwrap_or(now);
        // A stop is done when nothing moves, and no jog is on its way that would.
        let is_at_rest = !status.state.is_moving() && self.open.is_none();
        let braking = self.motion.as_ref().map_or(Nanos::ZERO, |motion| {
            Nanos((motion.wanted.speed.0 / motion.wanted.acceleration.0 * 1e9) as u64)
        });
        let is_jog = status.state == State::Jog;
        // An axis that brakes slowly is braking still.
        let is_slow = |at| is_jog && now.since(at) > STOP_MAX && now.since(at) < braking;
        let (confirmed, waiting): (Vec<_>, Vec<_>) = std::mem::take(&mut self.stops)
            .into_iter()
            .partition(|(_, _, at)| *at <= asked && (is_at_rest || is_slow(*at)));
        self.stops = waiting;
        for (number, command, _) in confirmed {
            self.acknowledge(now, number, command);
        }
        let Some(steps) = self.steps_of(status) else {
            return self.lock_with(now, "it reports no machine position; set $10=1");
        };
        self.on_pins(now, status, steps);
        match status.state {
            State::Idle => self.on_idle(now, asked, steps),
            State::Jog => self.on_jog(now, asked, steps),
            State::Alarm if self.locked.is_some() => {}
            State::Alarm => self.lock_with(
                now,
                "it is locked; look at the axis, then open the rig again",
            ),
            other => {
                let why = format!(
                    "it is in state {other:?}, which palpate never asks for; press reset and open the rig again"
                );
                self.lock_with(now, &why);
            }
        }
    }

    fn lock_with(&mut self, now: Nanos, why: &str) {
        if self.locked.is_none() {
            self.lock(now, why);
            self.fault(now, why);
        }
    }

    /// What the pins mean, and a stop at those at which Grbl does not stop.
    fn on_pins(&mut self, now: Nanos, status: &Status, steps: i64) {
        let is_known = self.track().at(now).status;
        let pulses = self.pulses(steps);
        let mut inputs = self.ends.inputs(&self.settings, status, is_known, pulses);
        let going = self.motion.as_ref().filter(|it| it.cancelled.is_none());
        let is_far = inputs.has(AxisStatus::FORWARD_LIMIT);
        let is_closing = is_far && !is_known.has(AxisStatus::FORWARD_LIMIT);
        match going.map(|motion| self.is_outwards(motion)) {
            // Grbl ends the jogs that it has and begins the next (doc/markdown/jogging.md).
            Some(_) if status.has_pin('H') => self.end(
                now,
                "the hold button of the board is pressed, so the axis is stopped",
            ),
            Some(true) if is_far => {
                // Of one under way the samples tell it.
                if let Some(number) = self.motion.as_mut().and_then(|motion| motion.owed.take()) {
                    self.refuse(now, number, "the far limit switch is closed");
                }
                self.cancel(now);
            }
            // Whichever end it is.
            Some(false) if is_closing => self.end(
                now,
                "a limit switch has closed on the way to home where none is expected, so the axis is stopped; look at it",
            ),
            _ => {}
        }
        if self.is_motor_on {
            inputs = inputs | AxisStatus::MOTOR_ON;
        }
        self.track().inputs(now, inputs);
    }

    /// Into the tissue.
    fn is_outwards(&self, motion: &Motion) -> bool {
        motion.side() * self.settings.sign() as f64 > 0.0
    }

    fn on_idle(&mut self, now: Nanos, asked: Nanos, steps: i64) {
        let Some(motion) = &self.motion else {
            if steps != self.steps {
                let by = self.pulses(steps - self.steps);
                self.steps = steps;
                let here = self.pulses(steps);
                self.track().rest(now, here);
                self.fault(
                    now,
                    format!("the axis has moved by {by} pulses by itself; home it again"),
                );
            }
            return;
        };
        if self.open.is_some() {
            return;
        }
        match (motion.cancelled, motion.started) {
            (Some(cancelled), _) if asked >= cancelled => {
                self.urgent.push_back(vec![CYCLE_START]);
                if motion.is_doubtful
                    && let Some(motion) = &mut self.motion
                {
                    // A jog that was not read yet begins now; it is cancelled until a report after this shows rest.
                    motion.is_doubtful = false;
                    motion.cancelled = Some(now);
                    return;
                }
            }
            (None, Some(started)) if asked > started + Nanos::from_millis(20) => {
                if !motion.is_all_sent() {
                    self.fault(now, "the link is too slow to keep the axis moving, so it has stopped; lower the speed or mend the link");
                } else if steps != motion.to {
                    let (there, wanted) = (self.pulses(steps), self.pulses(motion.to));
                    self.fault(now, format!("the axis ended at {there} where {wanted} was commanded, in its own pulses; home it again"));
                }
            }
            _ => return,
        }
        self.steps = steps;
        self.motion = None;
        let here = self.pulses(steps);
        self.track().rest(now, here);
    }

    fn on_jog(&mut self, now: Nanos, asked: Nanos, steps: i64) {
        let Some(motion) = &self.motion else {
            if self.open.is_none() {
                self.cancel(now);
            }
            return;
        };
        if motion.cancelled.is_some() || motion.started.is_none() {
            return;
        }
        // The report is of a time between its question and now.
        let early = self.track().at(asked).pulses;
        let late = self.track().at(now).pulses;
        let here = self.pulses(steps) as f64;
        // Start and segments are known to some hundredths of a second; a garbled target is further off.
        let slack = (0.15 * motion.wanted.speed.0 + 0.1) / self.settings.mm_per_pulse;
        if here < early.min(late) - slack || here > early.max(late) + slack {
            self.fault(now, format!("the axis is at {here:.0} where {late:.0} was expected, in its own pulses, and is stopped; check the cable and home it"));
            return self.cancel(now);
        }
        let sampled = asked + Nanos(self.facts.round_trip.0 / 2);
        if let Some(ahead) = motion.ahead(sampled, steps, self.settings.mm_per_pulse) {
            let step = self.settings.mm_per_pulse / motion.wanted.speed.0;
            self.pace.told(asked, now, ahead.0, step);
        }
    }

    fn poll_every(&self, now: Nanos) -> Nanos {
        let Some(motion) = &self.motion else {
            return POLL;
        };
        let is_inwards = !self.is_outwards(motion);
        let is_ending = motion.is_all_sent()
            && motion
                .started
                .is_some_and(|started| now >= started + motion.duration());
        if motion.cancelled.is_some() || is_inwards || is_ending {
            POLL_CLOSELY
        } else {
            POLL
        }
    }

    fn take_query(&mut self, now: Nanos) -> Option<Vec<u8>> {
        let is_free = self.asked.is_none_or(|asked| now.since(asked) > REPORT_MAX);
        let is_due = self
            .polled
            .is_none_or(|at| now.since(at) >= self.poll_every(now));
        if !is_free || !is_due {
            return None;
        }
        self.asked = Some(now);
        self.polled = Some(now);
        Some(vec![QUERY])
    }

    /// Reasons to stop that nobody has asked for.
    fn watch(&mut self, now: Nanos) {
        let pause = now.since(std::mem::replace(&mut self.looked, now));
        if pause > PAUSE {
            self.heard = self.heard + pause;
        }
        if self.open.is_some_and(|at| now.since(at) > OK_MAX) {
            self.open = None;
            self.stats.resynchronised += 1;
            if let Some(motion) = &mut self.motion {
                motion.is_doubtful = true;
            }
            if let Some(number) = self.motion.as_mut().and_then(|motion| motion.owed.take()) {
                self.refuse(
                    now,
                    number,
                    "its answer was lost, so the axis was stopped; check the cable",
                );
                self.cancel(now);
            } else if self
                .motion
                .as_ref()
                .is_some_and(|motion| motion.cancelled.is_none())
            {
                self.fault(
                    now,
                    "an answer was lost in a motion, so the axis is stopped; check the cable",
                );
                self.cancel(now);
            }
        }
        if let Some(halt) = &mut self.halt
            && now.since(halt.written) >= RESET_AGAIN
        {
            halt.written = now;
            self.urgent.push_front(vec![RESET]);
        }
        let is_wanted = std::mem::take(&mut self.track().is_stop_wanted);
        let is_unattended = now.since(self.attended) > ATTENDED_MAX;
        if is_wanted {
            self.drop_motions(now, "the load cell has failed, so it was not begun");
        } else if is_unattended {
            let why = "nobody took samples for half a second, so it was not begun";
            self.drop_motions(now, why);
        }
        let Some(motion) = &mut self.motion else {
            return;
        };
        match motion.cancelled {
            Some(_) if now.since(motion.repeated) >= CANCEL_AGAIN => {
                motion.repeated = now;
                self.urgent.push_back(vec![JOG_CANCEL]);
            }
            Some(_) => {}
            None if is_wanted => self.cancel(now),
            None if is_unattended => {
                self.end(
                    now,
                    "nobody took samples for half a second, so the axis is stopped",
                );
            }
            None => {}
        }
    }

    /// The next jog of the motion under way, when its turn has come.
    fn take_jog(&mut self, now: Nanos) -> Option<Vec<u8>> {
        if self.open.is_some() {
            return None;
        }
        let axis = self.settings.axis;
        let steps_per_mm = self.facts.steps_per_mm;
        let motion = self
            .motion
            .as_mut()
            .filter(|motion| motion.cancelled.is_none())?;
        let end = motion.next_chunk(now, self.settings.mm_per_pulse)?;
        let feed = motion.feed * self.pace.feed();
        let line = protocol::jog(axis, end as f64 / steps_per_mm, feed);
        self.open = Some(now);
        Some(line.into_bytes())
    }
}

impl Dialogue for Session {
    fn attended(&mut self, at: Nanos) {
        self.attended = at;
    }

    fn command(&mut self, now: Nanos, command: RigCommand) {
        if command.is_stopping() {
            return self.stop(now, command);
        }
        let number = self.answers.owe();
        if let Some(why) = self.locked.clone() {
            self.refuse(now, number, why);
        } else if self.orders.len() >= ORDERS_MAX {
            self.refuse(now, number, "too many commands at once");
        } else {
            self.orders.push_back((number, command));
        }
    }

    fn overtaken(&mut self, now: Nanos, command: RigCommand) {
        // The stop that comes next ends it, if it is a motion.
        self.command(now, command);
    }

    fn received(&mut self, now: Nanos, bytes: &[u8]) {
        for byte in bytes {
            match self.parser.take(*byte) {
                Some(Incoming::Ok) => self.on_ok(now),
                Some(Incoming::Refused(refusal)) => self.on_refusal(now, &refusal),
                Some(Incoming::Alarm(alarm)) => self.on_alarm(now, &alarm),
                Some(Incoming::Hello(_)) => self.on_hello(now),
                Some(Incoming::Status(status)) => self.on_status(now, &status),
                // Settings and messages are in the log of raw bytes.
                Some(Incoming::Setting(..) | Incoming::Message(_)) | None => {}
                Some(Incoming::Other(_) | Incoming::Flood) => self.stats.resynchronised += 1,
            }
        }
    }

    fn take_line(&mut self, now: Nanos) -> Option<Vec<u8>> {
        self.watch(now);
        if let Some(bytes) = self.urgent.pop_front() {
            return Some(bytes);
        }
        if let Some(bytes) = self.take_query(now) {
            return Some(bytes);
        }
        if self.motion.is_none()
            && self.open.is_none()
            && let Some((number, command)) = self.orders.pop_front()
        {
            self.begin(now, number, command);
        }
        self.take_jog(now)
    }

    fn next_at(&self, now: Nanos) -> Nanos {
        // A millisecond is short against all that is waited for here.
        now + Nanos::from_millis(1)
    }

    fn take_event(&mut self) -> Option<(Nanos, RigEventBody)> {
        self.events.pop_front()
    }

    fn is_dead(&self, now: Nanos) -> Option<String> {
        // A board that a limit switch has locked says nothing before it is reset, and nothing moves.
        if let Some(halt) = &self.halt
            && now.since(halt.begun) > RESET_MAX
        {
            let silence = RESET_MAX.0 as f64 * 1e-9;
            return Some(format!(
                "the board has not answered a reset for {silence} s; the axis comes to rest by itself, unless somebody else moves it: use the emergency stop"
            ));
        }
        let is_unsure = self.locked.is_none() || self.state.is_moving();
        let is_silent = now.since(self.heard) > SILENCE_MAX && is_unsure;
        is_silent.then(|| {
            let silence = SILENCE_MAX.0 as f64 * 1e-9;
            format!("the board has said nothing for {silence} s; check cable and power. The axis comes to rest by itself")
        })
    }

    fn stats(&self) -> LinkStats {
        self.stats
    }
}

impl Drop for Session {
    /// However its thread ends, such as with a port that is gone: what the board was given ends in the track too.
    fn drop(&mut self) {
        self.leave(self.looked);
    }
}
