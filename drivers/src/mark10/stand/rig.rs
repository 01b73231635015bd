//! A stand as a rig.

use super::StandSettings;
use super::open::{ConnectedStand, connect};
use super::protocol::STOP;
use super::session::StandSession;
use crate::rig::{Rig, RigEvent, RigEventBody};
use crate::text::DeviceError;
use crate::wire::{HostClock, Line, LineSettings, Link, LinkStats};
use palpate_model::Nanos;
use palpate_model::rig::{Fault, RawBytes, RigCommand, RigDescription};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// The caller's time may fall behind the host's clock by so much before it counts as given up: the runner does not
/// catch up a quarter of a second.
const BEHIND_MAX: Nanos = Nanos::from_millis(250);

/// A motorised stand with its gauge.
pub struct StandRig {
    description: RigDescription,
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

impl StandRig {
    /// Sets up the stand behind a link and begins to take samples.
    pub fn open(
        mut link: Box<dyn Link>,
        settings: &StandSettings,
        clock: HostClock,
    ) -> Result<Self, DeviceError> {
        let device: Arc<str> = "stand".into();
        let ConnectedStand {
            description,
            scale,
            pace,
            stats,
            raw,
        } = connect(link.as_mut(), &clock, settings, &device)?;
        let session = StandSession::new(settings.clone(), scale, pace, stats, clock());
        let line_settings = LineSettings {
            device,
            farewell: STOP.into(),
        };
        let line =
            Line::start(link, session, Arc::clone(&clock), line_settings).map_err(|err| {
                DeviceError::Unfit {
                    device: "Mark-10 stand",
                    detail: format!("no thread can be started for its link ({err})"),
                }
            })?;
        Ok(Self {
            description,
            line,
            clock,
            origin: None,
            newest: Nanos::ZERO,
            refused: VecDeque::new(),
            first_raw: raw,
        })
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

impl Rig for StandRig {
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
        let is_behind = now.since(origin).since(until) > BEHIND_MAX;
        let origin = if is_behind {
            Nanos(now.0.saturating_sub(until.0))
        } else {
            origin
        };
        self.origin = Some(origin);
        if let Some(fault) = self.refused.pop_front() {
            let at = self.told(now, until);
            let body = RigEventBody::Fault(fault);
            return Some(RigEvent::arrived(at, body));
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

    fn newtons_per_volt(&self) -> Option<f64> {
        // The gauge tells newtons, each of which counts as a volt.
        Some(1.0)
    }

    fn links(&self) -> Vec<(String, LinkStats)> {
        vec![("stand".to_owned(), self.line.stats())]
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
