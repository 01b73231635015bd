//! One tick of touch on a mesh: contact point, force, dent.

use super::blend::{BlendError, BlendedLaw};
use super::dent::{Dent, DentSettings, DentTick};
use super::materials::{FIRST_ALONE, MOST_MATERIALS, MaterialMap};
use super::mesh::TriangleMesh;
use super::proxy::{FAR_MM, MeshProxy, MeshTouch, Shading};
use crate::{Flags, LawSettings, SettingError};
use palpate_model::units::{Depth, Newtons};
use std::sync::Arc;

/// How a mesh is touched.
#[derive(Clone, Debug)]
pub struct MeshTouchSettings {
    /// A force law for each material.
    pub laws: Vec<LawSettings>,
    /// Friction coefficient between stylus and tissue.
    pub friction: f64,
    pub shading: Shading,
    pub dent: DentSettings,
}

/// A touch that cannot be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshTouchError {
    #[error(transparent)]
    Setting(#[from] SettingError),
    #[error(transparent)]
    Blend(#[from] BlendError),
}

/// Mesh, contact point, materials and dent. The contact is with the surface at rest, so that the force does not see its own
/// deformation.
#[derive(Clone, Debug)]
pub struct TouchedMesh {
    mesh: Arc<TriangleMesh>,
    materials: MaterialMap,
    proxy: MeshProxy,
    dent: Dent,
}

impl TouchedMesh {
    /// At rest and without contact.
    pub fn new(
        mesh: Arc<TriangleMesh>,
        materials: MaterialMap,
        (friction, shading): (f64, Shading),
        dent: DentSettings,
    ) -> Result<Self, SettingError> {
        let proxy = MeshProxy::new(friction, shading)?;
        Ok(Self { proxy, dent: Dent::new(&mesh, dent)?, mesh, materials })
    }

    pub fn mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    pub fn dent(&self) -> &Dent {
        &self.dent
    }

    /// The contact of a device at `device` (mm), and the shares of the materials there if it touches.
    pub fn follow(&mut self, device: [f64; 3]) -> (MeshTouch, Option<[f64; MOST_MATERIALS]>) {
        let contact = self.proxy.follow(&self.mesh, device);
        let on = contact.on.filter(|_| contact.touch.is_contact());
        (contact, on.map(|on| self.materials.at(&self.mesh, &on)))
    }

    /// The surface recovers for a tick and sinks under a contact.
    pub fn sink(&mut self, contact: &MeshTouch) -> DentTick {
        let on = contact.on.as_ref().filter(|_| contact.touch.is_contact());
        self.dent.tick(&self.mesh, on.map(|on| (on, contact.touch.depth)))
    }
}

/// A [`TouchedMesh`] with its force laws, without a device and its guards: for measurements and other loops. A scene with both is
/// [`MeshScene`](crate::scene::MeshScene).
#[derive(Clone, Debug)]
pub struct MeshTouchLoop {
    touched: TouchedMesh,
    law: BlendedLaw,
    shares: [f64; MOST_MATERIALS],
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshTick {
    pub contact: MeshTouch,
    /// Force along the normal as the laws have it.
    pub along: Newtons,
    /// Force on the device in N, friction included.
    pub force: [f64; 3],
    /// Shares of the materials at the contact; the last ones in the air.
    pub shares: [f64; MOST_MATERIALS],
    pub dent: DentTick,
    pub flags: Flags,
}

impl MeshTouchLoop {
    /// At rest and without contact. Everything that ticks need is allocated here.
    pub fn new(
        mesh: Arc<TriangleMesh>,
        materials: MaterialMap,
        settings: &MeshTouchSettings,
    ) -> Result<Self, MeshTouchError> {
        if materials.materials() > settings.laws.len() {
            let count = super::materials::MaterialError::Count(settings.laws.len());
            return Err(BlendError::Materials(count).into());
        }
        let surface = (settings.friction, settings.shading);
        Ok(Self {
            touched: TouchedMesh::new(mesh, materials, surface, settings.dent)?,
            law: BlendedLaw::new(&settings.laws, Depth(-FAR_MM))?,
            shares: FIRST_ALONE,
        })
    }

    pub fn touched(&self) -> &TouchedMesh {
        &self.touched
    }

    /// One tick: the device is at `device` (mm).
    pub fn tick(&mut self, device: [f64; 3]) -> MeshTick {
        let (contact, shares) = self.touched.follow(device);
        self.shares = shares.unwrap_or(self.shares);
        let blend = self.law.tick(Depth(contact.below), &self.shares);
        MeshTick {
            contact,
            along: blend.force,
            force: contact.touch.force(blend.force.0),
            shares: self.shares,
            dent: self.touched.sink(&contact),
            flags: blend.flags,
        }
    }
}
