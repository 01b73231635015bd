//! The state after a tick.

use crate::buzz::Buzz;
use crate::flags::Flags;
use crate::margin::{Margin, MarginSettings};
use palpate_model::time::Nanos;
use palpate_model::units::{Depth, MmPerS, Newtons, Volts};
use serde::Serialize;

/// The state of everything after a tick, as screens and records take it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MasterSlaveSnapshot {
    /// Ticks since the start, those away included.
    pub tick: u64,
    pub time: Nanos,
    pub counts: i64,
    /// Way of the master from its start, in mm.
    pub master_mm: f64,
    pub master_speed: MmPerS,
    /// Pulses sent to the slave since the start.
    pub pulses: i64,
    /// Pulses that wait for the slave's drive.
    pub behind: i64,
    /// Depth of the slave.
    pub depth: Depth,
    pub speed: MmPerS,
    pub cell: Newtons,
    pub is_touching: bool,
    /// Force of the model.
    pub model: Newtons,
    /// Force that the guard let through.
    pub guarded: Newtons,
    /// Force rendered, with the controller's damping.
    pub force: Newtons,
    /// Damping that the controller added, in N s/mm.
    pub damping: f64,
    /// Energy that the rendered force has absorbed, in N mm.
    pub energy: f64,
    /// Torque commanded, in N mm.
    pub torque: f64,
    pub bias: Volts,
    /// Temperature of the motor's winding as its commands let expect, in degrees Celsius.
    pub winding_c: f64,
    /// A buzz, if there is one.
    pub buzz: Option<Buzz>,
    pub margin: Margin,
    pub flags: Flags,
    /// Checksum of all fields above, so that a torn copy is detected.
    pub checksum: u64,
}

impl MasterSlaveSnapshot {
    /// Before the first tick.
    pub(super) fn at_start(watch: &MarginSettings, depth: Depth, winding_c: f64) -> Self {
        let margin = watch.at(depth, MmPerS(0.0));
        Self { depth, winding_c, margin, ..Self::default() }
    }

    /// FNV-1a over the bits of every field but the checksum.
    pub fn sum(&self) -> u64 {
        let floats = [
            self.master_mm,
            self.master_speed.0,
            self.depth.0,
            self.speed.0,
            self.cell.0,
            self.model.0,
            self.guarded.0,
            self.force.0,
            self.damping,
            self.energy,
            self.torque,
            self.bias.0,
            self.winding_c,
            self.buzz.map_or(-1.0, |buzz| buzz.frequency_hz),
            self.buzz.map_or(-1.0, |buzz| buzz.amplitude_mm),
            self.margin.depth.0,
            self.margin.needed,
            self.margin.has,
            self.margin.friction_needed.0,
            self.margin.friction.0,
        ];
        let others = [
            self.tick,
            self.time.0,
            self.counts as u64,
            self.pulses as u64,
            self.behind as u64,
            u64::from(self.is_touching),
            u64::from(self.flags.bits()),
            self.margin.cause as u64,
        ];
        let words = others.into_iter().chain(floats.map(f64::to_bits));
        words.fold(0xCBF2_9CE4_8422_2325, |sum, word| {
            (sum ^ word).wrapping_mul(0x0000_0100_0000_01B3)
        })
    }

    /// Whether every field is of the same tick.
    pub fn is_whole(&self) -> bool {
        self.sum() == self.checksum
    }
}
