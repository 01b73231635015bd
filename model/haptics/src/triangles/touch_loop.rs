//! One tick of touch on a mesh: contact point, force, dent.

use super::blend::{BlendError, BlendedLaw};
use super::dent::{Dent, DentSettings, DentTick};
use super::materials::{MOST_MATERIALS, MaterialMap};
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

/// Mesh, contact point, force laws and dent. The contact is with the surface at rest, so that the force does not see its own
/// deformation.
#[derive(Clone, Debug)]
pub struct MeshTouchLoop {
    mesh: Arc<TriangleMesh>,
    materials: MaterialMap,
    proxy: MeshProxy,
    law: BlendedLaw,
    dent: Dent,
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
        Ok(Self {
            proxy: MeshProxy::new(settings.friction, settings.shading)?,
            law: BlendedLaw::new(&settings.laws, Depth(-FAR_MM))?,
            dent: Dent::new(&mesh, settings.dent)?,
            shares: [0.0; MOST_MATERIALS],
            mesh,
            materials,
        })
    }

    pub fn mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    pub fn dent(&self) -> &Dent {
        &self.dent
    }

    /// One tick: the device is at `device` (mm).
    pub fn tick(&mut self, device: [f64; 3]) -> MeshTick {
        let contact = self.proxy.follow(&self.mesh, device);
        let is_contact = contact.touch.is_contact();
        let on = contact.on.as_ref().filter(|_| is_contact);
        if let Some(on) = on {
            self.shares = self.materials.at(&self.mesh, on);
        }
        let blend = self.law.tick(Depth(contact.below), &self.shares);
        let dent = self.dent.tick(&self.mesh, on.map(|on| (on, contact.touch.depth)));
        MeshTick {
            contact,
            along: blend.force,
            force: contact.touch.force(blend.force.0),
            shares: self.shares,
            dent,
            flags: blend.flags,
        }
    }
}
