//! Whether the hand gets the scene's force: the watchdog, the dead-man grip, the ramp and the largest force.
//!
//! Pure: time goes in, a force comes out, and so 1000 faults are counted without a wait. Everything that is not as it
//! should be ends the force in the same call; it comes back only by a ramp from zero.

use palpate_model::Nanos;
use serde::{Deserialize, Serialize};

palpate_model::named! {
    /// Why the hand gets no force; the first reason that applies.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum ForceStop {
        /// It gets one.
        None = "the force of the scene is on the hand",
        /// The scene has not yet ticked.
        #[default]
        NotStarted = "the scene has not started",
        /// The device is closed.
        Ended = "the device is closed",
        /// No connection.
        LinkLost = "the connection to the device is lost",
        /// No answer for too long.
        NoReply = "the device does not answer in time",
        /// A report that cannot be.
        BadReport = "the device reports values that cannot be",
        /// The device is not as it must be.
        NotReady = "the device is not calibrated, not powered or not ready",
        /// The scene's loop is late or gone.
        SceneSilent = "the scene stopped sending forces",
        /// The scene's force is no number.
        NotANumber = "the force of the scene is no number",
        /// The dead-man button is released.
        NotHeld = "the button of the grip is not pressed",
        /// The stylus moves too fast.
        TooFast = "the stylus moves faster than the limit",
    }
}

/// Bounds of a [`ForceGate`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ForceLimits {
    /// Largest force in N.
    pub force_max_n: f64,
    /// Largest speed of the stylus in mm/s.
    pub speed_max_mm_per_s: f64,
    /// Time without a tick of the scene after which the force ends.
    pub scene_silence: Nanos,
    /// Time without an answer of the device after which the force ends.
    pub reply_silence: Nanos,
    /// Time in which the force comes back, linearly.
    pub ramp: Nanos,
}

impl Default for ForceLimits {
    /// A silence of 2.5 ms, a tick or a beat of 1 ms before it, a turn of the thread and a message's way are 4 to 4.5 ms, below the
    /// 5 ms in which the force must be zero. A tick that is 1.5 ms late is rare where real-time priority is granted. A hand that
    /// is led reaches about 1 m/s; an arm of 0.1 kg that runs away with 3 N is faster than the limit within 0.05 s.
    fn default() -> Self {
        Self {
            force_max_n: 3.0,
            speed_max_mm_per_s: 1500.0,
            scene_silence: Nanos(2_500_000),
            reply_silence: Nanos(2_500_000),
            ramp: Nanos::from_millis(200),
        }
    }
}

/// What a report says about the device, as far as the force depends on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReportState {
    /// A report that cannot be.
    Bad,
    /// Not calibrated, not powered or not ready.
    NotReady,
    /// All is well.
    Good {
        /// Speed of the stylus in mm/s.
        speed_mm_per_s: f64,
        /// Whether the dead-man button is pressed; `None` for a device without one.
        is_held: Option<bool>,
    },
}

/// Decides about every force.
#[derive(Clone, Debug)]
pub struct ForceGate {
    limits: ForceLimits,
    /// Since when a message waits for its answer.
    waiting_since: Option<Nanos>,
    report: Option<ReportState>,
    /// The scene's newest force, and when it came.
    order: Option<(Nanos, [f64; 3])>,
    is_ended: bool,
    ramp_since: Option<Nanos>,
    /// Whether the last force was not zero.
    is_pushing: bool,
    stop: ForceStop,
}

impl ForceGate {
    /// Without a connection, and so without force.
    #[must_use]
    pub fn new(limits: ForceLimits) -> Self {
        Self {
            limits,
            waiting_since: None,
            report: None,
            order: None,
            is_ended: false,
            ramp_since: None,
            is_pushing: false,
            stop: ForceStop::NotStarted,
        }
    }

    pub fn limits(&self) -> &ForceLimits {
        &self.limits
    }

    /// Why the last force was zero.
    pub fn stop(&self) -> ForceStop {
        self.stop
    }

    /// Another time without an answer, while a delay is measured and there is no force.
    pub fn set_reply_silence(&mut self, silence: Nanos) {
        self.limits.reply_silence = silence;
    }

    /// A tick of the scene, with its force in N along the device's axes.
    pub fn set_order(&mut self, now: Nanos, force: [f64; 3]) {
        self.order = Some((now, force));
    }

    /// A message has been sent, and an answer is due.
    pub fn note_sent(&mut self, now: Nanos) {
        self.waiting_since.get_or_insert(now);
    }

    /// An answer has come; the oldest message that still waits for one was sent at `waiting_since`.
    pub fn set_report(&mut self, report: ReportState, waiting_since: Option<Nanos>) {
        self.waiting_since = waiting_since;
        self.report = Some(report);
        // Whatever was wrong in a report must end the force even if the next report is good before anything is sent.
        if !matches!(report, ReportState::Good { .. }) {
            self.ramp_since = None;
        }
    }

    /// The connection is lost: everything begins from zero.
    pub fn lose_link(&mut self) {
        self.waiting_since = None;
        self.report = None;
        self.ramp_since = None;
    }

    /// No force from here on.
    pub fn end(&mut self) {
        self.is_ended = true;
    }

    /// The force to send at `now`, in N along the device's axes.
    pub fn force(&mut self, now: Nanos) -> [f64; 3] {
        self.stop = self.reason(now);
        let force = match self.order {
            Some((_, order)) if self.stop == ForceStop::None => self.ramped(now, order),
            _ => {
                self.ramp_since = None;
                [0.0; 3]
            }
        };
        self.is_pushing = force != [0.0; 3];
        force
    }

    fn ramped(&mut self, now: Nanos, order: [f64; 3]) -> [f64; 3] {
        let since = *self.ramp_since.get_or_insert(now);
        let share = now.since(since).0 as f64 / self.limits.ramp.0.max(1) as f64;
        limited(order.map(|part| part * share.min(1.0)), self.limits.force_max_n)
    }

    /// Whether a zero must be sent at once: the last force was not zero, and something has gone wrong since.
    pub fn is_overdue(&self, now: Nanos) -> bool {
        self.is_pushing && (self.ramp_since.is_none() || self.reason(now) != ForceStop::None)
    }

    /// A speed at no number is not slow.
    fn is_slow(&self, speed_mm_per_s: f64) -> bool {
        speed_mm_per_s <= self.limits.speed_max_mm_per_s
    }

    fn reason(&self, now: Nanos) -> ForceStop {
        if self.is_ended {
            return ForceStop::Ended;
        }
        let Some(report) = self.report else {
            return ForceStop::LinkLost;
        };
        let is_late = |since: Nanos, silence: Nanos| now.since(since) > silence;
        if self.waiting_since.is_some_and(|since| is_late(since, self.limits.reply_silence)) {
            return ForceStop::NoReply;
        }
        let (speed, is_held) = match report {
            ReportState::Bad => return ForceStop::BadReport,
            ReportState::NotReady => return ForceStop::NotReady,
            ReportState::Good { speed_mm_per_s, is_held } => (speed_mm_per_s, is_held),
        };
        match self.order {
            None => ForceStop::NotStarted,
            Some((since, _)) if is_late(since, self.limits.scene_silence) => ForceStop::SceneSilent,
            Some((_, force)) if !force.iter().all(|part| part.is_finite()) => ForceStop::NotANumber,
            Some(_) if !self.is_slow(speed) => ForceStop::TooFast,
            Some(_) if is_held == Some(false) => ForceStop::NotHeld,
            Some(_) => ForceStop::None,
        }
    }
}

/// The same way, no longer than `most`.
fn limited(force: [f64; 3], most: f64) -> [f64; 3] {
    let [x, y, z] = force;
    let length = x.hypot(y).hypot(z);
    if length <= most {
        return force;
    }
    // Parts near the largest number have no finite length.
    if !length.is_finite() {
        return [0.0; 3];
    }
    force.map(|part| part * (most / length))
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: ReportState = ReportState::Good { speed_mm_per_s: 10.0, is_held: Some(true) };

    fn ms(millis: u64) -> Nanos {
        Nanos::from_millis(millis)
    }

    /// A gate whose force is whole at 1000 ms.
    fn open_gate() -> ForceGate {
        let mut gate = ForceGate::new(ForceLimits::default());
        for now in 0..=1000 {
            gate.set_report(GOOD, None);
            gate.set_order(ms(now), [0.0, 0.0, 2.0]);
            gate.force(ms(now));
        }
        assert_eq!(gate.force(ms(1000)), [0.0, 0.0, 2.0]);
        gate
    }

    #[test]
    fn every_reason_ends_the_force_at_once_and_has_its_name() {
        type Fault = fn(&mut ForceGate);
        let faults: [(ForceStop, Fault); 9] = [
            (ForceStop::Ended, ForceGate::end),
            (ForceStop::LinkLost, ForceGate::lose_link),
            (ForceStop::BadReport, |gate| gate.set_report(ReportState::Bad, None)),
            (ForceStop::NotReady, |gate| gate.set_report(ReportState::NotReady, None)),
            (ForceStop::NotANumber, |gate| gate.set_order(ms(1000), [f64::NAN, 0.0, 0.0])),
            (ForceStop::NotANumber, |gate| gate.set_order(ms(1000), [0.0, f64::INFINITY, 0.0])),
            (ForceStop::NotHeld, |gate| {
                let report = ReportState::Good { speed_mm_per_s: 0.0, is_held: Some(false) };
                gate.set_report(report, None);
            }),
            (ForceStop::TooFast, |gate| {
                let report = ReportState::Good { speed_mm_per_s: 1501.0, is_held: None };
                gate.set_report(report, None);
            }),
            (ForceStop::TooFast, |gate| {
                let report = ReportState::Good { speed_mm_per_s: f64::NAN, is_held: None };
                gate.set_report(report, None);
            }),
        ];
        for (reason, fault) in faults {
            let mut gate = open_gate();
            fault(&mut gate);
            assert!(gate.is_overdue(ms(1000)), "{reason}");
            assert_eq!(gate.force(ms(1000)), [0.0; 3], "{reason}");
            assert_eq!(gate.stop(), reason);
        }
    }

    #[test]
    fn silence_of_scene_or_service_ends_the_force_after_its_limit() {
        let mut gate = open_gate();
        assert_ne!(gate.force(Nanos(1_002_500_000)), [0.0; 3]);
        assert_eq!(gate.force(Nanos(1_002_500_001)), [0.0; 3]);
        assert_eq!(gate.stop(), ForceStop::SceneSilent);
        let mut gate = open_gate();
        gate.note_sent(ms(1000));
        gate.set_order(ms(1002), [0.0, 0.0, 2.0]);
        // Later messages do not put off the answer that is due.
        gate.note_sent(ms(1002));
        assert_ne!(gate.force(Nanos(1_002_500_000)), [0.0; 3]);
        assert_eq!(gate.force(Nanos(1_002_500_001)), [0.0; 3]);
        assert_eq!(gate.stop(), ForceStop::NoReply);
    }

    #[test]
    fn force_comes_back_by_a_ramp_from_zero() {
        let mut gate = open_gate();
        gate.set_report(ReportState::Bad, None);
        // Good before anything was sent: the ramp begins all the same.
        gate.set_report(GOOD, None);
        assert_eq!(gate.force(ms(1000)), [0.0; 3]);
        for (now, part) in [(1050, 0.5), (1100, 1.0), (1200, 2.0), (1300, 2.0)] {
            gate.set_order(ms(now), [0.0, 0.0, 2.0]);
            // 2 N times a share that is exact to a rounding.
            assert!((gate.force(ms(now))[2] - part).abs() < 1e-12, "{now} ms");
        }
    }

    #[test]
    fn no_force_is_longer_than_the_limit_or_another_way() {
        let mut gate = open_gate();
        for force in [[30.0, -40.0, 0.0], [1e308, 1e308, 1e308], [0.1, 0.2, -0.3]] {
            gate.set_order(ms(1000), force);
            let [x, y, z] = gate.force(ms(1000));
            let length = (x * x + y * y + z * z).sqrt();
            // A rounding of the division.
            assert!(length <= 3.0 * (1.0 + 1e-15), "{length}");
        }
        gate.set_order(ms(1000), [30.0, -40.0, 0.0]);
        let [x, y, _] = gate.force(ms(1000));
        assert!((x - 1.8).abs() < 1e-12 && (y + 2.4).abs() < 1e-12);
    }
}
