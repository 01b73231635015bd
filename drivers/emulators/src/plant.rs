//! What every emulated device moves and feels: the slide of the simulated rig, its bench and its load cell.

use palpate_drivers::sim::{Bench, Cause, LoadCell, Random, SWITCH_MARGIN_MM, SimSettings, TRAVEL};
use palpate_model::rig::HandAction;
use palpate_model::{Newtons, Position, Seconds, Volts};

/// The slide with the probe, what stands before it, and the signal of the cell.
///
/// Positions given are those of the device's counter, in mm; where its zero is no device can know.
#[derive(Clone, Debug)]
pub struct EmulatedPlant {
    bench: Bench,
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

/// What is wrong with the cell's signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellFault {
    /// It stays where it is.
    Stuck,
    /// The amplifier is at its end.
    Saturated,
}

/// Beyond the end of every input range, so that each reads its own end.
const SATURATED: Volts = Volts(12.0);

impl EmulatedPlant {
    /// The slide as it is switched on, 5 to 15 mm from home, its counter at zero; the cell is read once per `tick`.
    #[must_use]
    pub fn new(settings: &SimSettings, tick: Seconds) -> Self {
        let mut machine = Random::new(settings.seed, Cause::Machine);
        let counter_zero = Position(machine.between(5.0, 15.0));
        let mut plant = Self {
            bench: Bench::new(settings, counter_zero),
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

    /// The axis has moved straight to a counted position, in mm, in a time step.
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

    /// From now on the counter reads less by so much, in mm, wherever the axis stands.
    pub fn shift(&mut self, by_mm: f64) {
        self.counter_zero = self.counter_zero.moved_by(by_mm);
    }

    /// A person puts weights on the cell, mounts a specimen or takes it out.
    pub fn apply_hand_action(&mut self, action: HandAction) {
        self.bench.by_hand(action);
    }

    /// The cell's amplified signal at the newest step.
    pub fn volts(&self) -> Volts {
        self.volts
    }

    /// Force on the probe at the newest step.
    pub fn force(&self) -> Newtons {
        self.force
    }

    /// Force on the cell at the newest step: that on the probe, and weights that a person has put on.
    pub fn on_cell(&self) -> Newtons {
        self.cell_force
    }

    /// True position of the axis, in mm from the edge of the home switch.
    pub fn axis(&self) -> Position {
        self.axis
    }

    /// Whether the home switch is closed.
    pub fn is_home(&self) -> bool {
        self.axis.0 <= 0.0
    }

    /// Whether the limit switch at the far end is closed.
    pub fn is_forward_limit(&self) -> bool {
        self.axis.0 >= TRAVEL.0 + SWITCH_MARGIN_MM
    }

    /// Whether the limit switch behind home is closed.
    pub fn is_reverse_limit(&self) -> bool {
        self.axis.0 <= -SWITCH_MARGIN_MM
    }

    /// The cell's signal goes wrong, or right again with `None`.
    pub fn spoil(&mut self, fault: Option<CellFault>) {
        self.fault = fault;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_probe_feels_the_tissue_and_the_switches_close_at_the_ends() {
        let dt = Seconds(0.001);
        let mut plant = EmulatedPlant::new(&SimSettings::default(), dt);
        let free = plant.volts();
        plant.shift(-100.0);
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
        plant.spoil(Some(CellFault::Stuck));
        let stuck = plant.volts();
        plant.advance(at - 5.0, dt);
        assert_eq!(plant.volts(), stuck);
        plant.spoil(Some(CellFault::Saturated));
        plant.advance(home - 0.001, dt);
        assert_eq!(plant.volts(), SATURATED);
        assert!(plant.is_home() && !plant.is_reverse_limit());
        plant.advance(home - 2.1, dt);
        assert!(plant.is_reverse_limit());
        plant.advance(home + 152.1, dt);
        assert!(plant.is_forward_limit() && !plant.is_home());
    }
}
