//! A piece of tissue that is seen and felt: the [surface](crate::surface) that follows a stylus, the
//! [force law](crate::ForceLaw) that answers it, and the device between them and a hand.
//!
//! One [`HandLedScene::tick`] is: the device moves under the force held; then [`Scene::feel`]: the contact point follows it on the
//! surface at rest, so that the force does not see its own deformation; the law makes a force of depth; guards bound it along the
//! normal; the surface follows the stylus. It allocates nothing, takes no lock, reads no clock and gives the same bits for the same
//! hands.

mod device;
mod hand_led;
mod mesh;
mod no_force_reason;
mod path;
mod rendering;
mod settings;
mod start;

pub use device::{DeviceSettings, HandPose, Pose, SimulatedDevice};
pub use hand_led::HandLedScene;
pub use mesh::{HandLedMeshScene, MeshScene, MeshSceneError, MeshSceneSettings};
pub use no_force_reason::NoForceReason;
pub use path::ScenePath;
pub use settings::{START_HEIGHT_MM, SceneError, SceneSettings};
pub use start::{SceneStart, StartPlace, stylus_axis};

use crate::Flags;
use crate::surface::{
    ContactSide, GridRect, HeightField, Proxy, ProxyTouch, Surface, SurfaceContact,
    SurfaceRecovery, TouchState,
};
use crate::triangles::FIRST_ALONE;
use palpate_model::units::Seconds;
use rendering::ForceRendering;

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
    rendering: ForceRendering,
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
        let below = -settings.start()[2];
        let rendering = ForceRendering::new(&settings, &[settings.body], below)?;
        Ok(Self {
            surface,
            proxy: Proxy::new(settings.friction)?,
            rendering,
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
        let before = self.rendering.below();
        let below = match touch.state {
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
        let rendered = self.rendering.tick(&touch, below, &FIRST_ALONE, elapsed);
        self.press(&touch);
        self.last = SceneTick {
            tick,
            moved: self.moved,
            row_hash: self.row_hash(tick),
            ..rendered.scene_tick(pose, &touch)
        };
        self.last
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
