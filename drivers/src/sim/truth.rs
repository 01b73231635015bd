//! A simulated rig that tells what was true when it is switched off: what a fit may be compared with.

use super::SimRig;
use crate::rig::{Rig, RigEvent};
use palpate_model::Nanos;
use palpate_model::rig::{HandAction, RigCommand, RigDescription, SensorReading};

/// Hears of a rig that is switched off.
pub type TruthListener = Box<dyn FnMut(&SimRig) + Send>;

/// A rig, and who hears what was true.
pub struct RigWithTruth {
    rig: SimRig,
    listener: TruthListener,
}

impl RigWithTruth {
    #[must_use]
    pub fn new(rig: SimRig, listener: TruthListener) -> Self {
        Self { rig, listener }
    }
}

impl Drop for RigWithTruth {
    fn drop(&mut self) {
        (self.listener)(&self.rig);
    }
}

impl Rig for RigWithTruth {
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
