//! One tick of the whole: encoder counts and the cell's force in, slave pulses and a bias voltage out.

use super::Flags;
use super::buzz::{Buzz, BuzzDetector, BuzzSettings};
use super::contact::{ContactDetector, ContactError, ContactSettings};
use super::controller::{ControllerSettings, PassivityController};
use super::force::{ForceLaw, LawError, LawSettings};
use super::guard::{ForceGuard, GuardSettings};
use super::margin::{Device, Margin, Watch};
use super::observer::{DELAY_MAX, PassivityObserver};
use super::rig::{
    Encoder, EncoderCounter, EncoderError, Gear, GearError, GearRatio, MotorError, SlaveDrive,
    ThermalState,
};
use super::torque::{TorqueError, TorqueSettings};
use palpate_model::time::Nanos;
use palpate_model::units::{Depth, MmPerS, Newtons, Volts};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Everything a master-slave system is made of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MasterSlaveSettings {
    /// The force law and the tick.
    pub law: LawSettings,
    /// Bounds of the force.
    pub guard: GuardSettings,
    /// The passivity controller; `None` for none. Its delay is that of the system.
    pub controller: Option<ControllerSettings>,
    /// What counts as a buzz; `None` for two counts above 8 Hz.
    pub buzz: Option<BuzzSettings>,
    /// Thresholds of contact.
    pub contact: ContactSettings,
    /// The master's encoder.
    pub encoder: Encoder,
    /// The slave's drive.
    pub slave: SlaveDrive,
    /// The master's motor and what drives it.
    pub torque: TorqueSettings,
    /// The master's own damping without its motor, in N s/mm, for the margin.
    pub damping: f64,
    /// Ticks from a count to the force made of it, for the margin; the controller takes the nearest whole number.
    pub delay_ticks: f64,
    /// Way of the slave from its start to the surface, in mm.
    pub surface_mm: f64,
}

impl MasterSlaveSettings {
    /// The source's hardware for a law, with the guards as they are by default, contact at 50 mN, the surface where the
    /// slave starts, and a count's force made within its tick.
    #[must_use]
    pub fn of(law: LawSettings) -> Self {
        let torque = TorqueSettings::default();
        let radius = torque.pinion.radius_mm();
        Self {
            law,
            guard: GuardSettings::default(),
            controller: Some(ControllerSettings::of(
                torque.motor.inertia_kg_mm2 / (radius * radius),
            )),
            buzz: None,
            contact: ContactSettings {
                on: Newtons(0.05),
                off: Newtons(0.02),
            },
            encoder: Encoder::default(),
            slave: SlaveDrive::default(),
            torque,
            damping: 0.0,
            delay_ticks: 0.0,
            surface_mm: 0.0,
        }
    }

    /// Way of the master per count, in mm.
    #[must_use]
    pub fn count_mm(&self) -> f64 {
        self.encoder.count_mm(&self.torque.pinion)
    }

    /// The margin of these settings, for before play and during it.
    #[must_use]
    pub fn watch(&self) -> Watch {
        Watch {
            body: self.law.body,
            scheme: self.law.scheme,
            period: self.law.period,
            device: Device {
                damping: self.damping + self.torque.damping(),
                friction: self.torque.friction(),
                count_mm: self.count_mm(),
                delay_ticks: self.delay_ticks,
            },
        }
    }
}

/// Settings that make no system.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MasterSlaveError {
    /// The law.
    #[error(transparent)]
    Law(#[from] LawError),
    /// The thresholds.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// The encoder.
    #[error(transparent)]
    Encoder(#[from] EncoderError),
    /// The gear.
    #[error(transparent)]
    Gear(#[from] GearError),
    /// The motor.
    #[error(transparent)]
    Motor(#[from] MotorError),
    /// Its drive.
    #[error(transparent)]
    Torque(#[from] TorqueError),
    /// The device's own numbers.
    #[error("a master with {name} = {value} {unit} is not possible; it is from 0 to {most} {unit}")]
    Device {
        /// Which.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// The largest there is.
        most: f64,
    },
    /// The surface.
    #[error("the surface cannot be {0} mm from where the slave starts; give a finite distance")]
    Surface(f64),
}

/// What comes in with a tick; the same inputs give the same outputs, bit by bit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// Counts of the master's encoder.
    pub counts: i64,
    /// Ticks since the last input: one, unless the loop was away.
    pub elapsed: u64,
    /// Force on the slave's load cell.
    pub cell: Newtons,
    /// Pulses at which the slave is, from its start; `None` if it is taken to be where it was sent.
    pub slave_pulses: Option<i64>,
    /// Whether force is wanted at all.
    pub is_on: bool,
}

/// What goes out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// Pulses for the slave in this tick.
    pub pulses: i64,
    /// Bias voltage of the master's motor, positive against motion into the tissue.
    pub bias: Volts,
    /// The force it stands for.
    pub force: Newtons,
    /// What was special.
    pub flags: Flags,
}

/// The state of everything after a tick, as screens and records take it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Snapshot {
    /// Ticks since the start, those away included.
    pub tick: u64,
    /// The time of that.
    pub time: Nanos,
    /// The master's encoder.
    pub counts: i64,
    /// Way of the master from its start, in mm.
    pub master_mm: f64,
    /// Speed of the master.
    pub master_speed: MmPerS,
    /// Pulses sent to the slave since the start.
    pub pulses: i64,
    /// Pulses that wait for the slave's drive.
    pub behind: i64,
    /// Depth of the slave.
    pub depth: Depth,
    /// Speed of the slave.
    pub speed: MmPerS,
    /// Force on the cell.
    pub cell: Newtons,
    /// Whether it touches.
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
    /// Bias voltage.
    pub bias: Volts,
    /// Temperature of the motor's winding as its commands let expect, in degrees Celsius.
    pub winding_c: f64,
    /// A buzz, if there is one.
    pub buzz: Option<Buzz>,
    /// The margin at this depth.
    pub margin: Margin,
    /// What was special.
    pub flags: Flags,
    /// Of all before, so that a torn copy is told.
    pub checksum: u64,
}

impl Snapshot {
    /// FNV-1a over the bits of every field but the checksum.
    #[must_use]
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
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.sum() == self.checksum
    }
}

/// The system with its state.
#[derive(Clone, Copy, Debug)]
pub struct MasterSlave {
    law: ForceLaw,
    guard: ForceGuard,
    controller: Option<PassivityController>,
    observer: PassivityObserver,
    buzz: BuzzDetector,
    contact: ContactDetector,
    counter: EncoderCounter,
    gear: Gear,
    torque: TorqueSettings,
    watch: Watch,
    count_mm: f64,
    mm_per_pulse: f64,
    surface_mm: f64,
    force_max: f64,
    origin: Option<i64>,
    direction: i64,
    still: u64,
    thermal: ThermalState,
    snapshot: Snapshot,
}

/// Ticks of a stall that the model is led through one by one; after longer ones its memory is as old as it was.
const CAUGHT_UP: u64 = 64;

/// A count in 0.1 s is 0.15 mm/s with the source's encoder, a fifth of its slowest check.
const HEADING_S: f64 = 0.1;

impl MasterSlave {
    /// At the start: the first counts are where master and slave are.
    pub fn new(settings: &MasterSlaveSettings) -> Result<Self, MasterSlaveError> {
        let period = settings.law.period;
        settings.contact.checked()?;
        settings.encoder.checked()?;
        settings.torque.motor.checked()?;
        settings.torque.checked()?;
        let device = [
            ("damping", settings.damping, "N s/mm", f64::MAX),
            ("delay", settings.delay_ticks, "ticks", DELAY_MAX as f64),
        ];
        for (name, value, unit, most) in device {
            if !(0.0..=most).contains(&value) {
                return Err(MasterSlaveError::Device {
                    name,
                    value,
                    unit,
                    most,
                });
            }
        }
        if !settings.surface_mm.is_finite() {
            return Err(MasterSlaveError::Surface(settings.surface_mm));
        }
        let pinion = &settings.torque.pinion;
        let mm_per_pulse = settings.slave.mm_per_pulse;
        let ratio = GearRatio::one_to_one(pinion, &settings.encoder, mm_per_pulse)?;
        let count_mm = settings.count_mm();
        let heard = settings.buzz.unwrap_or(BuzzSettings::of(count_mm));
        let depth = Depth(0.0 - settings.surface_mm);
        let watch = settings.watch();
        let delay_ticks = settings.delay_ticks.round() as usize;
        let controller = settings
            .controller
            .map(|one| ControllerSettings { delay_ticks, ..one });
        let force_max = settings.guard.force_max.0;
        let thermal = settings.torque.motor.thermal.cold();
        Ok(Self {
            law: ForceLaw::new(settings.law, depth)?,
            guard: ForceGuard::new(&settings.guard, period),
            controller: controller.map(|one| PassivityController::new(&one, period)),
            observer: PassivityObserver::late(delay_ticks),
            buzz: BuzzDetector::new(&heard, period, 0.0),
            contact: ContactDetector::new(settings.contact),
            counter: EncoderCounter::new(&settings.encoder, period),
            gear: Gear::new(ratio, &settings.slave, period),
            torque: settings.torque,
            watch,
            count_mm,
            mm_per_pulse,
            surface_mm: settings.surface_mm,
            force_max: if force_max > 0.0 { force_max } else { 0.0 },
            origin: None,
            direction: 0,
            still: 0,
            thermal,
            snapshot: Snapshot {
                tick: 0,
                time: Nanos::ZERO,
                counts: 0,
                master_mm: 0.0,
                master_speed: MmPerS(0.0),
                pulses: 0,
                behind: 0,
                depth,
                speed: MmPerS(0.0),
                cell: Newtons(0.0),
                is_touching: false,
                model: Newtons(0.0),
                guarded: Newtons(0.0),
                force: Newtons(0.0),
                damping: 0.0,
                energy: 0.0,
                torque: 0.0,
                bias: Volts(0.0),
                winding_c: thermal.winding_c,
                buzz: None,
                margin: watch.at(depth, MmPerS(0.0)),
                flags: Flags::NONE,
                checksum: 0,
            },
        })
    }

    /// Everything after the last tick.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            checksum: self.snapshot.sum(),
            ..self.snapshot
        }
    }

    /// The largest force that the controller's damping took.
    #[must_use]
    pub fn worst_damping_force(&self) -> Newtons {
        self.controller
            .map_or(Newtons(0.0), |one| one.worst_force())
    }

    /// Which way the master goes, for what helps against friction: slow motion has many ticks without a count, so that a
    /// direction holds until [`HEADING_S`] have passed without one.
    fn heading(&mut self, moved: i64, elapsed: u64) -> MmPerS {
        if moved != 0 {
            self.direction = moved.signum();
            self.still = 0;
        } else {
            self.still = self.still.saturating_add(elapsed);
        }
        let is_moving = self.still as f64 * self.watch.period.seconds().0 < HEADING_S;
        MmPerS(if is_moving {
            self.direction as f64
        } else {
            0.0
        })
    }

    /// Takes one input and gives one output.
    #[must_use]
    pub fn tick(&mut self, input: &Input) -> Output {
        let elapsed = input.elapsed.max(1);
        let before = self.snapshot;
        let span = self.watch.period.seconds().0 * elapsed as f64;
        // The master, and the slave after it.
        let origin = *self.origin.get_or_insert(input.counts);
        let (moved, mut flags) = self.counter.tick(input.counts, elapsed);
        let gear = self.gear.tick(input.counts);
        let slave = input.slave_pulses.unwrap_or(gear.made) as f64 * self.mm_per_pulse;
        let wanted = Depth(slave - self.surface_mm);
        flags |= gear.flags | self.contact.tick(input.cell);
        let is_touching = self.contact.is_touching();
        // The model, led straight through what was missed.
        let steps = elapsed.min(CAUGHT_UP);
        let mut law = self.law.tick(Depth(
            before.depth.0 + (wanted.0 - before.depth.0) / steps as f64,
        ));
        flags |= law.flags;
        for step in 2..=steps {
            let share = step as f64 / steps as f64;
            law = self
                .law
                .tick(Depth(before.depth.0 + (wanted.0 - before.depth.0) * share));
            flags |= law.flags;
        }
        // A winding too hot gets no more than it may have for ever, until it has cooled.
        let motor = &self.torque.motor;
        let is_hot = self.thermal.winding_c > motor.thermal.winding_max_c;
        let lasting = if is_hot {
            motor.continuous / self.torque.pinion.radius_mm()
        } else {
            f64::MAX
        };
        let asked = if input.is_on { law.force.0 } else { 0.0 };
        let asked = Newtons(asked.clamp(-lasting, lasting));
        flags |= Flags::OFF.when(!input.is_on) | Flags::HOT.when(is_hot);
        if input.is_on && before.flags.has(Flags::OFF) {
            self.guard.restart();
        }
        let guarded = self.guard.tick(asked, is_touching, elapsed);
        flags |= guarded.flags;
        // What the loop makes of it.
        let master_mm = input.counts.saturating_sub(origin) as f64 * self.count_mm;
        self.observer.moved(moved as f64 * self.count_mm);
        let energy = self.observer.energy();
        let buzz = self.buzz.tick(master_mm, elapsed, energy);
        flags |= Flags::BUZZ.when(buzz.is_some());
        let mut damping = 0.0;
        let mut force = guarded.force.0;
        if let Some(controller) = &mut self.controller {
            // While what made it buzz lasts, so does the caution.
            let lasts = controller.is_hushed() && is_touching && !before.margin.is_enough();
            if buzz.is_some() || lasts {
                controller.heard_buzz();
            }
            let moved = (moved, self.count_mm);
            let one = controller.tick(moved, elapsed, guarded.force, is_touching);
            if input.is_on {
                damping = one.damping;
                flags |= one.flags;
                force = one.force.0.clamp(-self.force_max, self.force_max);
            }
            controller.rendered(Newtons(force));
        }
        self.observer.hold(force);
        let master_speed = MmPerS(moved as f64 * self.count_mm / span);
        let heading = self.heading(moved, elapsed);
        let torque = self.torque.tick(Newtons(force), heading);
        let amps = self.torque.amps_at_rest(torque.bias);
        let watts = amps * amps * self.torque.motor.resistance;
        self.thermal = self.torque.motor.thermal.after(self.thermal, watts, span);
        let margin = self.watch.at(law.depth, MmPerS(0.0));
        flags |= torque.flags | Flags::MARGIN.when(is_touching && !margin.is_enough());
        let tick = before.tick.saturating_add(elapsed);
        self.snapshot = Snapshot {
            tick,
            time: self.watch.period.time_of(tick),
            counts: input.counts,
            master_mm,
            master_speed,
            pulses: gear.made,
            behind: gear.behind,
            depth: law.depth,
            speed: MmPerS((law.depth.0 - before.depth.0) / span),
            cell: input.cell,
            is_touching,
            model: law.model,
            guarded: guarded.force,
            force: Newtons(force),
            damping,
            energy,
            torque: torque.torque,
            bias: torque.bias,
            winding_c: self.thermal.winding_c,
            buzz,
            margin,
            flags,
            checksum: 0,
        };
        Output {
            pulses: gear.pulses,
            bias: torque.bias,
            force: Newtons(force),
            flags,
        }
    }
}
