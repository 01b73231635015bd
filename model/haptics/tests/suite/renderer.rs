//! A loop of a spring or a law on a simulated device, with or without guard and controller.

use palpate_haptics::closed_loop::{HapticPlant, PlantCommand, PlantSettings, SensedPosition};
use palpate_haptics::{
    BuzzDetector, BuzzSettings, ControllerSettings, Flags, ForceGuard, ForceLaw, GuardSettings,
    PassivityController, PassivityObserver, Period,
};
use palpate_model::{Depth, Newtons, Seconds};

/// A spring, or a body.
#[derive(Clone, Copy, Debug)]
#[expect(clippy::large_enum_variant, reason = "one of them, on the stack of a simulation")]
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
    period: Period,
    last: Option<SensedPosition>,
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
    pub fn new(
        rendered: Rendered,
        plant: &PlantSettings,
        guard: Option<&GuardSettings>,
        controller: Option<&ControllerSettings>,
    ) -> Self {
        let period = plant.period;
        let count_mm = if plant.count_mm > 0.0 { plant.count_mm } else { STEPLESS_MM };
        let buzz_settings = BuzzSettings::of(plant.count_mm.max(0.001));
        Self {
            rendered,
            guard: guard.map(|one| ForceGuard::new(one, period)),
            controller: controller.map(|one| PassivityController::new(one, period)),
            observer: PassivityObserver::with_delay(plant.delay),
            buzz: BuzzDetector::new(&buzz_settings, period, plant.x),
            count_mm,
            period,
            last: None,
        }
    }

    /// One tick, `elapsed` ticks after the last.
    pub fn tick(&mut self, sensed: SensedPosition, elapsed: u64) -> RendererTick {
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
        self.observer.record_move(moved);
        let buzz = self.buzz.tick(x, elapsed, self.observer.energy());
        flags |= Flags::BUZZ.when(buzz.is_some());
        if let Some(controller) = &mut self.controller {
            if buzz.is_some() {
                controller.report_buzz();
            }
            let counts = (moved / self.count_mm).round() as i64;
            let one = controller.tick((counts, self.count_mm), elapsed, force, is_touching);
            force = one.force;
            flags |= one.flags;
        }
        self.observer.hold(force.0);
        RendererTick { force, energy: self.observer.energy(), flags }
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

/// Runs a loop from its start for so many ticks and shows each to `seen`, which ends it by returning false.
pub fn run(
    plant: &mut HapticPlant,
    renderer: &mut Renderer,
    ticks: u64,
    mut seen: impl FnMut(&RunTick) -> bool,
) {
    for tick in 1..=ticks {
        let rendered = renderer.tick(plant.sense(), 1);
        plant.tick(PlantCommand::Force(rendered.force));
        let one = RunTick {
            t: renderer.period.time_of(tick).seconds(),
            x: plant.rack.x,
            v: plant.rack.v,
            absorbed: -plant.rack.energies.motor,
            rendered,
        };
        if !seen(&one) {
            return;
        }
    }
}
