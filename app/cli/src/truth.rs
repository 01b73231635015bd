//! A simulated rig that writes down what was true when it is switched off: what a fit may be compared with.

use palpate_drivers::sim::SimRig;
use palpate_drivers::{Rig, RigEvent};
use palpate_model::rig::{HandAction, RigCommand, RigDescription, SensorReading};
use palpate_model::{Nanos, Newtons};
use std::io::Write;

/// Places at which the true curve is written down.
const CURVE_POINTS: u32 = 100;

/// A rig, and where its truth goes.
pub(super) struct RigWithTruth<W: Write + Send> {
    rig: SimRig,
    file: W,
}

impl<W: Write + Send> RigWithTruth<W> {
    pub fn new(rig: SimRig, file: W) -> Self {
        Self { rig, file }
    }

    fn truth(&self) -> serde_json::Value {
        let (truth, curve) = (self.rig.truth(), self.rig.true_curve());
        let (from, to) = curve.force_range();
        let points = (0..=CURVE_POINTS).map(|k| {
            let force = from.0 + (to.0 - from.0) * f64::from(k) / f64::from(CURVE_POINTS);
            [force, curve.volts_from_newtons(Newtons(force)).0]
        });
        serde_json::json!({
            "settings": self.rig.description().settings,
            "parameters": {
                "tau_eps": truth.body.tau_eps,
                "mu1": truth.body.mu[0],
                "mu2": truth.body.mu[1],
                "mu3": truth.body.mu[2],
                "tau_sig": truth.body.tau_sig,
            },
            // As a session counts positions once the axis is homed.
            "contact_mm": truth.surface_counted().0,
            "curve_newtons_volts": points.collect::<Vec<_>>(),
        })
    }
}

impl<W: Write + Send> Drop for RigWithTruth<W> {
    /// A file that cannot be written costs no run: it is noted in the program's log.
    fn drop(&mut self) {
        if let Err(err) = writeln!(self.file, "{:#}", self.truth()) {
            tracing::warn!("the truth of the simulated rig cannot be written ({err})");
        }
    }
}

impl<W: Write + Send> Rig for RigWithTruth<W> {
    fn description(&self) -> &RigDescription {
        self.rig.description()
    }

    fn send(&mut self, command: RigCommand) {
        self.rig.send(command);
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        self.rig.next_event(until)
    }

    fn is_virtual(&self) -> bool {
        self.rig.is_virtual()
    }

    fn take_sensors(&mut self) -> Vec<SensorReading> {
        self.rig.take_sensors()
    }

    fn apply_hand_action(&mut self, action: HandAction) {
        self.rig.apply_hand_action(action);
    }
}
