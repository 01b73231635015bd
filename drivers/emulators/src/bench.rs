//! An emulated axis and an emulated load cell, each on a line of its own, before one slide.

use super::cell::{CellLoad, EmulatedCell};
use super::{DeviceFault, EmulatedDevice, EmulatedPlant};
use crate::plant::CellFault;
use palpate_drivers::sim::SimSettings;
use palpate_model::rig::HandAction;
use palpate_model::{Nanos, Seconds};

/// The bench goes on in steps of a millisecond.
const STEP: Nanos = Nanos::from_millis(1);
const STEP_SECS: Seconds = Seconds(0.001);

/// Switches of the slide.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SlideSwitches {
    /// At or behind home.
    pub is_home: bool,
    /// At the far end.
    pub is_forward: bool,
    /// Behind home.
    pub is_reverse: bool,
}

/// A motion controller without a load cell. Times never go backwards.
pub trait EmulatedAxis: Send {
    /// Bytes have arrived.
    fn receive(&mut self, now: Nanos, bytes: &[u8]);

    /// A millisecond has passed.
    fn advance(&mut self, now: Nanos, switches: SlideSwitches);

    /// Where its counter says it is, in mm of the slide.
    fn counter_mm(&self) -> f64;

    /// By how much, in mm, its counter has begun to read less since this was last asked, wherever the slide stands.
    fn take_counter_shift(&mut self) -> f64;

    /// What it has sent since it was last asked.
    fn transmit(&mut self) -> Vec<u8>;

    /// A fault of the device itself begins or ends.
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
    /// As it is switched on.
    #[must_use]
    pub fn new(
        sim: &SimSettings,
        axis: Box<dyn EmulatedAxis>,
        cell: Box<dyn EmulatedCell>,
    ) -> Self {
        Self { axis, cell, plant: EmulatedPlant::new(sim, STEP_SECS), now: Nanos::ZERO }
    }

    /// The slide, for tests.
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
                self.plant.shift(shift);
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
            DeviceFault::Stuck => self.plant.spoil(is_on.then_some(CellFault::Stuck)),
            DeviceFault::Saturated => self.plant.spoil(is_on.then_some(CellFault::Saturated)),
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
