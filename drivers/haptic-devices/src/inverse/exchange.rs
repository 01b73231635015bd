//! The dialogue with the service, without a socket and without a clock: reports in, commands out.

use super::message::{ArmReport, ReportFault, ServiceReport, write_force};
use crate::fit::WorkspaceFit;
use crate::gate::{ForceGate, ForceLimits, ForceStop, ReportState};
use crate::hand_over::{LinkReport, NO_POSE, SensedPose};
use palpate_model::Nanos;
use std::collections::VecDeque;

/// A message at least this often: the service answers only messages, and a command is forgotten when no other follows.
pub const BEAT: Nanos = Nanos::from_millis(1);
/// Time of late answers after which the connection is given up. The service numbers no answer, so one that is lost makes all later
/// ones look late, and only a new session brings them together.
const LATE_MAX: Nanos = Nanos::from_millis(100);
/// Messages that may wait for an answer, far more than in that time.
const WAITING_MAX: usize = 1000;
/// Reports after a new connection in which the origin may move, as the first message asks for another one.
const SETTLING: u64 = 10;
/// A place may be this far from the last in addition to four times the largest speed, in mm: some steps of the sensors.
const JUMP_MM: f64 = 2.0;

/// One device in one session of the service.
#[derive(Debug)]
pub struct Exchange {
    device: String,
    grip: String,
    fit: WorkspaceFit,
    middle: [f64; 3],
    gate: ForceGate,
    session: Option<u64>,
    /// When the messages were sent that wait for an answer.
    waiting: VecDeque<Nanos>,
    sent_at: Option<Nanos>,
    /// Since when answers are late.
    late_since: Option<Nanos>,
    has_news: bool,
    reports: u64,
    since_link: u64,
    last: Option<(Nanos, [f64; 3])>,
    fault: Option<ReportFault>,
    faults: u64,
    message: String,
}

impl Exchange {
    /// With a device by its name in the service, and the grip on it. The tissue's middle is at `middle` in mm.
    #[must_use]
    pub fn new(
        (device, grip): (String, String),
        fit: WorkspaceFit,
        middle: [f64; 3],
        limits: ForceLimits,
    ) -> Self {
        Self {
            device,
            grip,
            fit,
            middle,
            gate: ForceGate::new(limits),
            session: None,
            waiting: VecDeque::with_capacity(WAITING_MAX + 1),
            sent_at: None,
            late_since: None,
            has_news: false,
            reports: 0,
            since_link: 0,
            last: None,
            fault: None,
            faults: 0,
            message: String::with_capacity(512),
        }
    }

    /// A connection is there, and the service has sent its inventory: the session's number, and the device in it.
    pub fn begin(&mut self, inventory: &str) -> Result<(), ReportFault> {
        self.lose_link();
        let report = ServiceReport::parse(inventory)?;
        self.session = report.session();
        report.arm(&self.device, None).map(|_| ())
    }

    /// The connection is lost.
    pub fn lose_link(&mut self) {
        self.gate.lose_link();
        self.waiting.clear();
        self.session = None;
        self.sent_at = None;
        self.late_since = None;
        self.since_link = 0;
        self.last = None;
    }

    /// A tick of the scene at `at`, with its force in N along its axes.
    pub fn set_order(&mut self, at: Nanos, force: [f64; 3]) {
        self.gate.set_order(at, self.fit.device_force(force));
        self.has_news = true;
    }

    /// No force from here on.
    pub fn end(&mut self) {
        self.gate.end();
        self.has_news = true;
    }

    /// A report has come: the pose for the scene, at no number if the report cannot be believed.
    pub fn receive(&mut self, now: Nanos, text: &str) -> SensedPose {
        let read = self.read(now, text);
        let state = match &read {
            Ok(report) => report.state(),
            Err(_) => ReportState::Bad,
        };
        self.gate.set_report(state, self.waiting.front().copied());
        self.reports += 1;
        self.since_link += 1;
        if let Err(fault) = read {
            self.fault = Some(fault);
            self.faults += 1;
        }
        let pose = match read {
            Ok(report) if state != ReportState::NotReady => {
                self.fit.pose(report.position_m, report.quaternion, self.middle)
            }
            _ => NO_POSE,
        };
        SensedPose { number: self.reports, pose }
    }

    fn read(&mut self, now: Nanos, text: &str) -> Result<ArmReport, ReportFault> {
        self.waiting.pop_front().ok_or(ReportFault::Unexpected)?;
        let report = ServiceReport::parse(text)?;
        if report.session() != self.session {
            return Err(ReportFault::OtherSession);
        }
        let arm = report.arm(&self.device, Some(&self.grip))?;
        let last = self.last.replace((now, arm.position_m));
        if self.since_link >= SETTLING
            && let Some((then, place)) = last
            && distance_mm(place, arm.position_m) > self.jump_max_mm(now.since(then))
        {
            return Err(ReportFault::Jump);
        }
        Ok(arm)
    }

    /// Reports may come in pairs, a beat of motion apart.
    fn jump_max_mm(&self, elapsed: Nanos) -> f64 {
        let elapsed_s = Nanos(elapsed.0.max(BEAT.0)).seconds().0;
        4.0 * self.gate.limits().speed_max_mm_per_s * elapsed_s + JUMP_MM
    }

    /// Whether a message has to be sent now: the scene has ticked, something has gone wrong, or the last is a beat ago.
    #[must_use]
    pub fn is_due(&self, now: Nanos) -> bool {
        let is_beat = self.sent_at.is_none_or(|sent| now.since(sent) >= BEAT);
        self.has_news || is_beat || self.gate.is_overdue(now)
    }

    /// The message to send now; its force is that of the gate.
    pub fn message(&mut self, now: Nanos) -> &str {
        let force = self.gate.force(now);
        if self.gate.stop() == ForceStop::NoReply {
            self.late_since.get_or_insert(now);
        } else {
            self.late_since = None;
        }
        write_force(&mut self.message, &self.device, force, self.sent_at.is_none());
        self.sent_at = Some(now);
        self.has_news = false;
        self.waiting.push_back(now);
        self.gate.note_sent(now);
        &self.message
    }

    /// Whether answers have been late for so long that the connection is to be given up.
    #[must_use]
    pub fn is_hopeless(&self, now: Nanos) -> bool {
        let is_late = self.late_since.is_some_and(|since| now.since(since) > LATE_MAX);
        is_late || self.waiting.len() > WAITING_MAX
    }

    /// Whether an answer is due.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
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

    /// How the dialogue is.
    #[must_use]
    pub fn link_report(&self, is_connected: bool) -> LinkReport {
        LinkReport {
            is_connected,
            stop: self.stop(),
            fault: self.fault.map(ReportFault::name),
            faults: self.faults,
            reports: self.reports,
            losses: 0,
        }
    }

    /// The newest fault of a report, and how many there were.
    #[must_use]
    pub fn faults(&self) -> (Option<ReportFault>, u64) {
        (self.fault, self.faults)
    }
}

fn distance_mm([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> f64 {
    1000.0 * (a - x).hypot(b - y).hypot(c - z)
}
