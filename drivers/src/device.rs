//! A rig made of devices on links.

use crate::galil::GalilOpenError;
use crate::grbl::GrblOpenError;
use crate::rig::{Rig, RigError, RigEvent, RigEventBody};
use crate::text::DeviceError;
use crate::wire::{HaltHandle, HostClock, LinkStats, LinkThread, TOO_MANY_COMMANDS, WireError};
use palpate_model::Nanos;
use palpate_model::rig::{RawBytes, RigCommand, RigDescription, SensorReading};
use std::collections::VecDeque;
use std::time::Duration;
use thiserror::Error;

/// Longest wait for one of several links.
const TURN: Nanos = Nanos::from_millis(1);

/// A device that a rig file describes cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum OpenError {
    #[error(transparent)]
    Galil(#[from] GalilOpenError),
    #[error(transparent)]
    Grbl(#[from] GrblOpenError),
    #[error(transparent)]
    Text(#[from] DeviceError),
    #[error(transparent)]
    Wire(#[from] WireError),
    #[error("the operating system cannot start a thread for a link ({0}); close other programs")]
    Thread(String),
}

pub struct OpenedDevices {
    pub description: RigDescription,
    /// Newtons per volt, where the load cell itself is calibrated.
    pub newtons_per_volt: Option<f64>,
    pub link: Option<String>,
    /// One for each device. The first is that of the axis, to which commands go.
    pub lines: Vec<LinkThread>,
    /// Bytes exchanged before the threads had the links, by the host's clock.
    pub raw: Vec<RawBytes>,
}

/// The devices of a rig, to be opened as often as the operator asks.
pub trait RigDevice: Send {
    /// Opens the links, checks and sets up what is behind them, and lets it send samples. Nothing moves. All lines of
    /// an earlier call are closed.
    fn open(&mut self, clock: &HostClock) -> Result<OpenedDevices, OpenError>;

    /// Fills in what no single link knows. `now` is on the host's clock.
    fn complete(&mut self, _now: Nanos, body: RigEventBody) -> RigEventBody {
        body
    }

    /// New readings of its sensors, as [`Rig::take_sensors`] has them.
    fn take_sensors(&mut self) -> Vec<SensorReading> {
        Vec::new()
    }
}

/// The caller's time may fall behind the host's clock by so much before it counts as given up: the runner does not
/// catch up a quarter of a second.
const BEHIND_MAX: Nanos = Nanos::from_millis(250);

/// The caller's zero on the host's clock, and the newest time that was reported.
#[derive(Default)]
pub(crate) struct CallerTime {
    /// `None` before the first call.
    origin: Option<Nanos>,
    newest: Nanos,
}

impl CallerTime {
    /// The caller asks for events until a time of its own: that time on the host's clock.
    pub(crate) fn host_end(&mut self, now: Nanos, until: Nanos) -> Nanos {
        let begun = Nanos(now.0.saturating_sub(until.0));
        // A caller whose time stood still, as while the computer slept, gets a new origin.
        let origin = match self.origin {
            Some(origin) if now.since(origin).since(until) <= BEHIND_MAX => origin,
            _ => begun,
        };
        self.origin = Some(origin);
        origin + until
    }

    /// The caller's time of an event on the host's clock; never before an earlier event.
    pub(crate) fn event_time(&mut self, at: Nanos, until: Nanos) -> Nanos {
        let origin = self.origin.unwrap_or(at);
        self.newest = at.since(origin).max(self.newest).min(until);
        self.newest
    }

    /// Another rig has reported at the caller's time.
    pub(crate) fn note(&mut self, at: Nanos) {
        self.newest = self.newest.max(at);
    }

    /// The caller's time of bytes that were exchanged, in any order.
    pub(crate) fn caller_time(&self, at: Nanos) -> Nanos {
        at.since(self.origin.unwrap_or(Nanos::ZERO))
    }
}

pub struct DeviceRig<D> {
    device: D,
    /// Without links while it is being connected again, and after that has failed.
    opened: OpenedDevices,
    /// An event of each link that waits for earlier ones of others.
    pending: Vec<Option<RigEvent>>,
    clock: HostClock,
    time: CallerTime,
    refused: VecDeque<RigEventBody>,
}

impl<D: RigDevice> DeviceRig<D> {
    /// Opens the devices and begins to take samples.
    pub fn open(mut device: D, clock: HostClock) -> Result<Self, OpenError> {
        let opened = device.open(&clock)?;
        Ok(Self {
            device,
            pending: opened.lines.iter().map(|_| None).collect(),
            opened,
            time: CallerTime::default(),
            clock,
            refused: VecDeque::new(),
        })
    }

    pub const fn device(&self) -> &D {
        &self.device
    }

    /// The caller's time now, as [`Rig::take_raw`] has it.
    pub fn now(&self) -> Nanos {
        self.time.caller_time((self.clock)())
    }

    /// The oldest of what has come from the lines until `end` on the host's clock; of equal ones that of the axis.
    fn next(&mut self, end: Nanos) -> Option<RigEvent> {
        let Some(last) = self.opened.lines.len().checked_sub(1) else {
            std::thread::sleep(Duration::from_nanos(end.since((self.clock)()).0));
            return None;
        };
        loop {
            let mut wait = end.since((self.clock)());
            for (index, line) in self.opened.lines.iter().enumerate() {
                if self.pending.iter().any(Option::is_some) {
                    wait = Nanos::ZERO;
                }
                if self.pending[index].is_none() {
                    let turn = match (index == last, last) {
                        (true, 0) => wait,
                        (true, _) => wait.min(TURN),
                        (false, _) => Nanos::ZERO,
                    };
                    self.pending[index] = line.next_event(end, Duration::from_nanos(turn.0));
                }
            }
            let arrived = self.pending.iter_mut().filter(|event| event.is_some());
            let oldest = arrived.min_by_key(|event| event.as_ref().map(|event| event.at));
            if let Some(oldest) = oldest {
                return oldest.take();
            }
            if wait == Nanos::ZERO || last == 0 {
                return None;
            }
        }
    }

    /// The bytes exchanged since the last call, at the host's time.
    fn take_raw_of_host(&mut self) -> Vec<RawBytes> {
        let mut raw = std::mem::take(&mut self.opened.raw);
        raw.extend(self.opened.lines.iter().flat_map(LinkThread::take_raw));
        raw.sort_by_key(|piece| piece.at);
        raw
    }
}

impl<D: RigDevice> Rig for DeviceRig<D> {
    fn description(&self) -> &RigDescription {
        &self.opened.description
    }

    fn halt_handle(&self) -> Option<HaltHandle> {
        self.opened.lines.first()?.halt_handle()
    }

    fn send(&mut self, command: RigCommand) {
        let sent = self.opened.lines.first_mut().map(|line| line.send(command));
        let detail = match sent {
            Some(Ok(())) => return,
            Some(Err(_)) => TOO_MANY_COMMANDS,
            None => "the rig is not connected",
        };
        self.refused.push_back(RigEventBody::refusal(detail));
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        let now = (self.clock)();
        let end = self.time.host_end(now, until);
        if let Some(refusal) = self.refused.pop_front() {
            return Some(RigEvent::new(self.time.event_time(now, until), refusal));
        }
        let event = self.next(end)?;
        let at = self.time.event_time(event.at, until);
        let body = self.device.complete((self.clock)(), event.body);
        Some(RigEvent::new(at, body))
    }

    fn reconnect(&mut self) -> Result<(), RigError> {
        // The old links are closed first, or their ports would be busy.
        let closed = self.opened.lines.drain(..).flat_map(LinkThread::close);
        self.opened.raw.extend(closed);
        self.pending.clear();
        self.refused.clear();
        let mut opened = self.device.open(&self.clock).map_err(|error| RigError::Device {
            file: self.opened.description.name.clone(),
            error,
        })?;
        opened.raw.splice(..0, self.opened.raw.drain(..));
        self.pending = opened.lines.iter().map(|_| None).collect();
        self.opened = opened;
        Ok(())
    }

    fn link(&self) -> Option<&str> {
        self.opened.link.as_deref()
    }

    fn is_virtual(&self) -> bool {
        false
    }

    fn newtons_per_volt(&self) -> Option<f64> {
        self.opened.newtons_per_volt
    }

    fn take_sensors(&mut self) -> Vec<SensorReading> {
        self.device.take_sensors()
    }

    fn take_raw(&mut self) -> Vec<RawBytes> {
        let mut raw = self.take_raw_of_host();
        for piece in &mut raw {
            piece.at = self.time.caller_time(piece.at);
        }
        raw
    }

    fn links(&self) -> Vec<(String, LinkStats)> {
        let lines = self.opened.lines.iter();
        lines.map(|line| (line.device().to_owned(), line.stats())).collect()
    }
}
