//! The dialogue with the board, without a port and without a clock: bytes in, bytes out.
//!
//! One packet is under way at a time, and its answer is due before the next; only a zero does not wait. A late or strange answer
//! ends the force, and then the line is silent until nothing arrives any more, so that answers and packets belong together again.

use super::message::{
    ANSWER, BoardSetup, DEVICE, TORQUE_MAX_N_M, parse_angles, write_first, write_torques,
    write_zero,
};
use crate::fit::WorkspaceFit;
use crate::gate::{ForceGate, ForceLimits, ForceStop, ReportState};
use crate::hand_over::{LinkReport, NO_POSE, SensedPose};
use palpate_haptics::rig::Pantograph;
use palpate_haptics::scene::Pose;
use palpate_model::Nanos;
use serde::Serialize;
use std::collections::VecDeque;

/// A packet at least this often.
pub const BEAT: Nanos = Nanos::from_millis(1);
/// Silence after which nothing of before arrives any more: some of the longest ways over USB.
const QUIET: Nanos = Nanos::from_millis(10);
/// Time for the answer after it.
const PROBE_MAX: Nanos = Nanos::from_millis(10);
/// From one zero to the next to a board that has lost the arm's place.
const LOST_BEAT: Nanos = Nanos::from_millis(100);
/// Time without a good answer after which the port is opened again: the firmware waits a second for the rest of a packet.
const LOST_MAX: Nanos = Nanos::from_millis(1_500);
/// No arm turns further.
const DEGREES_MAX: f64 = 360.0;
/// Span in which the speed is measured: some counts of a hand, and short beside the 50 ms in which an arm runs away.
const SPEED_SPAN: Nanos = Nanos::from_millis(4);
/// Places kept for it, some more than a span has.
const TRACK_MAX: usize = 16;
/// A place may be this far from the last in addition to four times the largest speed, in mm: some counts of both encoders. Encoders
/// that count steps do not come back from a jump.
const JUMP_MM: f64 = 2.0;

palpate_model::named! {
    /// What is wrong with an answer.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum HapiFault {
        /// Bytes that no packet waits for.
        Unexpected = "bytes arrive that answer no packet",
        /// Of another device, or not an answer.
        OtherDevice = "the answer is of a different device",
        /// No finite angles, or angles that the links do not allow.
        Angles = "the angles are not finite, or the links do not allow them",
        /// Farther from the last place than any hand moves: the encoders have lost count.
        Jump = "the position jumps, and with it the home position is lost",
        /// The board knows no motors.
        Restarted = "the board has restarted and lost its home position",
    }
}

/// How packets and answers belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineState {
    /// Answers follow packets.
    Talking,
    /// Nothing but zeros is sent until nothing has arrived since so long.
    Quiet { since: Nanos },
    /// The answer to a zero after that is due.
    Probing { since: Nanos },
    /// The board has lost the arm's place: a person must open the device again. Zeros are sent all the same, the first with a
    /// set-up.
    Lost { sent_at: Option<Nanos> },
}

/// One board on one port.
#[derive(Debug)]
pub struct Exchange {
    linkage: Pantograph,
    setup: BoardSetup,
    fit: WorkspaceFit,
    middle: [f64; 3],
    gate: ForceGate,
    line: LineState,
    input: Vec<u8>,
    output: Vec<u8>,
    /// When the packets were sent that wait for an answer.
    waiting: VecDeque<Nanos>,
    sent_at: Option<Nanos>,
    /// Since when there is no good answer.
    lost_since: Option<Nanos>,
    has_news: bool,
    /// The newest believed angles in rad.
    angles: Option<[f64; 2]>,
    /// Believed places in mm, and when the packets were sent that they answer.
    track: VecDeque<(Nanos, [f64; 2])>,
    reports: u64,
    fault: Option<HapiFault>,
    faults: u64,
}

impl Exchange {
    /// The tissue's middle is at `middle` in mm. Without a connection as yet.
    #[must_use]
    pub fn new(
        (linkage, setup): (Pantograph, BoardSetup),
        fit: WorkspaceFit,
        middle: [f64; 3],
        limits: ForceLimits,
    ) -> Self {
        Self {
            linkage,
            setup,
            fit,
            middle,
            gate: ForceGate::new(limits),
            line: LineState::Talking,
            input: Vec::with_capacity(64),
            output: Vec::with_capacity(64),
            waiting: VecDeque::with_capacity(16),
            sent_at: None,
            lost_since: None,
            has_news: false,
            angles: None,
            track: VecDeque::with_capacity(TRACK_MAX + 1),
            reports: 0,
            fault: None,
            faults: 0,
        }
    }

    /// The port is open: of its answers none is believed before one follows a silence.
    pub fn begin(&mut self, now: Nanos) {
        self.lose_link();
        self.lost_since = Some(now);
        if matches!(self.line, LineState::Lost { .. }) {
            self.lose_home();
        } else {
            self.line = LineState::Quiet { since: now };
        }
    }

    /// The port is lost.
    pub fn lose_link(&mut self) {
        self.gate.lose_link();
        self.input.clear();
        self.waiting.clear();
        self.sent_at = None;
        self.angles = None;
        self.track.clear();
    }

    /// Another time without an answer, while a delay is measured and there is no force.
    pub fn set_reply_silence(&mut self, silence: Nanos) {
        self.gate.set_reply_silence(silence);
    }

    /// A tick of the scene at `at`, with its force in N along its axes.
    pub fn set_order(&mut self, at: Nanos, force: [f64; 3]) {
        self.gate.set_order(at, self.fit.device_force(force));
        self.has_news = true;
    }

    /// No force from here on.
    pub fn end(&mut self) {
        self.gate.end();
    }

    /// Bytes of the board: the pose for the scene if they complete an answer, at no number if it cannot be believed.
    pub fn receive(&mut self, now: Nanos, bytes: &[u8]) -> Option<SensedPose> {
        match self.line {
            LineState::Lost { .. } => return None,
            LineState::Quiet { .. } => {
                if !bytes.is_empty() {
                    self.line = LineState::Quiet { since: now };
                }
                return None;
            }
            LineState::Talking | LineState::Probing { .. } => self.input.extend_from_slice(bytes),
        }
        let mut sensed = None;
        while let Some(answer) = self.take_answer(now) {
            sensed = Some(self.judge(now, answer));
        }
        sensed
    }

    /// The next answer: when its packet was sent and its angles in degrees, or what is wrong with it.
    fn take_answer(&mut self, now: Nanos) -> Option<Result<(Nanos, [f64; 2]), HapiFault>> {
        if self.input.is_empty() {
            return None;
        }
        let Some(sent) = self.waiting.front().copied() else {
            self.fall_silent(now);
            return Some(Err(HapiFault::Unexpected));
        };
        let answer = *self.input.first_chunk::<ANSWER>()?;
        let Some(angles) = parse_angles(&answer) else {
            self.fall_silent(now);
            return Some(Err(HapiFault::OtherDevice));
        };
        self.input.drain(..ANSWER);
        self.waiting.pop_front();
        if matches!(self.line, LineState::Probing { .. }) {
            self.line = LineState::Talking;
        }
        Some(Ok((sent, angles)))
    }

    /// Packets and answers may not belong together any more.
    fn fall_silent(&mut self, now: Nanos) {
        self.input.clear();
        self.waiting.clear();
        self.line = LineState::Quiet { since: now };
        self.lost_since.get_or_insert(now);
    }

    fn judge(&mut self, now: Nanos, answer: Result<(Nanos, [f64; 2]), HapiFault>) -> SensedPose {
        self.reports += 1;
        let read = answer.and_then(|(sent, degrees)| self.believe((sent, now), degrees));
        let state = match read {
            Ok(_) => {
                self.lost_since = None;
                ReportState::Good { speed_mm_per_s: self.speed_mm_per_s(), is_held: None }
            }
            Err(fault) => {
                self.note_fault(fault);
                self.angles = None;
                ReportState::Bad
            }
        };
        self.gate.set_report(state, self.waiting.front().copied());
        if read == Err(HapiFault::Jump) {
            self.lose_home();
        }
        let pose = read.map_or(NO_POSE, |[x, y]| Pose {
            at: self.fit.place([1e-3 * x, 1e-3 * y, 0.0], self.middle),
            turn: [0.0; 3],
        });
        SensedPose { number: self.reports, pose }
    }

    /// Where the arm is, no answer says any more.
    fn lose_home(&mut self) {
        self.line = LineState::Lost { sent_at: None };
        self.input.clear();
        self.waiting.clear();
        self.angles = None;
        self.gate.set_report(ReportState::NotReady, None);
    }

    fn note_fault(&mut self, fault: HapiFault) {
        self.fault = Some(fault);
        self.faults += 1;
    }

    /// The place in mm of angles in degrees that were sensed between two times, if it can be.
    fn believe(
        &mut self,
        (sent, now): (Nanos, Nanos),
        degrees: [f64; 2],
    ) -> Result<[f64; 2], HapiFault> {
        if !degrees.iter().all(|one| one.abs() <= DEGREES_MAX) {
            return Err(HapiFault::Angles);
        }
        let angles = degrees.map(f64::to_radians);
        // Where the linkage is singular no torque makes a force.
        let place = self.linkage.jacobian(angles).and_then(|_| self.linkage.place(angles));
        let place = place.ok_or(HapiFault::Angles)?;
        if let Some((then, before)) = self.track.back()
            // The longest that may have passed from one to the other.
            && distance(*before, place) > self.jump_max_mm(now.since(*then))
        {
            return Err(HapiFault::Jump);
        }
        self.track.push_back((sent, place));
        while self.track.len() > TRACK_MAX
            || self.track.get(1).is_some_and(|(at, _)| sent.since(*at) >= SPEED_SPAN)
        {
            self.track.pop_front();
        }
        self.angles = Some(angles);
        Ok(place)
    }

    fn jump_max_mm(&self, elapsed: Nanos) -> f64 {
        4.0 * self.gate.limits().speed_max_mm_per_s * elapsed.seconds().0 + JUMP_MM
    }

    /// Over the span of the track: from one answer to the next a count alone would be fast.
    fn speed_mm_per_s(&self) -> f64 {
        let (Some((then, before)), Some((now, place))) = (self.track.front(), self.track.back())
        else {
            return 0.0;
        };
        let elapsed = Nanos(now.since(*then).0.max(SPEED_SPAN.0));
        distance(*before, *place) / elapsed.seconds().0
    }

    /// Whether a packet has to be sent now.
    #[must_use]
    pub fn is_due(&self, now: Nanos) -> bool {
        if self.gate.is_overdue(now) {
            return true;
        }
        match self.line {
            LineState::Talking => {
                let is_beat = self.sent_at.is_none_or(|sent| now.since(sent) >= BEAT);
                let is_late = self.is_late(now);
                is_late || self.waiting.is_empty() && (self.has_news || is_beat)
            }
            LineState::Quiet { since } => now.since(since) >= QUIET,
            LineState::Probing { since } => now.since(since) >= PROBE_MAX,
            LineState::Lost { sent_at } => sent_at.is_none_or(|sent| now.since(sent) >= LOST_BEAT),
        }
    }

    fn is_late(&self, now: Nanos) -> bool {
        let silence = self.gate.limits().reply_silence;
        self.waiting.front().is_some_and(|since| now.since(*since) > silence)
    }

    /// The packet to send now, its force that of the gate.
    pub fn message(&mut self, now: Nanos) -> &[u8] {
        let force = self.gate.force(now);
        self.output.clear();
        self.has_news = false;
        self.sent_at = Some(now);
        match self.line {
            LineState::Talking if self.is_late(now) => self.send_zero(now),
            LineState::Talking => {
                let torques = self.torques(force);
                write_torques(&mut self.output, torques);
                self.expect(now);
            }
            LineState::Quiet { since } if now.since(since) >= QUIET => self.probe(now),
            // The line is silent but for this zero.
            LineState::Quiet { .. } => self.send_zero(now),
            LineState::Probing { since } if now.since(since) < PROBE_MAX => self.send_zero(now),
            // A board without motors answers with its device's number alone.
            LineState::Probing { .. } if self.input == [DEVICE] => {
                self.note_fault(HapiFault::Restarted);
                self.lose_home();
                // So that the reason is known.
                self.gate.force(now);
                self.end_torque(now);
            }
            LineState::Probing { .. } if self.input.is_empty() => self.probe(now),
            LineState::Probing { .. } => self.send_zero(now),
            LineState::Lost { sent_at: None } => self.end_torque(now),
            LineState::Lost { sent_at: Some(_) } => {
                self.line = LineState::Lost { sent_at: Some(now) };
                write_zero(&mut self.output);
            }
        }
        &self.output
    }

    /// A zero whose answer is not waited for.
    fn send_zero(&mut self, now: Nanos) {
        self.fall_silent(now);
        write_zero(&mut self.output);
    }

    /// A zero whose answer begins the dialogue.
    fn probe(&mut self, now: Nanos) {
        self.input.clear();
        self.waiting.clear();
        self.line = LineState::Probing { since: now };
        write_zero(&mut self.output);
        self.expect(now);
    }

    fn expect(&mut self, now: Nanos) {
        self.waiting.push_back(now);
        self.gate.note_sent(now);
    }

    /// Zero for a board that has lost the arm's place. One without motors takes no torque, and so it gets a set-up before.
    fn end_torque(&mut self, now: Nanos) {
        self.line = LineState::Lost { sent_at: Some(now) };
        write_first(&mut self.output, &self.setup);
    }

    /// Torques in N m, smaller in one proportion where a motor has less.
    fn torques(&self, [x, y, _]: [f64; 3]) -> [f64; 2] {
        let made = self.angles.and_then(|angles| self.linkage.torques(angles, [x, y]));
        let torques = made.unwrap_or_default().map(|torque| 1e-3 * torque);
        let largest = torques[0].abs().max(torques[1].abs());
        torques.map(|torque| torque * (TORQUE_MAX_N_M / largest).min(1.0))
    }

    /// Whether good answers have been missing for so long that the port is to be opened again.
    #[must_use]
    pub fn is_hopeless(&self, now: Nanos) -> bool {
        let has_lost_home = matches!(self.line, LineState::Lost { .. });
        !has_lost_home && self.lost_since.is_some_and(|since| now.since(since) > LOST_MAX)
    }

    /// Whether an answer is due.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// When the oldest packet was sent whose answer is due.
    #[must_use]
    pub fn waiting_since(&self) -> Option<Nanos> {
        self.waiting.front().copied()
    }

    #[must_use]
    pub fn line(&self) -> LineState {
        self.line
    }

    /// Why the last force was zero.
    #[must_use]
    pub fn stop(&self) -> ForceStop {
        self.gate.stop()
    }

    /// Looks at the gate without a connection, so that [`stop`](Self::stop) says why.
    pub fn note_lost(&mut self, now: Nanos) {
        self.gate.force(now);
    }

    /// The newest believed angles in degrees.
    #[must_use]
    pub fn degrees(&self) -> Option<[f64; 2]> {
        self.angles.map(|angles| angles.map(f64::to_degrees))
    }

    /// The newest fault of an answer, and how many there were.
    #[must_use]
    pub fn faults(&self) -> (Option<HapiFault>, u64) {
        (self.fault, self.faults)
    }

    /// How the dialogue is.
    #[must_use]
    pub fn link_report(&self, is_connected: bool) -> LinkReport {
        LinkReport {
            is_connected,
            stop: self.stop(),
            fault: self.fault.map(HapiFault::name),
            faults: self.faults,
            reports: self.reports,
            losses: 0,
        }
    }
}

fn distance([a, b]: [f64; 2], [x, y]: [f64; 2]) -> f64 {
    (a - x).hypot(b - y)
}
