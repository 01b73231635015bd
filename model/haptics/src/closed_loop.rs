//! A device with a hand on it, simulated: what a loop does before hardware does it.
//!
//! Deterministic: the same settings give the same run, bit by bit. Between ticks the device moves in equal parts of a
//! tick, its force held; commands reach it whole ticks late where a delay is set. The loop itself is whoever calls
//! [`Plant::sense`] and [`Plant::tick`] in turn; [`Renderer`] is one of a spring or a law alone, and
//! [`MasterSlave`](super::MasterSlave) the whole.

use super::controller::{ControllerSettings, PassivityController};
use super::force::ForceLaw;
use super::guard::{ForceGuard, GuardSettings};
use super::rig::{
    Drive, Hand, HandPath, Motor, MotorState, Pinion, Rack, RackEnergies, RackForces, ThermalState,
};
use super::{BuzzDetector, BuzzSettings, DELAY_MAX, Flags, PassivityObserver, Period};
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};

/// A device and the hand on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantSettings {
    /// The loop's tick.
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
    /// The hand.
    pub hand: Hand,
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
            hand: Hand::NONE,
            x: 0.0,
            v: 0.0,
            held: Newtons(0.0),
        }
    }
}

/// What a loop tells the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// So many N against motion into the tissue; a motor takes it as no command.
    Force(Newtons),
    /// The motor's drive, positive against motion into the tissue.
    Drive(Drive),
}

/// What a loop is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensed {
    /// Counts of the encoder; zero for one without steps.
    pub counts: i64,
    /// The place they stand for, in mm.
    pub place: f64,
}

/// The device with its state.
#[derive(Clone, Copy, Debug)]
pub struct Plant {
    settings: PlantSettings,
    rack: Rack,
    motor: MotorState,
    thermal: ThermalState,
    queue: [Command; DELAY_MAX + 1],
    tick: u64,
    /// The tick at which the hand's path began.
    begun: u64,
    hand_force: f64,
    motor_force: f64,
}

impl Plant {
    /// At its start.
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
            queue: [Command::Force(settings.held); DELAY_MAX + 1],
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
        self.settings.hand.path = HandPath::RampHold {
            from,
            to,
            speed: speed.0,
        };
    }

    /// How long the hand has been on its path at the begin of a tick, in s.
    fn path_time(&self) -> f64 {
        (self.tick - self.begun) as f64 * self.settings.period.seconds().0
    }

    /// What its encoder says.
    #[must_use]
    pub fn sense(&self) -> Sensed {
        let step = self.settings.count_mm;
        if step > 0.0 {
            // A cast beyond the numbers is their end.
            let counts = (self.rack.x / step).floor() as i64;
            let place = counts as f64 * step;
            Sensed { counts, place }
        } else {
            let place = self.rack.x;
            Sensed { counts: 0, place }
        }
    }

    /// True place in mm and speed in mm/s.
    #[must_use]
    pub fn motion(&self) -> [f64; 2] {
        [self.rack.x, self.rack.v]
    }

    /// Force of the hand, then of the motor into the tissue, at the end of the last part of a tick, in N.
    #[must_use]
    pub fn forces(&self) -> [f64; 2] {
        [self.hand_force, self.motor_force]
    }

    /// Temperatures of the motor.
    #[must_use]
    pub fn thermal(&self) -> ThermalState {
        self.thermal
    }

    /// Current of the motor in A.
    #[must_use]
    pub fn amps(&self) -> f64 {
        self.motor.amps
    }

    /// Where the energies went, in N mm.
    #[must_use]
    pub fn energies(&self) -> RackEnergies {
        self.rack.energies
    }

    /// Energy of its motion, in N mm.
    #[must_use]
    pub fn kinetic(&self) -> f64 {
        self.rack.kinetic()
    }

    /// Moves through one tick. The hand's path begins with the first.
    pub fn tick(&mut self, command: Command) {
        let Self { settings, .. } = *self;
        const RING: u64 = DELAY_MAX as u64 + 1;
        let delay = settings.delay.min(DELAY_MAX) as u64;
        self.queue[(self.tick % RING) as usize] = command;
        let due = if self.tick >= delay {
            self.queue[((self.tick - delay) % RING) as usize]
        } else {
            Command::Force(settings.held)
        };
        let parts = settings.parts.max(1);
        let dt = settings.period.seconds().0 / f64::from(parts);
        let begun = self.path_time();
        for part in 0..parts {
            let t = begun + (f64::from(part) + 0.5) * dt;
            let path = &settings.hand.path;
            let [early, late] = [path.at(t - 0.5 * dt), path.at(t + 0.5 * dt)];
            let motor = match (settings.motor, due) {
                (None, Command::Force(force)) => -force.0,
                (None, Command::Drive(_)) => 0.0,
                (Some((motor, pinion)), due) => {
                    // Outwards is positive for the drive, inwards for the rack.
                    let drive = match due {
                        Command::Drive(drive) => drive,
                        Command::Force(_) => Drive::Current(0.0),
                    };
                    let omega = -self.rack.v / pinion.radius_mm();
                    self.motor = motor.after(self.motor, drive, omega, dt);
                    let watts = self.motor.amps * self.motor.amps * motor.resistance;
                    self.thermal = motor.thermal.after(self.thermal, watts, dt);
                    -motor.torque(self.motor.amps) / pinion.radius_mm()
                }
            };
            let forces = RackForces {
                motor,
                hand: [0.5 * (early + late), (late - early) / dt],
            };
            self.hand_force = self.rack.step(&forces, &settings.hand, dt);
            self.motor_force = motor;
        }
        self.tick += 1;
    }
}

/// A spring, or a body.
#[derive(Clone, Copy, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "one of them, on the stack of a simulation"
)]
pub enum Rendered {
    /// `stiffness` N/mm either way of zero.
    Spring {
        /// In N/mm.
        stiffness: f64,
    },
    /// The same on the inside of zero alone.
    Wall {
        /// In N/mm.
        stiffness: f64,
    },
    /// A law.
    Law(ForceLaw),
}

/// A loop of a spring or a law, with or without guard and controller, for simulation.
#[derive(Clone, Copy, Debug)]
pub struct Renderer {
    rendered: Rendered,
    guard: Option<ForceGuard>,
    controller: Option<PassivityController>,
    observer: PassivityObserver,
    buzz: BuzzDetector,
    count_mm: f64,
    last: Option<Sensed>,
}

/// What a renderer did in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RendererTick {
    /// The force, against motion into the tissue.
    pub force: Newtons,
    /// Energy that it has absorbed by the encoder's word, in N mm.
    pub energy: f64,
    /// What was special.
    pub flags: Flags,
}

/// Step of an encoder without steps, as a controller that counts sees it: a nanometre.
const STEPLESS_MM: f64 = 1e-6;

impl Renderer {
    /// For a plant.
    #[must_use]
    pub fn new(
        rendered: Rendered,
        plant: &PlantSettings,
        guard: Option<&GuardSettings>,
        controller: Option<&ControllerSettings>,
    ) -> Self {
        let period = plant.period;
        let count_mm = if plant.count_mm > 0.0 {
            plant.count_mm
        } else {
            STEPLESS_MM
        };
        let heard = BuzzSettings::of(plant.count_mm.max(0.001));
        Self {
            rendered,
            guard: guard.map(|one| ForceGuard::new(one, period)),
            controller: controller.map(|one| PassivityController::new(one, period)),
            observer: PassivityObserver::late(plant.delay),
            buzz: BuzzDetector::new(&heard, period, plant.x),
            count_mm,
            last: None,
        }
    }

    /// The controller, if there is one.
    #[must_use]
    pub fn controller(&self) -> Option<&PassivityController> {
        self.controller.as_ref()
    }

    /// One tick, `elapsed` ticks after the last.
    pub fn tick(&mut self, sensed: Sensed, elapsed: u64) -> RendererTick {
        let x = sensed.place;
        let moved = x - self.last.unwrap_or(sensed).place;
        self.last = Some(sensed);
        let (asked, mut flags) = match &mut self.rendered {
            Rendered::Spring { stiffness } => (*stiffness * x, Flags::NONE),
            Rendered::Wall { stiffness } => ((*stiffness * x).max(0.0), Flags::NONE),
            Rendered::Law(law) => {
                let one = law.tick(Depth(x));
                (one.force.0, one.flags)
            }
        };
        let is_touching = match self.rendered {
            Rendered::Spring { .. } => true,
            Rendered::Wall { .. } | Rendered::Law(_) => x > 0.0,
        };
        let mut force = Newtons(asked);
        if let Some(guard) = &mut self.guard {
            let one = guard.tick(force, is_touching, elapsed);
            force = one.force;
            flags |= one.flags;
        }
        self.observer.moved(moved);
        let buzz = self.buzz.tick(x, elapsed, self.observer.energy());
        flags |= Flags::BUZZ.when(buzz.is_some());
        if let Some(controller) = &mut self.controller {
            if buzz.is_some() {
                controller.heard_buzz();
            }
            let counts = (moved / self.count_mm).round() as i64;
            let one = controller.tick((counts, self.count_mm), elapsed, force, is_touching);
            force = one.force;
            flags |= one.flags;
        }
        self.observer.hold(force.0);
        RendererTick {
            force,
            energy: self.observer.energy(),
            flags,
        }
    }
}

/// One tick of a run, after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunTick {
    /// Time at its end.
    pub t: Seconds,
    /// True place in mm.
    pub x: f64,
    /// True speed in mm/s.
    pub v: f64,
    /// Energy that the force has truly absorbed, in N mm.
    pub absorbed: f64,
    /// What the renderer did.
    pub rendered: RendererTick,
}

/// Runs a loop for so many ticks and shows each to `seen`, which ends it by returning false.
pub fn run(
    plant: &mut Plant,
    renderer: &mut Renderer,
    ticks: u64,
    mut seen: impl FnMut(&RunTick) -> bool,
) {
    for _ in 0..ticks {
        let rendered = renderer.tick(plant.sense(), 1);
        plant.tick(Command::Force(rendered.force));
        let [x, v] = plant.motion();
        let one = RunTick {
            t: plant.settings.period.time_of(plant.tick).seconds(),
            x,
            v,
            absorbed: -plant.energies().motor,
            rendered,
        };
        if !seen(&one) {
            return;
        }
    }
}
