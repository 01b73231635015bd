//! The master-slave system on its simulated device, as a loop ticks it.

use super::LoopTask;
use palpate_haptics::MasterSlaveError;
use palpate_haptics::simulation::{Simulation, SimulationSettings, SimulationTick};
use palpate_model::units::MmPerS;

/// Ticks of a stall that are simulated; after longer ones the device stands where it was.
const LED_MAX: u64 = 1000;

/// A simulation, its hand pressing again and again where its path says so.
#[derive(Clone, Copy, Debug)]
pub struct SimulatedMasterSlave {
    simulation: Simulation,
    last: SimulationTick,
}

impl SimulatedMasterSlave {
    /// At the start, after one tick.
    pub fn new(settings: &SimulationSettings) -> Result<Self, MasterSlaveError> {
        let mut simulation = Simulation::new(settings)?;
        let last = simulation.tick();
        Ok(Self { simulation, last })
    }

    /// The hand goes to another place in mm, at a speed above zero.
    pub fn lead(&mut self, place_mm: f64, speed: MmPerS) {
        self.simulation.lead(place_mm, speed);
    }

    /// The newest tick.
    pub fn last(&self) -> &SimulationTick {
        &self.last
    }
}

impl LoopTask for SimulatedMasterSlave {
    type View = SimulationTick;

    fn tick(&mut self, elapsed: u64) {
        for _ in 1..elapsed.min(LED_MAX) {
            let _away = self.simulation.tick_stalled();
        }
        self.last = self.simulation.tick();
    }

    fn show(&self, view: &mut SimulationTick) {
        *view = self.last;
    }
}
