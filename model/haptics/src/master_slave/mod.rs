//! One tick of the whole: encoder counts and the cell's force in, slave pulses and a bias voltage out.

mod settings;
mod snapshot;

use crate::buzz::{BuzzDetector, BuzzSettings};
use crate::contact::ContactDetector;
use crate::controller::{ControllerSettings, ControllerTick, PassivityController};
use crate::flags::Flags;
use crate::force::{ForceLaw, LawTick};
use crate::guard::ForceGuard;
use crate::margin::MarginSettings;
use crate::observer::PassivityObserver;
use crate::rig::{EncoderCounter, Gear, GearRatio, ThermalState};
use crate::torque::TorqueSettings;
use palpate_model::units::{Depth, MmPerS, Newtons, Volts};
use serde::{Deserialize, Serialize};
pub use settings::{MasterSlaveError, MasterSlaveSettings};
pub use snapshot::MasterSlaveSnapshot;

/// Input of a tick; the same inputs give the same outputs, bit by bit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MasterSlaveInput {
    /// Counts of the master's encoder.
    pub counts: i64,
    /// Ticks since the last input: one, unless the loop was away.
    pub elapsed: u64,
    /// Force on the slave's load cell.
    pub cell: Newtons,
    /// Pulses at which the slave is, from its start; `None` if it is taken to be where it was sent.
    pub slave_pulses: Option<i64>,
    /// Whether force is requested at all.
    pub is_on: bool,
}

/// Output of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MasterSlaveOutput {
    /// Pulses for the slave in this tick.
    pub pulses: i64,
    /// Bias voltage of the master's motor, positive against motion into the tissue.
    pub bias: Volts,
    /// The force it stands for.
    pub force: Newtons,
    pub flags: Flags,
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
    watch: MarginSettings,
    count_mm: f64,
    mm_per_pulse: f64,
    surface_mm: f64,
    force_max: f64,
    origin: Option<i64>,
    direction: i64,
    still: u64,
    thermal: ThermalState,
    snapshot: MasterSlaveSnapshot,
}

/// Ticks of a stall that the model is led through one by one; after longer ones its memory is as old as it was.
const CAUGHT_UP: u64 = 64;

/// A count in 0.1 s is 0.15 mm/s with the source's encoder, a fifth of its slowest check.
const HEADING_S: f64 = 0.1;

/// Input of the passivity controller.
struct ControllerInput {
    is_touching: bool,
    is_on: bool,
    has_buzz: bool,
    /// Counts since the tick before.
    moved: i64,
    /// Ticks since then.
    elapsed: u64,
}

impl MasterSlave {
    /// At the start: the first counts are where master and slave are.
    pub fn new(settings: &MasterSlaveSettings) -> Result<Self, MasterSlaveError> {
        let period = settings.law.period;
        settings.checked()?;
        let pinion = &settings.torque.pinion;
        let mm_per_pulse = settings.slave.mm_per_pulse;
        let ratio = GearRatio::one_to_one(pinion, &settings.encoder, mm_per_pulse)?;
        let count_mm = settings.count_mm();
        let buzz_settings = settings.buzz.unwrap_or(BuzzSettings::of(count_mm));
        let depth = Depth(0.0 - settings.surface_mm);
        let watch = settings.watch();
        let delay_ticks = settings.delay_ticks.round() as usize;
        let controller = settings.controller.map(|one| ControllerSettings { delay_ticks, ..one });
        let force_max = settings.guard.force_max.0;
        let thermal = settings.torque.motor.thermal.cold();
        Ok(Self {
            law: ForceLaw::new(settings.law, depth)?,
            guard: ForceGuard::new(&settings.guard, period),
            controller: controller.map(|one| PassivityController::new(&one, period)),
            observer: PassivityObserver::with_delay(delay_ticks),
            buzz: BuzzDetector::new(&buzz_settings, period, 0.0),
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
            snapshot: MasterSlaveSnapshot::at_start(&watch, depth, thermal.winding_c),
        })
    }

    /// Everything after the last tick.
    pub fn snapshot(&self) -> MasterSlaveSnapshot {
        MasterSlaveSnapshot { checksum: self.snapshot.sum(), ..self.snapshot }
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
        MmPerS(if is_moving { self.direction as f64 } else { 0.0 })
    }

    /// Leads the model straight from depth to depth through what was missed.
    fn lead(&mut self, from: Depth, to: Depth, elapsed: u64) -> (LawTick, Flags) {
        let steps = elapsed.min(CAUGHT_UP);
        let span = to.0 - from.0;
        let mut law = self.law.tick(Depth(from.0 + span / steps as f64));
        let mut flags = law.flags;
        for step in 2..=steps {
            let share = step as f64 / steps as f64;
            law = self.law.tick(Depth(from.0 + span * share));
            flags |= law.flags;
        }
        (law, flags)
    }

    /// The model's force, bounded where the winding is too hot: it gets no more than it may have for ever, until it
    /// has cooled.
    fn bounded_force(&self, model: Newtons, is_on: bool, is_hot: bool) -> Newtons {
        let lasting = if is_hot {
            self.torque.motor.continuous / self.torque.pinion.radius_mm()
        } else {
            f64::MAX
        };
        let requested = if is_on { model.0 } else { 0.0 };
        Newtons(requested.clamp(-lasting, lasting))
    }

    /// The guarded force with the damping of the passivity controller.
    fn damp(&mut self, guarded: Newtons, touch: &ControllerInput) -> ControllerTick {
        let mut damped =
            ControllerTick { force: guarded, damping: 0.0, energy: 0.0, flags: Flags::NONE };
        let Some(controller) = &mut self.controller else {
            return damped;
        };
        // While what made it buzz lasts, so does the caution.
        let is_close = touch.is_touching && !self.snapshot.margin.is_enough();
        if touch.has_buzz || (controller.is_credit_withheld() && is_close) {
            controller.report_buzz();
        }
        let moved = (touch.moved, self.count_mm);
        let one = controller.tick(moved, touch.elapsed, guarded, touch.is_touching);
        if touch.is_on {
            damped = ControllerTick {
                force: Newtons(one.force.0.clamp(-self.force_max, self.force_max)),
                ..one
            };
        }
        controller.set_rendered_force(damped.force);
        damped
    }

    /// Takes one input and gives one output.
    #[must_use]
    pub fn tick(&mut self, input: &MasterSlaveInput) -> MasterSlaveOutput {
        let elapsed = input.elapsed.max(1);
        let before = self.snapshot;
        let span = self.watch.period.seconds().0 * elapsed as f64;
        // The master, and the slave after it.
        let origin = *self.origin.get_or_insert(input.counts);
        let (moved, mut flags) = self.counter.tick(input.counts, elapsed);
        let gear = self.gear.tick(input.counts);
        let slave = input.slave_pulses.unwrap_or(gear.made) as f64 * self.mm_per_pulse;
        let target = Depth(slave - self.surface_mm);
        flags |= gear.flags | self.contact.tick(input.cell);
        let is_touching = self.contact.is_touching();
        let (law, law_flags) = self.lead(before.depth, target, elapsed);
        flags |= law_flags;
        let is_hot = self.thermal.winding_c > self.torque.motor.thermal.winding_max_c;
        let requested = self.bounded_force(law.force, input.is_on, is_hot);
        flags |= Flags::OFF.when(!input.is_on) | Flags::HOT.when(is_hot);
        if input.is_on && before.flags.has(Flags::OFF) {
            self.guard.restart();
        }
        let guarded = self.guard.tick(requested, is_touching, elapsed);
        flags |= guarded.flags;
        // What the loop makes of it.
        let master_mm = input.counts.saturating_sub(origin) as f64 * self.count_mm;
        self.observer.record_move(moved as f64 * self.count_mm);
        let energy = self.observer.energy();
        let buzz = self.buzz.tick(master_mm, elapsed, energy);
        flags |= Flags::BUZZ.when(buzz.is_some());
        let touch = ControllerInput {
            is_touching,
            is_on: input.is_on,
            has_buzz: buzz.is_some(),
            moved,
            elapsed,
        };
        let damped = self.damp(guarded.force, &touch);
        let force = damped.force.0;
        flags |= damped.flags;
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
        self.snapshot = MasterSlaveSnapshot {
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
            damping: damped.damping,
            energy,
            torque: torque.torque,
            bias: torque.bias,
            winding_c: self.thermal.winding_c,
            buzz,
            margin,
            flags,
            checksum: 0,
        };
        MasterSlaveOutput { pulses: gear.pulses, bias: torque.bias, force: Newtons(force), flags }
    }
}
