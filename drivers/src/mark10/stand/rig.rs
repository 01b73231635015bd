//! A stand as a rig.

use super::StandSettings;
use super::open::{ConnectedStand, connect};
use super::protocol::STOP;
use super::session::StandSession;
use crate::rig::{Rig, RigError, RigEvent, RigEventBody};
use crate::text::DeviceError;
use crate::wire::{CallerTime, HaltHandle, HostClock, Line, LineSettings, Link, LinkStats, Place};
use palpate_model::Nanos;
use palpate_model::rig::{Fault, RawBytes, RigCommand, RigDescription};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// A motorised stand with its gauge.
pub struct StandRig {
    /// `None` on a link that was handed over.
    place: Option<Place>,
    settings: StandSettings,
    connected: ConnectedStand,
    /// `None` while it is being connected anew, and after that has failed.
    line: Option<Line>,
    clock: HostClock,
    time: CallerTime,
    /// Refusals of commands that found no room.
    refused: VecDeque<Fault>,
    /// Bytes of the time before the thread had the link.
    first_raw: Vec<RawBytes>,
}

impl StandRig {
    /// Opens the link, sets up the stand behind it and begins to take samples.
    pub fn open(
        place: &Place,
        settings: &StandSettings,
        clock: HostClock,
    ) -> Result<Self, DeviceError> {
        let mut rig = Self::on(place.open()?, settings, clock)?;
        rig.place = Some(place.clone());
        Ok(rig)
    }

    /// The same on a link that is open. It cannot be connected anew.
    pub fn on(
        link: Box<dyn Link>,
        settings: &StandSettings,
        clock: HostClock,
    ) -> Result<Self, DeviceError> {
        let (connected, line) = start(link, settings, &clock)?;
        Ok(Self {
            place: None,
            settings: settings.clone(),
            first_raw: connected.raw.clone(),
            connected,
            line: Some(line),
            time: CallerTime::new(Arc::clone(&clock)),
            clock,
            refused: VecDeque::new(),
        })
    }

    /// How the link behaves.
    #[must_use]
    pub fn stats(&self) -> LinkStats {
        let stats = self.line.as_ref().map(Line::stats);
        stats.unwrap_or(self.connected.stats)
    }
}

impl Rig for StandRig {
    fn description(&self) -> &RigDescription {
        &self.connected.description
    }

    fn send(&mut self, command: RigCommand) {
        let sent = self.line.as_mut().map(|line| line.send(command));
        let detail = match sent {
            Some(Ok(())) => return,
            Some(Err(_)) => "too many commands at once",
            None => "the stand is not connected",
        };
        self.refused.push_back(Fault::CommandRefused {
            detail: detail.into(),
        });
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        let (now, end) = self.time.asked(until);
        if let Some(fault) = self.refused.pop_front() {
            let at = self.time.told(now, until);
            return Some(RigEvent::new(at, RigEventBody::Fault(fault)));
        }
        let wait = Duration::from_nanos(end.since(now).0);
        let Some(line) = &self.line else {
            std::thread::sleep(wait);
            return None;
        };
        let mut event = line.next_event(end, wait)?;
        event.at = self.time.told(event.at, until);
        Some(event)
    }

    fn reconnect(&mut self) -> Result<(), RigError> {
        let place = self.place.as_ref().ok_or(RigError::NotAgain)?;
        // The old link says farewell and is closed, or a serial port would be busy with it.
        self.first_raw
            .extend(self.line.iter().flat_map(Line::take_raw));
        self.line = None;
        let started = place
            .open()
            .map_err(DeviceError::from)
            .and_then(|link| start(link, &self.settings, &self.clock));
        let (connected, line) = started.map_err(|error| RigError::Device {
            file: self.settings.name.clone(),
            error: error.into(),
        })?;
        self.first_raw.extend(connected.raw.iter().cloned());
        self.connected = connected;
        self.line = Some(line);
        self.refused.clear();
        Ok(())
    }

    fn is_virtual(&self) -> bool {
        false
    }

    fn newtons_per_volt(&self) -> Option<f64> {
        // The gauge tells newtons, each of which counts as a volt.
        Some(1.0)
    }

    fn take_raw(&mut self) -> Vec<RawBytes> {
        let mut raw = std::mem::take(&mut self.first_raw);
        raw.extend(self.line.iter().flat_map(Line::take_raw));
        for piece in &mut raw {
            piece.at = self.time.of(piece.at);
        }
        raw
    }

    fn halt_handle(&self) -> Option<HaltHandle> {
        self.line.as_ref()?.halt_handle()
    }

    fn links(&self) -> Vec<(String, LinkStats)> {
        vec![("stand".to_owned(), self.stats())]
    }
}

fn start(
    mut link: Box<dyn Link>,
    settings: &StandSettings,
    clock: &HostClock,
) -> Result<(ConnectedStand, Line), DeviceError> {
    let device: Arc<str> = "stand".into();
    let connected = connect(link.as_mut(), clock, settings, &device)?;
    let session = StandSession::new(settings.clone(), &connected, clock());
    let line_settings = LineSettings {
        device,
        farewell: STOP.into(),
    };
    let line = Line::start(link, session, Arc::clone(clock), line_settings).map_err(|err| {
        DeviceError::Unfit {
            device: "Mark-10 stand",
            detail: format!("no thread can be started for its link ({err})"),
        }
    })?;
    Ok((connected, line))
}
