//! A Galil controller as a rig.

use super::connect::{Connected, connect};
use super::model::{GalilBoard, GalilOpenError};
use super::session::Session;
use super::settings::GalilSettings;
use crate::rig::{Rig, RigError, RigEvent, RigEventBody};
use crate::wire::{CallerTime, HaltHandle, HostClock, Line, LineSettings, LinkStats, Place};
use palpate_model::Nanos;
use palpate_model::rig::{Fault, RawBytes, RigCommand, RigDescription};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// A controller that is connected, and the thread that talks to it.
struct Open {
    connected: Connected,
    line: Line,
}

/// A Galil controller with slide and load cell.
pub struct GalilRig {
    place: Place,
    settings: GalilSettings,
    connected: Connected,
    /// `None` while it is being connected anew, and after that has failed.
    line: Option<Line>,
    clock: HostClock,
    time: CallerTime,
    /// Refusals of commands that found no room.
    refused: VecDeque<Fault>,
    /// Bytes of the time before the thread had the link.
    first_raw: Vec<RawBytes>,
}

impl GalilRig {
    /// Opens the link, sets up the controller behind it and begins to take samples.
    pub fn open(
        place: &Place,
        settings: &GalilSettings,
        clock: HostClock,
    ) -> Result<Self, GalilOpenError> {
        let Open { connected, line } = open(place, settings, &clock)?;
        Ok(Self {
            place: place.clone(),
            settings: settings.clone(),
            first_raw: connected.raw.clone(),
            connected,
            line: Some(line),
            time: CallerTime::new(Arc::clone(&clock)),
            clock,
            refused: VecDeque::new(),
        })
    }

    /// Who the controller is.
    #[must_use]
    pub fn board(&self) -> &GalilBoard {
        &self.connected.board
    }

    /// How far the axis goes at most when palpate falls silent, in mm.
    #[must_use]
    pub fn worst_case_mm(&self) -> f64 {
        self.connected.worst_case_mm
    }

    /// The time that [`Rig::take_raw`] tells, now.
    #[must_use]
    pub fn now(&self) -> Nanos {
        self.time.of((self.clock)())
    }

    /// How the link behaves.
    #[must_use]
    pub fn stats(&self) -> LinkStats {
        let stats = self.line.as_ref().map(Line::stats);
        // Nothing was asked since: as it was measured when it was opened.
        stats
            .filter(|stats| stats.answers > 0)
            .unwrap_or(self.connected.stats)
    }
}

impl Rig for GalilRig {
    fn description(&self) -> &RigDescription {
        &self.connected.description
    }

    fn send(&mut self, command: RigCommand) {
        let sent = self.line.as_mut().map(|line| line.send(command));
        let detail = match sent {
            Some(Ok(())) => return,
            Some(Err(_)) => "too many commands at once",
            None => "the controller is not connected",
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
        // The old link says farewell and is closed, or a serial port would be busy with it.
        self.first_raw
            .extend(self.line.iter().flat_map(Line::take_raw));
        self.line = None;
        let file = self.settings.name.clone();
        let settings = GalilSettings {
            // The same controller, whatever the rig file leaves open.
            serial_number: self.connected.board.serial_number,
            ..self.settings.clone()
        };
        let Open { connected, line } =
            open(&self.place, &settings, &self.clock).map_err(|error| RigError::Device {
                file,
                error: error.into(),
            })?;
        self.first_raw.extend(connected.raw.iter().cloned());
        self.connected = connected;
        self.line = Some(line);
        self.refused.clear();
        Ok(())
    }

    fn link(&self) -> Option<&str> {
        Some(&self.connected.link)
    }

    fn is_virtual(&self) -> bool {
        false
    }

    fn halt_handle(&self) -> Option<HaltHandle> {
        self.line.as_ref()?.halt_handle()
    }

    fn links(&self) -> Vec<(String, LinkStats)> {
        vec![("galil".to_owned(), self.stats())]
    }

    fn take_raw(&mut self) -> Vec<RawBytes> {
        let mut raw = std::mem::take(&mut self.first_raw);
        raw.extend(self.line.iter().flat_map(Line::take_raw));
        for piece in &mut raw {
            piece.at = self.time.of(piece.at);
        }
        raw
    }
}

fn open(
    place: &Place,
    settings: &GalilSettings,
    clock: &HostClock,
) -> Result<Open, GalilOpenError> {
    let device: Arc<str> = "galil".into();
    let mut link = place.open()?;
    let connected = connect(link.as_mut(), clock, settings, &device)?;
    let session = Session::new(settings.clone(), &connected, clock());
    let line_settings = LineSettings {
        device,
        // The recording ends too: whoever comes next finds a controller that does nothing.
        farewell: format!("ST{};RC 0\r", settings.axis).into_bytes(),
    };
    let line = Line::start(link, session, Arc::clone(clock), line_settings)
        .map_err(|err| GalilOpenError::Thread(err.to_string()))?;
    Ok(Open { connected, line })
}
