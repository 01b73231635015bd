//! What a scene is made of.

use super::device::DeviceSettings;
use crate::surface::{Cut, Grid, HeightField, MeshError, SurfaceMethod};
use crate::triangles::{BlendError, MaterialError};
use crate::{ControllerSettings, GuardSettings, LawError, Period, SettingError};
use palpate_model::units::Newtons;
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::integrators::Scheme;
use thiserror::Error;

/// Height above the surface at rest at which a scene begins, over the middle of the mesh, in mm.
pub const START_HEIGHT_MM: f64 = 10.0;

/// A piece of tissue, a device over it, and the loop between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneSettings {
    /// The tissue's force over depth.
    pub body: ModifiedKelvin,
    /// Length of a side in mm.
    pub side_mm: f64,
    /// Nodes along a side.
    pub nodes: usize,
    /// MaxShear: how far neighbouring nodes may be apart in height, in mm.
    pub max_shear_mm: f64,
    /// Time constant in s with which the surface returns; zero: at once, infinite: never.
    pub recovery_s: f64,
    /// Friction coefficient between stylus and tissue.
    pub friction: f64,
    pub device: DeviceSettings,
    /// From tick to tick.
    pub period: Period,
    pub scheme: Scheme,
    pub method: SurfaceMethod,
    /// Bounds of a contact's influence on the surface.
    pub cut: Cut,
    /// Bounds of the force along the normal; those of the device come after.
    pub guard: GuardSettings,
    /// Damping that takes back what the loop makes; `None` for none.
    pub controller: Option<ControllerSettings>,
}

impl Default for SceneSettings {
    /// The body of the source thesis as 60 mm of flat tissue on 201 by 201 nodes, which gives way along a slope of 45 degrees, returns with
    /// the body's own time constant and is felt through an Omni-class device a thousand times a second.
    fn default() -> Self {
        let body = ModifiedKelvin::THESIS;
        let device = DeviceSettings::default();
        Self {
            body,
            side_mm: 60.0,
            nodes: 201,
            max_shear_mm: 0.3,
            recovery_s: body.tau_eps,
            friction: 0.2,
            device,
            period: Period::MILLISECOND,
            scheme: Scheme::Exact,
            method: SurfaceMethod::Envelope,
            cut: Cut::NONE,
            guard: GuardSettings {
                force_max: Newtons(device.force_max_n),
                ..GuardSettings::default()
            },
            controller: Some(ControllerSettings {
                force_max: Newtons(device.force_max_n),
                ..ControllerSettings::of(device.mass_kg)
            }),
        }
    }
}

impl SceneSettings {
    /// The middle of the surface at rest in mm.
    pub fn middle(&self) -> [f64; 3] {
        [0.5 * self.side_mm, 0.5 * self.side_mm, 0.0]
    }

    /// Position of the stylus at the start, in mm.
    pub fn start(&self) -> [f64; 3] {
        let [x, y, _] = self.middle();
        [x, y, START_HEIGHT_MM]
    }

    /// Another device, and bounds of force that go with it.
    #[must_use]
    pub fn with_device(mut self, device: DeviceSettings) -> Self {
        self.device = device;
        self.guard.force_max = Newtons(device.force_max_n);
        if let Some(controller) = &mut self.controller {
            controller.force_max = Newtons(device.force_max_n);
            controller.mass_kg = device.mass_kg;
        }
        self
    }

    /// The same without guards and controller, to show what they are for. The device still gives no more than it has.
    #[must_use]
    pub fn unguarded(mut self) -> Self {
        self.guard = GuardSettings::OPEN;
        self.controller = None;
        self
    }

    pub(super) fn field(&self) -> Result<HeightField, SceneError> {
        // A spacing that is none is refused with the grid.
        let spacing = self.side_mm / self.nodes.saturating_sub(1) as f64;
        let grid = Grid::new(self.nodes, self.nodes, spacing)?;
        Ok(HeightField::flat(grid, self.max_shear_mm)?)
    }
}

/// A scene that cannot be.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SceneError {
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error(transparent)]
    Law(#[from] LawError),
    /// The number of its force models.
    #[error(transparent)]
    Materials(#[from] MaterialError),
    /// A number of its device, its friction or its recovery.
    #[error(transparent)]
    Setting(#[from] SettingError),
}

impl From<BlendError> for SceneError {
    fn from(error: BlendError) -> Self {
        match error {
            BlendError::Law(law) => Self::Law(law),
            BlendError::Materials(materials) => Self::Materials(materials),
        }
    }
}
