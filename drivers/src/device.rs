//! A rig on wires: whatever opens its devices, and one rig over it.

use crate::galil::GalilOpenError;
use crate::grbl::GrblOpenError;
use crate::rig::{Rig, RigError, RigEvent, RigEventBody};
use crate::text::DeviceError;
use crate::wire::{CallerTime, HaltHandle, HostClock, LinkStats, LinkThread, WireError};
use palpate_model::Nanos;
use palpate_model::rig::{Fault, RawBytes, RigCommand, RigDescription};
use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::time::Duration;
use thiserror::Error;

/// Several lines are listened to in turns of this length.
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
    #[error("the operating system gives no thread for a link ({0}); close other programs")]
    Thread(String),
}

impl OpenError {
    pub(crate) fn thread(err: &io::Error) -> Self {
        Self::Thread(err.to_string())
    }
}

pub struct Opened {
    pub description: RigDescription,
    /// Newtons of a volt, where the load cell itself is calibrated.
    pub newtons_per_volt: Option<f64>,
    pub link: Option<String>,
    /// One for each device. The first is that of the axis, to which commands go.
    pub lines: Vec<LinkThread>,
    /// What was exchanged before the threads had the links, by the host's clock.
    pub raw: Vec<RawBytes>,
}

/// The devices of a rig, to be opened as often as the operator asks.
pub trait RigDevice: Send {
    /// Opens the links, checks and sets up what is behind them, and lets it send samples. Nothing moves. All lines of an
    /// earlier call are closed.
    fn open(&mut self, clock: &HostClock) -> Result<Opened, OpenError>;

    /// Fills in what no single line knows. `now` is on the host's clock.
    fn complete(&mut self, _now: Nanos, body: RigEventBody) -> RigEventBody {
        body
    }
}

pub struct DeviceRig<D> {
    device: D,
    /// Without lines while it is being connected anew, and after that has failed.
    opened: Opened,
    /// What was taken from each line and not told yet.
    pending: Vec<Option<RigEvent>>,
    clock: HostClock,
    time: CallerTime,
    refused: VecDeque<Fault>,
}

impl<D: RigDevice> DeviceRig<D> {
    /// Opens the devices and begins to take samples.
    pub fn open(mut device: D, clock: HostClock) -> Result<Self, OpenError> {
        let opened = device.open(&clock)?;
        Ok(Self {
            device,
            pending: opened.lines.iter().map(|_| None).collect(),
            opened,
            time: CallerTime::new(Arc::clone(&clock)),
            clock,
            refused: VecDeque::new(),
        })
    }

    pub const fn device(&self) -> &D {
        &self.device
    }

    /// The time that [`Rig::take_raw`] tells, now.
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
            let mut left = end.since((self.clock)());
            for (place, line) in self.opened.lines.iter().enumerate() {
                if self.pending.iter().any(Option::is_some) {
                    left = Nanos::ZERO;
                }
                if self.pending[place].is_none() {
                    let turn = match (place == last, last) {
                        (true, 0) => left,
                        (true, _) => left.min(TURN),
                        (false, _) => Nanos::ZERO,
                    };
                    self.pending[place] = line.next_event(end, Duration::from_nanos(turn.0));
                }
            }
            let came = self.pending.iter_mut().filter(|event| event.is_some());
            let oldest = came.min_by_key(|event| event.as_ref().map(|event| event.at));
            if let Some(oldest) = oldest {
                return oldest.take();
            }
            if left == Nanos::ZERO || last == 0 {
                return None;
            }
        }
    }

    /// What was exchanged since this was last asked, at the host's time.
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
            Some(Err(_)) => "too many commands at once",
            None => "the rig is not connected",
        };
        self.refused.push_back(Fault::CommandRefused { detail: detail.into() });
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        let (now, end) = self.time.window(until);
        if let Some(fault) = self.refused.pop_front() {
            let at = self.time.event_time(now, until);
            return Some(RigEvent::new(at, RigEventBody::Fault(fault)));
        }
        let event = self.next(end)?;
        let at = self.time.event_time(event.at, until);
        let body = self.device.complete((self.clock)(), event.body);
        Some(RigEvent::new(at, body))
    }

    fn reconnect(&mut self) -> Result<(), RigError> {
        // The old links say farewell and are closed, or their ports would be busy with them.
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
