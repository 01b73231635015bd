//! A Galil controller as a rig.

use super::connect::{Connected, connect};
use super::model::{GalilBoard, GalilOpenError};
use super::session::Session;
use super::settings::GalilSettings;
use crate::rig::{Rig, RigEvent, RigEventBody};
use crate::wire::{HostClock, Line, LineSettings, Link, LinkStats};
use palpate_model::Nanos;
use palpate_model::rig::{Fault, RawBytes, RigCommand, RigDescription};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// The caller's time may fall behind the host's clock by so much before it counts as given up: the runner does not
/// catch up a quarter of a second.
const BEHIND_MAX: Nanos = Nanos::from_millis(250);

/// A Galil controller with slide and load cell.
pub struct GalilRig {
    board: GalilBoard,
    description: RigDescription,
    worst_case_mm: f64,
    line: Line,
    clock: HostClock,
    /// The host's clock where the caller's time is zero.
    origin: Option<Nanos>,
    newest: Nanos,
    /// Refusals of commands that found no room.
    refused: VecDeque<Fault>,
    /// Bytes of the time before the thread had the link.
    first_raw: Vec<RawBytes>,
}

impl GalilRig {
    /// Sets up the controller behind a link and begins to take samples.
    pub fn open(
        mut link: Box<dyn Link>,
        settings: &GalilSettings,
        clock: HostClock,
    ) -> Result<Self, GalilOpenError> {
        let device: Arc<str> = "galil".into();
        let connected = connect(link.as_mut(), &clock, settings, &device)?;
        let session = Session::new(settings.clone(), &connected, clock());
        let Connected {
            board,
            description,
            worst_case_mm,
            raw,
            ..
        } = connected;
        let line_settings = LineSettings {
            device,
            farewell: format!("ST{}\r", settings.axis).into_bytes(),
        };
        let line = Line::start(link, session, Arc::clone(&clock), line_settings)
            .map_err(|err| GalilOpenError::Thread(err.to_string()))?;
        Ok(Self {
            board,
            description,
            worst_case_mm,
            line,
            clock,
            origin: None,
            newest: Nanos::ZERO,
            refused: VecDeque::new(),
            first_raw: raw,
        })
    }

    /// Who the controller is.
    #[must_use]
    pub fn board(&self) -> &GalilBoard {
        &self.board
    }

    /// How far the axis goes at most when palpate falls silent, in mm.
    #[must_use]
    pub fn worst_case_mm(&self) -> f64 {
        self.worst_case_mm
    }

    /// How the link behaves.
    #[must_use]
    pub fn stats(&self) -> LinkStats {
        self.line.stats()
    }

    /// The caller's time of a moment of the host's clock; never before what was told already.
    fn told(&mut self, at: Nanos, until: Nanos) -> Nanos {
        let origin = self.origin.unwrap_or(at);
        self.newest = at.since(origin).max(self.newest).min(until);
        self.newest
    }
}

impl Rig for GalilRig {
    fn description(&self) -> &RigDescription {
        &self.description
    }

    fn send(&mut self, command: RigCommand) {
        if self.line.send(command).is_err() {
            self.refused.push_back(Fault::CommandRefused {
                detail: "too many commands at once".into(),
            });
        }
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        let now = (self.clock)();
        let origin = *self
            .origin
            .get_or_insert_with(|| Nanos(now.0.saturating_sub(until.0)));
        // A caller whose time stood still, as while the computer slept, begins anew.
        let behind = now.since(origin).since(until);
        let origin = if behind > BEHIND_MAX {
            Nanos(now.0.saturating_sub(until.0))
        } else {
            origin
        };
        self.origin = Some(origin);
        if let Some(fault) = self.refused.pop_front() {
            let at = self.told(now, until);
            return Some(RigEvent {
                at,
                body: RigEventBody::Fault(fault),
            });
        }
        let end = origin + until;
        let wait = Duration::from_nanos(end.since(now).0);
        let event = self.line.next_event(end, wait)?;
        let at = self.told(event.at, until);
        Some(RigEvent { at, ..event })
    }

    fn is_virtual(&self) -> bool {
        false
    }

    fn take_raw(&mut self) -> Vec<RawBytes> {
        let mut raw = std::mem::take(&mut self.first_raw);
        raw.extend(self.line.take_raw());
        let origin = self.origin.unwrap_or(Nanos::ZERO);
        for piece in &mut raw {
            piece.at = piece.at.since(origin);
        }
        raw
    }
}
