//! A rig that fails by script, around any other rig.

use super::script::{FaultKind, Rail, ScriptedFault};
use palpate_drivers::sim::{Random, RandomStream, counts_from_volts, volts_from_counts};
use palpate_drivers::{Rig, RigEvent, RigEventBody};
use palpate_model::rig::{
    AxisStatus, Fault, HandAction, RawBytes, Reading, RigCommand, RigDescription, SensorReading,
};
use palpate_model::{Nanos, Volts};
use std::collections::VecDeque;

/// Signal at the end of the range of a rig without a converter: the usual +-10 V input.
const RAIL_VOLTS: f64 = 10.0;

/// A refusal is back this long after the command: both ways of the simulated link.
const REFUSAL_DELAY: Nanos = Nanos(2_000_000);

/// What happens at a set time whether or not the rig inside reports anything.
#[derive(Clone, Debug)]
enum TimedFault {
    Disconnect,
    Reset { is_announced: bool },
    Refusal,
}

/// Any rig, failing by script.
///
/// Give [`Rig::next_event`] an `until` that comes: a silent rig has no next event, and
/// looking for one without an end never returns.
#[derive(Clone, Debug)]
pub struct FaultyRig<R> {
    inner: R,
    script: Vec<ScriptedFault>,
    noise: Random,
    /// In order of time.
    timed: VecDeque<(Nanos, TimedFault)>,
    /// Reports on their way to the caller, in order of time.
    reports: VecDeque<RigEvent>,
    /// Arrival of the newest report put on its way.
    newest: Option<Nanos>,
    /// Arrival of the newest report handed out.
    handed_out: Option<Nanos>,
    /// Arrival of the newest event taken from the rig inside or handed out.
    now: Nanos,
    /// Signal at which the fault in progress is stuck.
    stuck: Option<(Option<i32>, Volts)>,
    is_linked: bool,
    reset: Option<Reset>,
    /// Commands the rig inside has not answered yet; a rig answers each, in order.
    unanswered: VecDeque<Sender>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sender {
    Caller,
    /// This double; the caller never hears of it.
    Double,
}

#[derive(Clone, Copy, Debug, Default)]
struct Reset {
    /// Tick of the first reading since, once it has come.
    zero_tick: Option<u64>,
    is_motor_enabled: bool,
}

impl<R: Rig> FaultyRig<R> {
    /// `inner` with the faults of `script`; `seed` is that of added noise.
    #[must_use]
    pub fn new(inner: R, script: Vec<ScriptedFault>, seed: u64) -> Self {
        let mut timed: Vec<(Nanos, TimedFault)> = script
            .iter()
            .filter_map(|fault| {
                let what = match fault.kind {
                    FaultKind::Disconnect => TimedFault::Disconnect,
                    FaultKind::Reset => TimedFault::Reset { is_announced: true },
                    FaultKind::UnannouncedReset => TimedFault::Reset { is_announced: false },
                    _ => return None,
                };
                Some((fault.at, what))
            })
            .collect();
        timed.sort_by_key(|(at, _)| *at);
        Self {
            inner,
            script,
            noise: Random::new(seed, RandomStream::Fault),
            timed: timed.into(),
            reports: VecDeque::new(),
            newest: None,
            handed_out: None,
            now: Nanos::ZERO,
            stuck: None,
            is_linked: true,
            reset: None,
            unanswered: VecDeque::new(),
        }
    }

    pub fn inner(&self) -> &R {
        &self.inner
    }

    fn is_active(&self, is_kind: impl Fn(FaultKind) -> bool) -> bool {
        self.script.iter().any(|fault| fault.is_active(self.now) && is_kind(fault.kind))
    }

    fn put(&mut self, at: Nanos, body: RigEventBody) {
        let at = match self.newest {
            Some(newest) if at <= newest => newest + Nanos(1),
            _ => at,
        };
        self.newest = Some(at);
        self.reports.push_back(RigEvent::new(at, body));
    }

    fn schedule(&mut self, at: Nanos, what: TimedFault) {
        let place = self.timed.partition_point(|(earlier, _)| *earlier <= at);
        self.timed.insert(place, (at, what));
    }

    fn pass_on(&mut self, command: RigCommand, sender: Sender) {
        self.unanswered.push_back(sender);
        self.inner.send(command);
    }

    /// What happens at its time, regardless of the rig inside.
    fn on_timed(&mut self, at: Nanos, what: TimedFault) {
        self.now = self.now.max(at);
        let fault = match what {
            TimedFault::Disconnect => {
                self.is_linked = false;
                // Reports still on their way are lost with the link.
                self.reports.clear();
                self.newest = self.handed_out;
                Fault::LinkLost { detail: "no answer, the other end has gone".to_owned() }
            }
            TimedFault::Reset { is_announced } => {
                self.reset = Some(Reset::default());
                self.pass_on(RigCommand::Halt, Sender::Double);
                self.pass_on(RigCommand::DefinePosition { pulses: 0 }, Sender::Double);
                if !is_announced {
                    return;
                }
                Fault::ControllerReset
            }
            TimedFault::Refusal => {
                Fault::CommandRefused { detail: "refused by the test's script".to_owned() }
            }
        };
        self.put(at, RigEventBody::Fault(fault));
    }

    /// An event of the rig inside goes through the faults.
    fn on_event(&mut self, event: RigEvent) {
        self.now = event.at;
        if !self.is_linked {
            return;
        }
        let body = match event.body {
            RigEventBody::Reading(reading) => {
                let reading = self.after_reset(reading).and_then(|reading| self.distorted(reading));
                match reading {
                    Some(reading) => RigEventBody::Reading(reading),
                    None => return,
                }
            }
            answer @ (RigEventBody::Ack(_) | RigEventBody::Fault(Fault::CommandRefused { .. })) => {
                if self.unanswered.pop_front() == Some(Sender::Double) {
                    return;
                }
                answer
            }
            fault @ RigEventBody::Fault(_) => fault,
        };
        let delay = self.script.iter().filter(|fault| fault.is_active(event.at)).fold(
            Nanos::ZERO,
            |sum, fault| match fault.kind {
                FaultKind::Late(delay) => sum + delay,
                _ => sum,
            },
        );
        self.put(event.at + delay, body);
    }

    /// The reading as a restarted controller gives it; `None` while it restarts.
    fn after_reset(&mut self, reading: Reading) -> Option<Reading> {
        let Some(reset) = &mut self.reset else {
            return Some(reading);
        };
        if self.unanswered.contains(&Sender::Double) {
            return None;
        }
        let zero_tick = *reset.zero_tick.get_or_insert(reading.tick);
        let mut bits = reading.status.0;
        if !reset.is_motor_enabled {
            bits &= !AxisStatus::MOTOR_ON.0;
        }
        Some(Reading { tick: reading.tick - zero_tick, status: AxisStatus(bits), ..reading })
    }

    /// The reading after every active fault, in the order of the script; `None` if it is lost.
    fn distorted(&mut self, mut reading: Reading) -> Option<Reading> {
        let adc = self.inner.description().adc;
        let mut is_stuck = false;
        for index in 0..self.script.len() {
            let fault = self.script[index];
            if !fault.is_active(self.now) {
                continue;
            }
            match fault.kind {
                FaultKind::Silent => return None,
                FaultKind::NotANumber => reading.volts = Volts(f64::NAN),
                FaultKind::Stuck => {
                    is_stuck = true;
                    let signal = (reading.counts, reading.volts);
                    (reading.counts, reading.volts) = *self.stuck.get_or_insert(signal);
                }
                FaultKind::Saturated(rail) => match adc {
                    Some(adc) => {
                        let counts = match rail {
                            Rail::High => adc.counts_max,
                            Rail::Low => adc.counts_min,
                        };
                        reading.counts = Some(counts);
                        reading.volts = volts_from_counts(counts, adc);
                    }
                    None => {
                        reading.volts = Volts(match rail {
                            Rail::High => RAIL_VOLTS,
                            Rail::Low => -RAIL_VOLTS,
                        });
                    }
                },
                FaultKind::Noisy(sigma) => {
                    self.shift(&mut reading, |random| sigma.0 * random.normal());
                }
                FaultKind::SignalJump(volts) => self.shift(&mut reading, |_| volts.0),
                FaultKind::LostSteps(pulses) => reading.pulses += pulses,
                FaultKind::Late(_)
                | FaultKind::RefuseCommands
                | FaultKind::Disconnect
                | FaultKind::Reset
                | FaultKind::UnannouncedReset => {}
            }
        }
        if !is_stuck {
            self.stuck = None;
        }
        Some(reading)
    }

    /// Adds volts before the converter, as far as its range goes.
    fn shift(&mut self, reading: &mut Reading, volts: impl FnOnce(&mut Random) -> f64) {
        let shifted = Volts(reading.volts.0 + volts(&mut self.noise));
        match self.inner.description().adc {
            Some(adc) => {
                let counts = counts_from_volts(shifted, adc);
                reading.counts = Some(counts);
                reading.volts = volts_from_counts(counts, adc);
            }
            None => reading.volts = shifted,
        }
    }
}

impl<R: Rig> Rig for FaultyRig<R> {
    fn description(&self) -> &RigDescription {
        self.inner.description()
    }

    fn send(&mut self, command: RigCommand) {
        if !self.is_linked {
            return;
        }
        let is_motor_off = self.reset.is_some_and(|reset| {
            let is_motion = command.is_motion();
            !reset.is_motor_enabled && is_motion
        });
        if is_motor_off || self.is_active(|kind| kind == FaultKind::RefuseCommands) {
            self.schedule(self.now + REFUSAL_DELAY, TimedFault::Refusal);
            return;
        }
        if let (Some(reset), RigCommand::EnableMotor) = (&mut self.reset, command) {
            reset.is_motor_enabled = true;
        }
        self.pass_on(command, Sender::Caller);
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        // The rig inside is brought up to the time of the event to hand out, never past it: a
        // command sent in answer must not act before that event.
        loop {
            let due = self.reports.front().map_or(until, |event| event.at.min(until));
            let timed_at = self.timed.front().map_or(due, |(at, _)| due.min(*at));
            if let Some(event) = self.inner.next_event(timed_at) {
                self.on_event(event);
                continue;
            }
            if let Some((at, _)) = self.timed.front()
                && *at <= due
                && let Some((at, what)) = self.timed.pop_front()
            {
                self.on_timed(at, what);
                continue;
            }
            break;
        }
        if self.reports.front()?.at > until {
            return None;
        }
        let event = self.reports.pop_front()?;
        self.handed_out = Some(event.at);
        self.now = self.now.max(event.at);
        Some(event)
    }

    fn is_virtual(&self) -> bool {
        self.inner.is_virtual()
    }

    fn apply_hand_action(&mut self, action: HandAction) {
        self.inner.apply_hand_action(action);
    }

    fn take_raw(&mut self) -> Vec<RawBytes> {
        self.inner.take_raw()
    }

    fn take_sensors(&mut self) -> Vec<SensorReading> {
        self.inner.take_sensors()
    }
}
