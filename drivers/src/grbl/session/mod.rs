//! The dialogue with a board that has been set up: ways cut into short jogs, status asked for now and then, stops
//! before everything.
//!
//! Grbl finishes a jog that it has, even when the link is gone. So it gets no more way than it needs to keep its speed:
//! when the link dies, the axis comes to rest by itself. The newest jog in the planner ends at rest (gnea/grbl,
//! planner.c), so what is sent ahead is the way of braking and a little more.

mod answers;
mod stopping;

use super::feed_correction::FeedCorrection;
use super::motion::JogMotion;
use super::pins::EndSwitches;
use super::protocol::{self, GrblLine, GrblParser, GrblState, QUERY};
use super::settings::{BoardParameters, GrblSettings};
use super::times::{POLL, POLL_CLOSELY, REPORT_MAX, RESET_MAX, SILENCE_MAX};
use crate::rig::RigEventBody;
use crate::split_rig::AxisTrack;
use crate::wire::{AnswerQueue, Dialogue, LinkStats, ORDERS_MAX, TOO_MANY_COMMANDS, lock};
use palpate_model::Nanos;
use palpate_model::rig::{MoveTo, RigCommand};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard};

/// Slowest feed that Grbl makes: 1 mm/min (`MINIMUM_FEED_RATE`, config.h).
const FEED_MIN: f64 = 1.0;

/// The track of an axis, shared with the load cell, which looks up its past.
pub type SharedTrack = Arc<Mutex<AxisTrack>>;

struct PendingReset {
    owed: Vec<(u64, RigCommand)>,
    begun: Nanos,
    written: Nanos,
}

pub struct GrblSession {
    settings: GrblSettings,
    facts: BoardParameters,
    track: SharedTrack,
    parser: GrblParser,
    /// The jog whose `ok` is to come.
    open: Option<Nanos>,
    urgent: VecDeque<Vec<u8>>,
    orders: VecDeque<(u64, RigCommand)>,
    answers: AnswerQueue,
    motion: Option<JogMotion>,
    feed_correction: FeedCorrection,
    ends: EndSwitches,
    /// Where it rests, in steps of the board.
    steps: i64,
    /// Offset of the board's steps, in the direction of the rig, from the host's pulses.
    zero: i64,
    is_motor_on: bool,
    queried_at: Option<Nanos>,
    polled: Option<Nanos>,
    heard_at: Nanos,
    looked_at: Nanos,
    /// Stops that a status after them confirms.
    stops: Vec<(u64, RigCommand, Nanos)>,
    reset_pending: Option<PendingReset>,
    state: GrblState,
    /// Why only stops are still executed.
    locked: Option<String>,
    attended_at: Nanos,
    events: VecDeque<(Nanos, RigEventBody)>,
    stats: LinkStats,
}

impl GrblSession {
    #[must_use]
    pub fn new(
        settings: GrblSettings,
        facts: BoardParameters,
        track: SharedTrack,
        stats: LinkStats,
        now: Nanos,
    ) -> Self {
        Self {
            steps: facts.steps,
            settings,
            facts,
            track,
            parser: GrblParser::default(),
            open: None,
            urgent: VecDeque::new(),
            orders: VecDeque::new(),
            answers: AnswerQueue::default(),
            motion: None,
            feed_correction: FeedCorrection::default(),
            ends: EndSwitches::default(),
            zero: 0,
            is_motor_on: false,
            queried_at: None,
            polled: None,
            heard_at: now,
            looked_at: now,
            stops: Vec::new(),
            reset_pending: None,
            state: GrblState::Idle,
            locked: None,
            attended_at: now,
            events: VecDeque::new(),
            stats,
        }
    }

    fn track(&self) -> MutexGuard<'_, AxisTrack> {
        lock(&self.track)
    }

    fn report(&mut self, now: Nanos, body: RigEventBody) {
        self.events.push_back((now, body));
    }

    fn fault(&mut self, now: Nanos, detail: impl Into<String>) {
        self.report(now, RigEventBody::refusal(detail));
    }

    fn acknowledge(&mut self, now: Nanos, number: u64, command: RigCommand) {
        for answer in self.answers.acknowledge(number, command) {
            self.report(now, answer);
        }
    }

    fn refuse(&mut self, now: Nanos, number: u64, detail: impl Into<String>) {
        for answer in self.answers.refuse(number, detail) {
            self.report(now, answer);
        }
    }

    /// Steps of the board in the direction of the rig.
    fn pulses(&self, steps: i64) -> i64 {
        self.settings.sign() * steps
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
            RigCommand::Track(_) => {
                self.refuse(now, number, "Grbl takes no target on the way; move the axis from rest")
            }
            RigCommand::Oscillate(_) => self.refuse(
                now,
                number,
                "Grbl cannot follow a sine; choose a protocol with ramps only",
            ),
            RigCommand::Stop | RigCommand::Halt => self.stop(now, command),
        }
    }

    /// The target of a move in steps of the board and its feed in mm/min, or why the board cannot make it.
    fn plan_move(&self, wanted: &MoveTo) -> Result<(i64, f64), String> {
        if !self.is_motor_on {
            return Err("the motor is off; enable it first".into());
        }
        let settings = &self.settings;
        let scale = 1.0 / (settings.mm_per_pulse * self.facts.steps_per_mm);
        let feed = wanted.speed.0 * scale * 60.0;
        if wanted.speed.0 > settings.speed_max.0 * (1.0 + 1e-9) || feed < FEED_MIN {
            let (speed, least, most) = (wanted.speed, FEED_MIN / 60.0, settings.speed_max);
            return Err(format!(
                "a speed of {speed} is not between Grbl's minimum, {least:.4} mm/s, and the maximum of the rig file, {most}"
            ));
        }
        if (wanted.acceleration.0 / settings.acceleration.0 - 1.0).abs() > 1e-6 {
            let (wanted, own) = (wanted.acceleration, settings.acceleration);
            return Err(format!(
                "the acceleration of {wanted} differs from the board's fixed acceleration of {own}"
            ));
        }
        let to = settings.sign() * (wanted.target_pulses + self.zero);
        // Grbl reads eight digits of a number.
        if (to as f64 / self.facts.steps_per_mm).abs() > 9_999.0 {
            return Err("the target is more than ten metres from the board's zero".into());
        }
        Ok((to, feed))
    }

    fn begin_move(&mut self, now: Nanos, number: u64, wanted: MoveTo) {
        let (to, feed) = match self.plan_move(&wanted) {
            Ok(planned) => planned,
            Err(why) => return self.refuse(now, number, why),
        };
        if to == self.steps {
            // Grbl makes nothing of a way that is none; a sample shows it as a motion all the same.
            let profile = JogMotion::profile(0.0, &wanted);
            let here = self.pulses(self.steps) as f64;
            self.track().begin_motion(now, here, profile, 0.0);
            self.track().begin_rest(now, here as i64);
            return self.acknowledge(now, number, RigCommand::MoveTo(wanted));
        }
        self.feed_correction.begin();
        let mm_per_pulse = self.settings.mm_per_pulse;
        let motion = JogMotion::new(number, wanted, self.steps, to, feed, mm_per_pulse);
        self.ends.begin_motion(self.is_outwards(&motion));
        self.motion = Some(motion);
    }

    fn is_outwards(&self, motion: &JogMotion) -> bool {
        motion.direction() * self.settings.sign() as f64 > 0.0
    }

    fn poll_every(&self, now: Nanos) -> Nanos {
        let Some(motion) = &self.motion else {
            return POLL;
        };
        let is_inwards = !self.is_outwards(motion);
        let is_ending = motion.is_all_sent()
            && motion.started.is_some_and(|started| now >= started + motion.duration());
        if motion.cancelled.is_some() || is_inwards || is_ending { POLL_CLOSELY } else { POLL }
    }

    fn take_query(&mut self, now: Nanos) -> Option<Vec<u8>> {
        let is_free = self.queried_at.is_none_or(|queried_at| now.since(queried_at) > REPORT_MAX);
        let is_due = self.polled.is_none_or(|at| now.since(at) >= self.poll_every(now));
        if !is_free || !is_due {
            return None;
        }
        self.queried_at = Some(now);
        self.polled = Some(now);
        Some(vec![QUERY])
    }

    /// The next jog of the motion under way, when its turn has come.
    fn take_jog(&mut self, now: Nanos) -> Option<Vec<u8>> {
        if self.open.is_some() {
            return None;
        }
        let axis = self.settings.axis;
        let steps_per_mm = self.facts.steps_per_mm;
        let motion = self.motion.as_mut().filter(|motion| motion.cancelled.is_none())?;
        let end = motion.next_chunk(now, self.settings.mm_per_pulse)?;
        let feed = motion.feed * self.feed_correction.feed();
        let line = protocol::jog(axis, end as f64 / steps_per_mm, feed);
        self.open = Some(now);
        Some(line.into_bytes())
    }
}

impl Dialogue for GrblSession {
    fn note_attendance(&mut self, at: Nanos) {
        self.attended_at = at;
    }

    fn command(&mut self, now: Nanos, command: RigCommand) {
        if command.is_stopping() {
            return self.stop(now, command);
        }
        let number = self.answers.owe();
        if let Some(why) = self.locked.clone() {
            self.refuse(now, number, why);
        } else if self.orders.len() >= ORDERS_MAX {
            self.refuse(now, number, TOO_MANY_COMMANDS);
        } else {
            self.orders.push_back((number, command));
        }
    }

    fn handle_bytes(&mut self, now: Nanos, bytes: &[u8]) {
        for byte in bytes {
            match self.parser.take(*byte) {
                Some(GrblLine::Ok) => self.on_ok(now),
                Some(GrblLine::Refused(refusal)) => self.on_refusal(now, &refusal),
                Some(GrblLine::Alarm(alarm)) => self.on_alarm(now, &alarm),
                Some(GrblLine::Hello(_)) => self.on_hello(now),
                Some(GrblLine::Status(status)) => self.on_status(now, &status),
                // Settings and messages are in the log of raw bytes.
                Some(GrblLine::Setting(..) | GrblLine::Message(_)) | None => {}
                Some(GrblLine::Other(_) | GrblLine::Flood) => self.stats.resynchronised += 1,
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
        if let Some(reset_pending) = &self.reset_pending
            && now.since(reset_pending.begun) > RESET_MAX
        {
            let silence = RESET_MAX.0 as f64 * 1e-9;
            return Some(format!(
                "the board has not answered a reset for {silence} s, so the axis may still move; use the emergency stop"
            ));
        }
        let is_unsure = self.locked.is_none() || self.state.is_moving();
        let is_silent = now.since(self.heard_at) > SILENCE_MAX && is_unsure;
        is_silent.then(|| {
            let silence = SILENCE_MAX.0 as f64 * 1e-9;
            format!("the board has sent nothing for {silence} s; the axis comes to rest by itself; check cable and power")
        })
    }

    fn stats(&self) -> LinkStats {
        self.stats
    }
}

impl Drop for GrblSession {
    /// When the thread ends, such as when the port is gone, jogs that the board has end in the track too.
    fn drop(&mut self) {
        self.settle_track(self.looked_at);
    }
}
