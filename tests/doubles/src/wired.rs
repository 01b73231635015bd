//! A rig as if on wires: it reports the bytes it exchanges.

use palpate_drivers::{Rig, RigEvent, RigEventBody};
use palpate_model::Nanos;
use palpate_model::rig::{HandAction, RawBytes, RigCommand, RigDescription, SensorReading};
use std::sync::Arc;

/// Any rig, with its commands and reports as bytes too: a line of text each, commands and answers with the
/// device `controller`, readings with the device `cell`.
#[derive(Clone, Debug)]
pub struct WiredRig<R> {
    inner: R,
    now: Nanos,
    raw: Vec<RawBytes>,
    controller: Arc<str>,
    cell: Arc<str>,
}

impl<R: Rig> WiredRig<R> {
    /// `inner` on wires.
    #[must_use]
    pub fn new(inner: R) -> Self {
        Self {
            inner,
            now: Nanos::ZERO,
            raw: Vec::new(),
            controller: "controller".into(),
            cell: "cell".into(),
        }
    }

    #[must_use]
    pub fn command_line(command: &RigCommand) -> String {
        format!("{command:?}\r")
    }

    #[must_use]
    pub fn report_line(body: &RigEventBody) -> String {
        match body {
            RigEventBody::Reading(reading) => {
                let counts = reading.counts.unwrap_or_default();
                format!("{} {counts} {}\r\n", reading.tick, reading.pulses)
            }
            other => format!("{other:?}\r\n"),
        }
    }

    fn note(&mut self, device: &Arc<str>, is_sent: bool, line: String) {
        self.raw.push(RawBytes {
            at: self.now,
            device: Arc::clone(device),
            is_sent,
            bytes: line.into(),
        });
    }
}

impl<R: Rig> Rig for WiredRig<R> {
    fn description(&self) -> &RigDescription {
        self.inner.description()
    }

    fn send(&mut self, command: RigCommand) {
        let device = Arc::clone(&self.controller);
        self.note(&device, true, Self::command_line(&command));
        self.inner.send(command);
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        let event = self.inner.next_event(until)?;
        self.now = event.at;
        let device = match &event.body {
            RigEventBody::Reading(_) => Arc::clone(&self.cell),
            _ => Arc::clone(&self.controller),
        };
        self.note(&device, false, Self::report_line(&event.body));
        Some(event)
    }

    fn is_virtual(&self) -> bool {
        self.inner.is_virtual()
    }

    fn apply_hand_action(&mut self, action: HandAction) {
        self.inner.apply_hand_action(action);
    }

    fn take_raw(&mut self) -> Vec<RawBytes> {
        std::mem::take(&mut self.raw)
    }

    fn take_sensors(&mut self) -> Vec<SensorReading> {
        self.inner.take_sensors()
    }
}
