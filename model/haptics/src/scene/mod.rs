//! A piece of tissue that is seen and felt: the [surface](crate::surface) that follows a stylus, the
//! [force law](crate::ForceLaw) that answers it, and the device between them and a hand.
//!
//! One [`HandLedScene::tick`] is: the device moves under the force held; then [`Scene::feel`]: the contact point follows it on the
//! surface at rest, so that the force does not see its own deformation; the law makes a force of depth; guards bound it along the
//! normal; the surface follows the stylus. It allocates nothing, takes no lock, reads no clock and gives the same bits for the same
//! hands.

mod device;
mod hand_led;
mod no_force_reason;
mod path;
mod settings;

pub use device::{DeviceSettings, HandPose, Pose, SimulatedDevice};
pub use hand_led::HandLedScene;
pub use no_force_reason::NoForceReason;
pub use path::ScenePath;
pub use settings::{START_HEIGHT_MM, SceneError, SceneSettings};

use crate::surface::{
    ContactSide, GridRect, HeightField, Proxy, ProxyTouch, Surface, SurfaceContact,
    SurfaceRecovery, TouchState, dot,
};
use crate::{
    BuzzDetector, BuzzSettings, Flags, ForceGuard, ForceLaw, LawSettings, PassivityController,
    PassivityObserver,
};
use device::length;
use palpate_model::units::{Depth, Newtons, Seconds};

/// Ticks of a stall that device and law are led through; after longer ones they stand where they were.
const LED_MAX: u64 = 1000;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SceneTick {
    /// Ticks since the start.
    pub tick: u64,
    /// Sensed position of the stylus in mm.
    pub device: [f64; 3],
    /// Its sensed yaw, pitch and roll in rad.
    pub turn: [f64; 3],
    /// The contact point on the surface at rest in mm; where the stylus is without contact.
    pub proxy: [f64; 3],
    /// Unit normal of the surface there.
    pub normal: [f64; 3],
    /// Depth of the stylus below the contact point along the normal in mm; zero without contact.
    pub depth: f64,
    /// Speed of the stylus into the tissue along the normal, in mm/s.
    pub speed: f64,
    /// Force on the hand in N.
    pub force: [f64; 3],
    /// Whether the device gives less than requested.
    pub is_saturated: bool,
    pub no_force_reason: NoForceReason,
    /// Damping added by the passivity controller in N s/mm.
    pub injected_damping: f64,
    /// Energy that the force along the normal has absorbed in N mm; below zero it has returned more.
    pub energy: f64,
    /// Whether the loop swings by itself.
    pub is_buzzing: bool,
    /// Nodes that the contact moved.
    pub moved: usize,
    /// Hash of one row of the surface, of the next row in every tick: a look at all of it in as many ticks as it has rows.
    pub row_hash: u64,
    pub flags: Flags,
}

impl SceneTick {
    /// Whether the stylus touches.
    pub fn is_contact(&self) -> bool {
        self.depth > 0.0
    }
}

/// A scene with its state.
#[derive(Clone, Debug)]
pub struct Scene {
    settings: SceneSettings,
    surface: Surface,
    proxy: Proxy,
    law: ForceLaw,
    guard: ForceGuard,
    controller: Option<PassivityController>,
    observer: PassivityObserver,
    buzz: BuzzDetector,
    /// Depth of the stylus below the surface at rest in mm; negative above it.
    below: f64,
    last: SceneTick,
    dirty: GridRect,
    moved: usize,
}

impl Scene {
    /// At rest, the stylus over the middle. Everything that ticks need is allocated here.
    pub fn new(settings: SceneSettings) -> Result<Self, SceneError> {
        let period = settings.period;
        let pose = SimulatedDevice::of(&settings)?.pose();
        let recovery = SurfaceRecovery::new(Seconds(settings.recovery_s), period.seconds())?;
        let surface = Surface::new(settings.field()?, settings.method, recovery, settings.cut);
        let law = LawSettings { scheme: settings.scheme, ..LawSettings::of(settings.body, period) };
        let below = -settings.start()[2];
        let buzz_settings = BuzzSettings::of(settings.device.step_mm);
        Ok(Self {
            surface,
            proxy: Proxy::new(settings.friction)?,
            law: ForceLaw::new(law, Depth(below))?,
            guard: ForceGuard::new(&settings.guard, period),
            controller: settings.controller.map(|one| PassivityController::new(&one, period)),
            observer: PassivityObserver::default(),
            buzz: BuzzDetector::new(&buzz_settings, period, below),
            below,
            last: SceneTick {
                device: pose.at,
                turn: pose.turn,
                proxy: pose.at,
                normal: [0.0, 0.0, 1.0],
                ..SceneTick::default()
            },
            dirty: GridRect::EMPTY,
            moved: 0,
            settings,
        })
    }

    pub fn settings(&self) -> &SceneSettings {
        &self.settings
    }

    pub fn field(&self) -> &HeightField {
        self.surface.field()
    }

    /// Every node that may be elsewhere than at rest, now or before the last tick.
    pub fn dirty(&self) -> GridRect {
        self.dirty
    }

    pub fn last(&self) -> SceneTick {
        self.last
    }

    /// Ticks since the start.
    pub fn ticks(&self) -> u64 {
        self.last.tick
    }

    /// Hash of all heights' bits, in place of comparing them.
    pub fn hash(&self) -> u64 {
        hash(self.field().heights())
    }

    /// The tick of a device that was sensed at `pose`, which [`SceneTick::force`] is for, `elapsed` ticks after the last: one,
    /// unless the loop was away. The law is led through what was missed; the surface stood still meanwhile.
    pub fn render(&mut self, pose: Pose, elapsed: u64) -> SceneTick {
        let elapsed = elapsed.max(1);
        let tick = self.last.tick.saturating_add(elapsed);
        let touch = self.proxy.follow(self.surface.field().at_rest(), pose.at);
        let is_contact = touch.is_contact();
        let before = self.below;
        self.below = match touch.state {
            TouchState::Sticks | TouchState::Slides => touch.depth,
            TouchState::Free => {
                let [x, y, z] = pose.at;
                let rest = self.field().at_rest().at(x, y);
                rest.map_or(before, |(height, _)| height - z).min(0.0)
            }
            // Outside the mesh nothing is below the stylus.
            TouchState::Outside => before.min(0.0),
            TouchState::NotANumber => before,
        };
        let (target, mut flags) = self.advance_law(before, elapsed);
        let guarded = self.guard.tick(target, is_contact, elapsed);
        flags |= guarded.flags;
        // What the loop makes of it, along the normal.
        let counts = ((self.below - before) / self.settings.device.step_mm).round() as i64;
        self.observer.record_move(self.below - before);
        let energy = self.observer.energy();
        let buzz = self.buzz.tick(self.below, elapsed, energy);
        flags |= Flags::BUZZ.when(buzz.is_some());
        let mut along = guarded.force;
        let mut injected_damping = 0.0;
        if let Some(controller) = &mut self.controller {
            if buzz.is_some() {
                controller.report_buzz();
            }
            let step = self.settings.device.step_mm;
            let one = controller.tick((counts, step), elapsed, along, is_contact);
            along = one.force;
            injected_damping = one.damping;
            flags |= one.flags;
        }
        let requested = self.force_on_hand(&touch, along);
        let (force, is_saturated) = self.settings.device.limit_force(requested);
        let rendered = Newtons(dot(force, touch.normal));
        if let Some(controller) = &mut self.controller {
            controller.set_rendered_force(rendered);
        }
        self.observer.hold(rendered.0);
        self.press(&touch);
        let is_saturated = is_saturated || flags.has(Flags::FORCE_MAX);
        let device = &self.settings.device;
        let why = NoForceReason::of(touch.state, flags, is_saturated, length(force), device);
        let span = self.settings.period.seconds().0 * elapsed as f64;
        self.last = SceneTick {
            tick,
            device: pose.at,
            turn: pose.turn,
            proxy: touch.point,
            normal: touch.normal,
            depth: touch.depth,
            speed: (self.below - before) / span,
            force,
            is_saturated,
            no_force_reason: why,
            injected_damping,
            energy,
            is_buzzing: buzz.is_some(),
            moved: self.moved,
            row_hash: self.row_hash(tick),
            flags,
        };
        self.last
    }

    /// The law's force, after it was led straight through what was missed.
    fn advance_law(&mut self, before: f64, elapsed: u64) -> (Newtons, Flags) {
        let steps = elapsed.min(LED_MAX);
        let way = (self.below - before) / steps as f64;
        let mut flags = Flags::NONE;
        let mut force = Newtons(0.0);
        for step in 1..=steps {
            let depth = if step == steps { self.below } else { before + way * step as f64 };
            let one = self.law.tick(Depth(depth));
            flags |= one.flags;
            force = one.force;
        }
        (force, flags)
    }

    /// The force on the hand where `along` is what there is along the normal: friction goes with what the model gives, and damping
    /// has none.
    fn force_on_hand(&self, touch: &ProxyTouch, along: Newtons) -> [f64; 3] {
        let push = along.0.max(0.0);
        let with_friction = touch.force(push);
        let pull = along.0 - if touch.is_contact() { push } else { 0.0 };
        [0, 1, 2].map(|axis| with_friction[axis] + pull * touch.normal[axis])
    }

    /// The surface follows the stylus from the contact point down.
    fn press(&mut self, touch: &ProxyTouch) {
        let [x, y, z] = touch.point;
        let contact = SurfaceContact { x, y, z: z - touch.depth, side: ContactSide::Push };
        let contacts = [contact];
        let contacts = if touch.is_contact() { &contacts[..] } else { &[] };
        let report = self.surface.tick(contacts);
        self.dirty = report.dirty;
        self.moved = report.moved.moved;
    }

    fn row_hash(&self, tick: u64) -> u64 {
        let columns = self.settings.nodes;
        let row = (tick % self.settings.nodes as u64) as usize;
        hash(&self.field().heights()[row * columns..(row + 1) * columns])
    }
}

/// FNV-1a over the bits of whole numbers instead of bytes.
fn hash(heights: &[f64]) -> u64 {
    let mix =
        |hash: u64, z: &f64| (hash ^ z.to_bits()).wrapping_mul(0x0100_0000_01b3).rotate_left(23);
    heights.iter().fold(0xcbf2_9ce4_8422_2325, mix)
}
