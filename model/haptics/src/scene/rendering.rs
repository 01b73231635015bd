//! From a contact to the force on the hand, the same for every kind of surface: laws, guards, damping and bounds along the normal.

use super::device::{DeviceSettings, length};
use super::{LED_MAX, NoForceReason, Pose, SceneError, SceneSettings, SceneTick};
use crate::surface::{ProxyTouch, dot};
use crate::triangles::{BlendedLaw, MOST_MATERIALS};
use crate::{
    BuzzDetector, BuzzSettings, Flags, ForceGuard, LawSettings, PassivityController,
    PassivityObserver,
};
use palpate_model::units::{Depth, Newtons};
use palpate_model::viscoelastic::ModifiedKelvin;

/// Laws of force with their state and what bounds them.
#[derive(Clone, Debug)]
pub(super) struct ForceRendering {
    law: BlendedLaw,
    guard: ForceGuard,
    controller: Option<PassivityController>,
    observer: PassivityObserver,
    buzz: BuzzDetector,
    /// Depth of the stylus below the surface at rest in mm; negative above it.
    below: f64,
    device: DeviceSettings,
    tick_s: f64,
}

/// What the hand gets of a contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct RenderedForce {
    speed: f64,
    force: [f64; 3],
    is_saturated: bool,
    no_force_reason: NoForceReason,
    injected_damping: f64,
    energy: f64,
    is_buzzing: bool,
    flags: Flags,
}

impl ForceRendering {
    /// One law for each body, all relaxed at `below` mm.
    pub(super) fn new(
        settings: &SceneSettings,
        bodies: &[ModifiedKelvin],
        below: f64,
    ) -> Result<Self, SceneError> {
        let period = settings.period;
        let law = |body: &ModifiedKelvin| LawSettings {
            scheme: settings.scheme,
            ..LawSettings::of(*body, period)
        };
        let laws: Vec<_> = bodies.iter().map(law).collect();
        let buzz = BuzzSettings::of(settings.device.step_mm);
        Ok(Self {
            law: BlendedLaw::new(&laws, Depth(below))?,
            guard: ForceGuard::new(&settings.guard, period),
            controller: settings.controller.map(|one| PassivityController::new(&one, period)),
            observer: PassivityObserver::default(),
            buzz: BuzzDetector::new(&buzz, period, below),
            below,
            device: settings.device,
            tick_s: period.seconds().0,
        })
    }

    /// Depth at the last tick in mm; negative above the surface.
    pub(super) fn below(&self) -> f64 {
        self.below
    }

    /// One tick at a depth of `below` mm, `elapsed` ticks after the last. The law is led through what was missed.
    pub(super) fn tick(
        &mut self,
        touch: &ProxyTouch,
        below: f64,
        shares: &[f64; MOST_MATERIALS],
        elapsed: u64,
    ) -> RenderedForce {
        let is_contact = touch.is_contact();
        let before = std::mem::replace(&mut self.below, below);
        let (target, mut flags) = self.advance_law(before, shares, elapsed);
        let guarded = self.guard.tick(target, is_contact, elapsed);
        flags |= guarded.flags;
        // What the loop makes of it, along the normal.
        let counts = ((below - before) / self.device.step_mm).round() as i64;
        self.observer.record_move(below - before);
        let energy = self.observer.energy();
        let buzz = self.buzz.tick(below, elapsed, energy);
        flags |= Flags::BUZZ.when(buzz.is_some());
        let mut along = guarded.force;
        let mut injected_damping = 0.0;
        if let Some(controller) = &mut self.controller {
            if buzz.is_some() {
                controller.report_buzz();
            }
            let step = self.device.step_mm;
            let one = controller.tick((counts, step), elapsed, along, is_contact);
            along = one.force;
            injected_damping = one.damping;
            flags |= one.flags;
        }
        let (force, is_saturated) = self.device.limit_force(force_on_hand(touch, along));
        let rendered = Newtons(dot(force, touch.normal));
        if let Some(controller) = &mut self.controller {
            controller.set_rendered_force(rendered);
        }
        self.observer.hold(rendered.0);
        let is_saturated = is_saturated || flags.has(Flags::FORCE_MAX);
        RenderedForce {
            speed: (below - before) / (self.tick_s * elapsed as f64),
            force,
            is_saturated,
            no_force_reason: NoForceReason::of(
                touch.state,
                flags,
                is_saturated,
                length(force),
                &self.device,
            ),
            injected_damping,
            energy,
            is_buzzing: buzz.is_some(),
            flags,
        }
    }

    /// The law's force, after it was led straight through what was missed.
    fn advance_law(
        &mut self,
        before: f64,
        shares: &[f64; MOST_MATERIALS],
        elapsed: u64,
    ) -> (Newtons, Flags) {
        let steps = elapsed.min(LED_MAX);
        let way = (self.below - before) / steps as f64;
        let mut flags = Flags::NONE;
        let mut force = Newtons(0.0);
        for step in 1..=steps {
            let depth = if step == steps { self.below } else { before + way * step as f64 };
            let one = self.law.tick(Depth(depth), shares);
            flags |= one.flags;
            force = one.force;
        }
        (force, flags)
    }
}

impl RenderedForce {
    /// The tick of a scene but for its number and its surface.
    pub(super) fn scene_tick(&self, pose: Pose, touch: &ProxyTouch) -> SceneTick {
        SceneTick {
            device: pose.at,
            turn: pose.turn,
            proxy: touch.point,
            normal: touch.normal,
            depth: touch.depth,
            speed: self.speed,
            force: self.force,
            is_saturated: self.is_saturated,
            no_force_reason: self.no_force_reason,
            injected_damping: self.injected_damping,
            energy: self.energy,
            is_buzzing: self.is_buzzing,
            flags: self.flags,
            ..SceneTick::default()
        }
    }
}

/// The force on the hand where `along` is what there is along the normal: friction goes with what the model gives, and damping
/// has none.
fn force_on_hand(touch: &ProxyTouch, along: Newtons) -> [f64; 3] {
    let push = along.0.max(0.0);
    let with_friction = touch.force(push);
    let pull = along.0 - if touch.is_contact() { push } else { 0.0 };
    [0, 1, 2].map(|axis| with_friction[axis] + pull * touch.normal[axis])
}
