//! An emulated axis and an emulated load cell, each on a line of its own, before one slide.

use super::cell::{EmulatedCell, Felt};
use super::{Device, DeviceFault, Plant};
use crate::plant::CellFault;
use palpate_drivers::sim::SimSettings;
use palpate_model::rig::HandAction;
use palpate_model::{Nanos, Seconds};

/// The bench goes on in steps of a millisecond.
const STEP: Nanos = Nanos::from_millis(1);
const STEP_SECS: Seconds = Seconds(0.001);

/// Switches of the slide.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Switches {
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
    fn advance(&mut self, now: Nanos, switches: Switches);

    /// Where its counter says it is, in mm of the slide.
    fn place_mm(&self) -> f64;

    /// By how much, in mm, its counter has begun to read less since this was last asked, wherever the slide stands.
    fn take_shift(&mut self) -> f64;

    /// What it has sent since it was last asked.
    fn transmit(&mut self) -> Vec<u8>;

    /// A fault of the device itself begins or ends.
    fn suffer(&mut self, now: Nanos, fault: DeviceFault, is_on: bool);
}

/// Channel 0 is the axis, channel 1 the load cell.
pub struct Bench {
    axis: Box<dyn EmulatedAxis>,
    cell: Box<dyn EmulatedCell>,
    plant: Plant,
    now: Nanos,
}

impl Bench {
    /// As it is switched on.
    #[must_use]
    pub fn new(
        sim: &SimSettings,
        axis: Box<dyn EmulatedAxis>,
        cell: Box<dyn EmulatedCell>,
    ) -> Self {
        Self { axis, cell, plant: Plant::new(sim, STEP_SECS), now: Nanos::ZERO }
    }

    /// The slide, for tests.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }
}

impl Device for Bench {
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
            let switches = Switches {
                is_home: self.plant.is_home(),
                is_forward: self.plant.is_forward_limit(),
                is_reverse: self.plant.is_reverse_limit(),
            };
            self.axis.advance(self.now, switches);
            let shift = self.axis.take_shift();
            if shift != 0.0 {
                self.plant.shift(shift);
            }
            self.plant.advance(self.axis.place_mm(), STEP_SECS);
            let felt = Felt { volts: self.plant.volts(), force: self.plant.on_cell() };
            self.cell.advance(self.now, felt);
        }
    }

    fn transmit(&mut self, channel: usize) -> Vec<u8> {
        if channel == 0 { self.axis.transmit() } else { self.cell.transmit() }
    }

    fn suffer(&mut self, now: Nanos, fault: DeviceFault, is_on: bool) {
        match fault {
            DeviceFault::Stuck => self.plant.spoil(is_on.then_some(CellFault::Stuck)),
            DeviceFault::Saturated => self.plant.spoil(is_on.then_some(CellFault::Saturated)),
            DeviceFault::Reset | DeviceFault::WrongDevice => self.axis.suffer(now, fault, is_on),
        }
        self.cell.suffer(now, fault, is_on);
    }

    fn by_hand(&mut self, now: Nanos, action: HandAction) {
        self.advance(now);
        self.plant.by_hand(action);
    }
}
