//! An emulated axis and an emulated load cell on separate lines, with one slide behind both.

use super::cell::{CellLoad, EmulatedCell};
use super::{DeviceFault, EmulatedDevice, EmulatedPlant};
use crate::plant::CellFault;
use palpate_drivers::sim::SimSettings;
use palpate_model::rig::HandAction;
use palpate_model::{Nanos, Seconds};

/// Time step of the bench.
const STEP: Nanos = Nanos::from_millis(1);
const STEP_SECS: Seconds = Seconds(0.001);

/// Switches of the slide.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SlideSwitches {
    /// At or behind home.
    pub is_home: bool,
    pub is_forward: bool,
    pub is_reverse: bool,
}

/// A motion controller without a load cell. Times never go backwards.
pub trait EmulatedAxis: Send {
    fn receive(&mut self, now: Nanos, bytes: &[u8]);

    /// Advances by a millisecond.
    fn advance(&mut self, now: Nanos, switches: SlideSwitches);

    /// Position by its own counter, in mm of the slide.
    fn counter_mm(&self) -> f64;

    /// Decrease of the counter since the last call, in mm, that no motion of the slide explains.
    fn take_counter_shift(&mut self) -> f64;

    /// Bytes sent since the last call.
    fn transmit(&mut self) -> Vec<u8>;

    /// Begins or ends a fault of the device.
    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool);
}

/// Channel 0 is the axis, channel 1 the load cell.
pub struct EmulatedBench {
    axis: Box<dyn EmulatedAxis>,
    cell: Box<dyn EmulatedCell>,
    plant: EmulatedPlant,
    now: Nanos,
}

impl EmulatedBench {
    pub fn new(
        sim: &SimSettings,
        axis: Box<dyn EmulatedAxis>,
        cell: Box<dyn EmulatedCell>,
    ) -> Self {
        Self { axis, cell, plant: EmulatedPlant::new(sim, STEP_SECS), now: Nanos::ZERO }
    }

    pub fn plant(&self) -> &EmulatedPlant {
        &self.plant
    }
}

impl EmulatedDevice for EmulatedBench {
    fn channels(&self) -> usize {
        2
    }

    fn receive(&mut self, now: Nanos, channel: usize, bytes: &[u8]) {
        self.advance(now);
        if channel == 0 {
            self.axis.receive(now, bytes);
        } else {
            self.cell.receive(now, bytes);
        }
    }

    fn advance(&mut self, now: Nanos) {
        while self.now + STEP <= now {
            self.now = self.now + STEP;
            let switches = SlideSwitches {
                is_home: self.plant.is_home(),
                is_forward: self.plant.is_forward_limit(),
                is_reverse: self.plant.is_reverse_limit(),
            };
            self.axis.advance(self.now, switches);
            let shift = self.axis.take_counter_shift();
            if shift != 0.0 {
                self.plant.shift_counter(shift);
            }
            self.plant.advance(self.axis.counter_mm(), STEP_SECS);
            let load = CellLoad { volts: self.plant.volts(), force: self.plant.cell_force() };
            self.cell.advance(self.now, load);
        }
    }

    fn transmit(&mut self, channel: usize) -> Vec<u8> {
        if channel == 0 { self.axis.transmit() } else { self.cell.transmit() }
    }

    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool) {
        match fault {
            DeviceFault::Stuck => self.plant.set_cell_fault(is_on.then_some(CellFault::Stuck)),
            DeviceFault::Saturated => {
                self.plant.set_cell_fault(is_on.then_some(CellFault::Saturated))
            }
            DeviceFault::Reset | DeviceFault::WrongDevice => {
                self.axis.apply_fault(now, fault, is_on)
            }
        }
        self.cell.apply_fault(now, fault, is_on);
    }

    fn apply_hand_action(&mut self, now: Nanos, action: HandAction) {
        self.advance(now);
        self.plant.apply_hand_action(action);
    }
}
