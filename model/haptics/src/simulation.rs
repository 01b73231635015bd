//! The whole system on a simulated device: master, hand, slave and the specimen under it.

use super::closed_loop::{HapticPlant, PlantCommand, PlantSettings, SensedPosition};
use super::force::{ForceLaw, LawSettings};
use super::master_slave::{
    MasterSlave, MasterSlaveError, MasterSlaveInput, MasterSlaveOutput, MasterSlaveSettings,
    MasterSlaveSnapshot,
};
use super::rig::SimulatedHand;
use super::torque::TorqueSettings;
use super::{GuardSettings, Period};
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use palpate_model::viscoelastic::ModifiedKelvin;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulationSettings {
    pub system: MasterSlaveSettings,
    pub plant: PlantSettings,
    /// The specimen that the slave presses.
    pub specimen: ModifiedKelvin,
}

impl SimulationSettings {
    /// The source's system on the source's rack, with a hand; the specimen is the body that is rendered.
    #[must_use]
    pub fn of(body: ModifiedKelvin, period: Period, hand: SimulatedHand) -> Self {
        let system = MasterSlaveSettings::of(LawSettings::of::<3>(body, period));
        let torque = &system.torque;
        let friction = torque.friction().0;
        let plant = PlantSettings {
            count_mm: system.count_mm(),
            motor: Some((torque.motor, torque.pinion)),
            friction: [friction; 2],
            hand,
            ..PlantSettings::bare(period)
        };
        Self { system, plant, specimen: body }
    }

    /// The same without guard and controller: the force is bounded by nothing but the drive.
    #[must_use]
    pub fn unguarded(mut self) -> Self {
        self.system.controller = None;
        self.system.guard = GuardSettings::OPEN;
        self.system.law.force_max = Newtons(1e3);
        self
    }
}

/// One tick of a simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulationTick {
    /// Time at its end.
    pub t: Seconds,
    /// True place of the master in mm.
    pub x: f64,
    /// True speed of the master.
    pub v: MmPerS,
    /// Force of the hand on the master.
    pub hand: Newtons,
    /// Force of the motor at the rack, against motion into the tissue.
    pub motor: Newtons,
    /// Temperature of the winding in degrees Celsius.
    pub winding_c: f64,
    pub input: MasterSlaveInput,
    pub output: MasterSlaveOutput,
    pub snapshot: MasterSlaveSnapshot,
}

/// A simulation with its state; the same settings give the same ticks, bit by bit.
#[derive(Clone, Copy, Debug)]
pub struct Simulation {
    torque: TorqueSettings,
    period: Period,
    plant: HapticPlant,
    system: MasterSlave,
    specimen: ForceLaw,
    cell: Newtons,
    command: PlantCommand,
    away: u64,
    tick: u64,
    last: MasterSlaveOutput,
}

impl Simulation {
    /// At the start, nothing touched.
    pub fn new(settings: &SimulationSettings) -> Result<Self, MasterSlaveError> {
        let period = settings.system.law.period;
        let surface = Depth(-settings.system.surface_mm);
        let specimen = LawSettings {
            force_max: Newtons(1e3),
            speed_max: MmPerS(1e6),
            ..LawSettings::of::<3>(settings.specimen, period)
        };
        let system = MasterSlave::new(&settings.system)?;
        let snapshot = system.snapshot();
        Ok(Self {
            torque: settings.system.torque,
            period,
            plant: HapticPlant::new(&settings.plant),
            system,
            specimen: ForceLaw::new(specimen, surface)?,
            cell: Newtons(0.0),
            command: PlantCommand::Drive(settings.system.torque.drive(snapshot.bias)),
            away: 0,
            tick: 0,
            last: MasterSlaveOutput {
                pulses: 0,
                bias: snapshot.bias,
                force: Newtons(0.0),
                flags: snapshot.flags,
            },
        })
    }

    pub fn plant(&self) -> &HapticPlant {
        &self.plant
    }

    /// The hand goes to another place: see [`HapticPlant::lead`].
    pub fn lead(&mut self, to: f64, speed: MmPerS) {
        self.plant.lead(to, speed);
    }

    pub fn system(&self) -> &MasterSlave {
        &self.system
    }

    /// One tick of everything.
    pub fn tick(&mut self) -> SimulationTick {
        let tick = self.tick_with(self.cell, true);
        // The slave is where it was sent by the end of the tick, and its cell feels the specimen there.
        self.cell = self.specimen.tick(tick.snapshot.depth).force;
        tick
    }

    /// One tick with a slave elsewhere, whose cell felt this last, and with force only if it is wanted.
    pub fn tick_with(&mut self, cell: Newtons, is_on: bool) -> SimulationTick {
        let SensedPosition { counts, .. } = self.plant.sense();
        let input =
            MasterSlaveInput { counts, elapsed: self.away + 1, cell, slave_pulses: None, is_on };
        self.away = 0;
        self.last = self.system.tick(&input);
        self.command = PlantCommand::Drive(self.torque.drive(self.last.bias));
        self.moved(input)
    }

    /// A tick in which the loop is away: the drive holds, the hand goes on.
    pub fn tick_stalled(&mut self) -> SimulationTick {
        self.away += 1;
        let depth = self.system.snapshot().depth;
        self.cell = self.specimen.tick(depth).force;
        let input = MasterSlaveInput {
            counts: self.plant.sense().counts,
            elapsed: 0,
            cell: self.cell,
            slave_pulses: None,
            is_on: true,
        };
        self.moved(input)
    }

    fn moved(&mut self, input: MasterSlaveInput) -> SimulationTick {
        self.plant.tick(self.command);
        self.tick += 1;
        let HapticPlant { rack, thermal, hand_force, motor_force, .. } = self.plant;
        SimulationTick {
            t: self.period.time_of(self.tick).seconds(),
            x: rack.x,
            v: MmPerS(rack.v),
            hand: Newtons(hand_force),
            motor: Newtons(-motor_force),
            winding_c: thermal.winding_c,
            input,
            output: self.last,
            snapshot: self.system.snapshot(),
        }
    }
}
