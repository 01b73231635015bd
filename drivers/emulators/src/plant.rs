//! The slide, bench and load cell of the simulated rig behind every emulated device.

use palpate_drivers::sim::{
    LoadCell, Random, RandomStream, SWITCH_MARGIN_MM, SimBench, SimSettings, TRAVEL,
};
use palpate_model::rig::HandAction;
use palpate_model::{Newtons, Position, Seconds, Volts};

/// Positions passed in are those of the device's counter, in mm; no device knows where its zero is.
#[derive(Clone, Debug)]
pub struct EmulatedPlant {
    bench: SimBench,
    cell: LoadCell,
    /// True position at which the counter reads zero.
    counter_zero: Position,
    /// True position of the axis.
    axis: Position,
    force: Newtons,
    cell_force: Newtons,
    volts: Volts,
    fault: Option<CellFault>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellFault {
    Stuck,
    Saturated,
}

/// Beyond the end of every input range, so that each reads its own end.
const SATURATED: Volts = Volts(12.0);

impl EmulatedPlant {
    /// Starts 5 to 15 mm from home with the counter at zero; the cell is read once per `tick`.
    pub fn new(settings: &SimSettings, tick: Seconds) -> Self {
        let mut machine = Random::new(settings.seed, RandomStream::Machine);
        let counter_zero = Position(machine.between(5.0, 15.0));
        let mut plant = Self {
            bench: SimBench::new(settings, counter_zero),
            cell: LoadCell::new(settings, tick),
            counter_zero,
            axis: counter_zero,
            force: Newtons(0.0),
            cell_force: Newtons(0.0),
            volts: Volts(0.0),
            fault: None,
        };
        plant.volts = plant.cell.signal(Newtons(0.0));
        plant
    }

    /// Moves the axis to a counted position, in mm, within a time step.
    pub fn advance(&mut self, counted_mm: f64, dt: Seconds) {
        self.axis = self.counter_zero.moved_by(counted_mm);
        let load = self.bench.advance(self.axis, dt);
        self.force = load.on_probe;
        self.cell_force = load.on_cell;
        let volts = self.cell.signal(load.on_cell);
        self.volts = match self.fault {
            None => volts,
            Some(CellFault::Stuck) => self.volts,
            Some(CellFault::Saturated) => SATURATED,
        };
    }

    /// Lowers the counter by `by_mm` without motion of the axis.
    pub fn shift_counter(&mut self, by_mm: f64) {
        self.counter_zero = self.counter_zero.moved_by(by_mm);
    }

    pub fn apply_hand_action(&mut self, action: HandAction) {
        self.bench.apply_hand_action(action);
    }

    /// Amplified signal of the cell.
    pub fn volts(&self) -> Volts {
        self.volts
    }

    /// Force on the probe.
    pub fn force(&self) -> Newtons {
        self.force
    }

    /// Force on the cell: that on the probe plus weights.
    pub fn cell_force(&self) -> Newtons {
        self.cell_force
    }

    /// True position of the axis, in mm from the edge of the home switch.
    pub fn axis(&self) -> Position {
        self.axis
    }

    pub fn is_home(&self) -> bool {
        self.axis.0 <= 0.0
    }

    pub fn is_forward_limit(&self) -> bool {
        self.axis.0 >= TRAVEL.0 + SWITCH_MARGIN_MM
    }

    pub fn is_reverse_limit(&self) -> bool {
        self.axis.0 <= -SWITCH_MARGIN_MM
    }

    /// Sets or clears a fault of the cell's signal.
    pub fn set_cell_fault(&mut self, fault: Option<CellFault>) {
        self.fault = fault;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probe_feels_tissue_and_switches_close_at_ends() {
        let dt = Seconds(0.001);
        let mut plant = EmulatedPlant::new(&SimSettings::default(), dt);
        let free = plant.volts();
        plant.shift_counter(-100.0);
        plant.advance(100.0, dt);
        let home = 100.0 - plant.axis().0;
        let mut at = 100.0;
        while plant.axis().0 < 55.0 {
            at += 0.02;
            plant.advance(at, dt);
        }
        assert!(plant.force().0 > 0.5, "{:?}", plant.force());
        assert!(plant.volts().0 > free.0 + 0.05);

        plant.apply_hand_action(HandAction::Unmount);
        plant.advance(at, dt);
        assert_eq!(plant.force().0, 0.0);
        plant.apply_hand_action(HandAction::LoadCell { mass_g: 400.0 });
        plant.advance(at, dt);
        assert!(plant.volts().0 > free.0 + 0.05 && plant.force().0 == 0.0);
        assert!((plant.cell_force().0 - 0.4 * 9.80665).abs() < 0.01);
        plant.set_cell_fault(Some(CellFault::Stuck));
        let stuck = plant.volts();
        plant.advance(at - 5.0, dt);
        assert_eq!(plant.volts(), stuck);
        plant.set_cell_fault(Some(CellFault::Saturated));
        plant.advance(home - 0.001, dt);
        assert_eq!(plant.volts(), SATURATED);
        assert!(plant.is_home() && !plant.is_reverse_limit());
        plant.advance(home - 2.1, dt);
        assert!(plant.is_reverse_limit());
        plant.advance(home + 152.1, dt);
        assert!(plant.is_forward_limit() && !plant.is_home());
    }
}
