//! A device with a hand on it, simulated: what a loop does before hardware does it.
//!
//! Deterministic: the same settings give the same run, bit by bit. Between ticks the device moves in equal parts of a
//! tick, its force held; commands reach it whole ticks late where a delay is set. The loop itself is whoever calls
//! [`HapticPlant::sense`] and [`HapticPlant::tick`] in turn; [`MasterSlave`](super::MasterSlave) is one.

use super::rig::{
    DriveInput, HandPath, Motor, MotorState, Pinion, Rack, RackForces, SimulatedHand, ThermalState,
};
use super::{DELAY_MAX, Period};
use palpate_model::units::{MmPerS, Newtons};

/// A device and the hand on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantSettings {
    pub period: Period,
    /// Parts of a tick in which the device moves.
    pub parts: u32,
    /// Mass that moves without the hand, in kg.
    pub mass_kg: f64,
    /// Its own damping in N s/mm, without the motor's.
    pub damping: f64,
    /// Friction sliding and at rest, in N.
    pub friction: [f64; 2],
    /// Way per encoder count in mm; zero for an encoder without steps.
    pub count_mm: f64,
    /// Whole ticks from a command to its force, at most [`DELAY_MAX`].
    pub delay: usize,
    /// The motor on its pinion; `None` for a source of force without faults.
    pub motor: Option<(Motor, Pinion)>,
    pub hand: SimulatedHand,
    /// Place at the start, in mm.
    pub x: f64,
    /// Speed at the start, in mm/s.
    pub v: f64,
    /// Force commanded before the first tick, which a late device still gives.
    pub held: Newtons,
}

impl PlantSettings {
    /// The source's rack without damping, friction, steps, delay, motor or hand, at rest at the surface. 20 parts of a
    /// millisecond are 50 us, a quarter of the time constant of its winding.
    #[must_use]
    pub fn bare(period: Period) -> Self {
        Self {
            period,
            parts: 20,
            mass_kg: 0.11,
            damping: 0.0,
            friction: [0.0; 2],
            count_mm: 0.0,
            delay: 0,
            motor: None,
            hand: SimulatedHand::NONE,
            x: 0.0,
            v: 0.0,
            held: Newtons(0.0),
        }
    }
}

/// What a loop commands the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlantCommand {
    /// So many N against motion into the tissue; a motor takes it as no command.
    Force(Newtons),
    /// The motor's drive, positive against motion into the tissue.
    Drive(DriveInput),
}

/// What a loop reads from the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensedPosition {
    /// Counts of the encoder; zero for one without steps.
    pub counts: i64,
    /// The place they stand for, in mm.
    pub place: f64,
}

#[derive(Clone, Copy, Debug)]
pub struct HapticPlant {
    settings: PlantSettings,
    /// True motion and energies.
    pub rack: Rack,
    motor: MotorState,
    /// Temperatures of the motor.
    pub thermal: ThermalState,
    queue: [PlantCommand; DELAY_MAX + 1],
    tick: u64,
    /// The tick at which the hand's path began.
    begun: u64,
    /// Force of the hand, in N, at the end of the last part of a tick.
    pub hand_force: f64,
    /// Force of the motor into the tissue then, in N.
    pub motor_force: f64,
}

impl HapticPlant {
    #[must_use]
    pub fn new(settings: &PlantSettings) -> Self {
        let mass_kg = settings.mass_kg + settings.hand.mass_kg;
        let mut rack = Rack::new(mass_kg, settings.damping, settings.friction, settings.x);
        rack.v = settings.v;
        let thermal = settings.motor.map_or(Motor::SOURCE, |(motor, _)| motor);
        Self {
            settings: *settings,
            rack,
            motor: MotorState::default(),
            thermal: thermal.thermal.cold(),
            queue: [PlantCommand::Force(settings.held); DELAY_MAX + 1],
            tick: 0,
            begun: 0,
            hand_force: 0.0,
            motor_force: 0.0,
        }
    }

    /// From the next tick on the hand goes from where it wants to be now to another place, at `speed` above zero.
    pub fn lead(&mut self, to: f64, speed: MmPerS) {
        let from = self.settings.hand.path.at(self.path_time());
        self.begun = self.tick;
        self.settings.hand.path = HandPath::RampHold { from, to, speed: speed.0 };
    }

    /// How long the hand has been on its path at the begin of a tick, in s.
    fn path_time(&self) -> f64 {
        (self.tick - self.begun) as f64 * self.settings.period.seconds().0
    }

    /// What its encoder says.
    pub fn sense(&self) -> SensedPosition {
        let step = self.settings.count_mm;
        if step > 0.0 {
            // A cast beyond the numbers is their end.
            let counts = (self.rack.x / step).floor() as i64;
            let place = counts as f64 * step;
            SensedPosition { counts, place }
        } else {
            let place = self.rack.x;
            SensedPosition { counts: 0, place }
        }
    }

    /// Moves through one tick. The hand's path begins with the first.
    pub fn tick(&mut self, command: PlantCommand) {
        let Self { settings, .. } = *self;
        const RING: u64 = DELAY_MAX as u64 + 1;
        let delay = settings.delay.min(DELAY_MAX) as u64;
        self.queue[(self.tick % RING) as usize] = command;
        let due = if self.tick >= delay {
            self.queue[((self.tick - delay) % RING) as usize]
        } else {
            PlantCommand::Force(settings.held)
        };
        let parts = settings.parts.max(1);
        let dt = settings.period.seconds().0 / f64::from(parts);
        let begun = self.path_time();
        for part in 0..parts {
            let t = begun + (f64::from(part) + 0.5) * dt;
            let path = &settings.hand.path;
            let [early, late] = [path.at(t - 0.5 * dt), path.at(t + 0.5 * dt)];
            let motor = match (settings.motor, due) {
                (None, PlantCommand::Force(force)) => -force.0,
                (None, PlantCommand::Drive(_)) => 0.0,
                (Some((motor, pinion)), due) => {
                    // Outwards is positive for the drive, inwards for the rack.
                    let drive = match due {
                        PlantCommand::Drive(drive) => drive,
                        PlantCommand::Force(_) => DriveInput::Current(0.0),
                    };
                    let omega = -self.rack.v / pinion.radius_mm();
                    self.motor = motor.after(self.motor, drive, omega, dt);
                    let watts = self.motor.amps * self.motor.amps * motor.resistance;
                    self.thermal = motor.thermal.after(self.thermal, watts, dt);
                    -motor.torque(self.motor.amps) / pinion.radius_mm()
                }
            };
            let forces = RackForces { motor, hand: [0.5 * (early + late), (late - early) / dt] };
            self.hand_force = self.rack.step(&forces, &settings.hand, dt);
            self.motor_force = motor;
        }
        self.tick += 1;
    }
}
