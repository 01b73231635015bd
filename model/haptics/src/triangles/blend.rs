//! A force law for each material, and the force of their blend.

use super::materials::{MOST_MATERIALS, MaterialError};
use crate::{Flags, ForceLaw, LawError, LawSettings};
use palpate_model::units::{Depth, Newtons};

/// Force laws of all materials, each stepped in every tick, so that the memory of one goes on while another is touched.
#[derive(Clone, Debug)]
pub struct BlendedLaw {
    laws: Box<[ForceLaw]>,
}

/// One answer of a blend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlendTick {
    /// Sum of the laws' forces by their shares.
    pub force: Newtons,
    /// Facts about the laws that have a share.
    pub flags: Flags,
}

/// Laws that cannot be blended.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BlendError {
    #[error(transparent)]
    Law(#[from] LawError),
    #[error(transparent)]
    Materials(#[from] MaterialError),
}

impl BlendedLaw {
    /// Bodies relaxed at `depth`, one for each material.
    pub fn new(settings: &[LawSettings], depth: Depth) -> Result<Self, BlendError> {
        if !(1..=MOST_MATERIALS).contains(&settings.len()) {
            return Err(MaterialError::Count(settings.len()).into());
        }
        let laws: Result<Vec<_>, _> =
            settings.iter().map(|one| ForceLaw::new(*one, depth)).collect();
        Ok(Self { laws: laws?.into() })
    }

    /// Number of materials.
    pub fn materials(&self) -> usize {
        self.laws.len()
    }

    /// Moves to `depth` within the tick; `shares` are those of the materials at the contact.
    #[must_use]
    pub fn tick(&mut self, depth: Depth, shares: &[f64; MOST_MATERIALS]) -> BlendTick {
        let mut blend = BlendTick { force: Newtons(0.0), flags: Flags::NONE };
        for (law, &share) in self.laws.iter_mut().zip(shares) {
            let one = law.tick(depth);
            if share > 0.0 {
                blend.force.0 += share * one.force.0;
                blend.flags |= one.flags;
            }
        }
        blend
    }
}
