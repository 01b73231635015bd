//! Everything that a picture shows.

use crate::camera::{Camera, Eye};
use crate::level::DetailLevel;
use crate::look::SurfaceStyle;
use crate::probe::Probe;
use crate::surface::SurfaceData;
use std::sync::Arc;

/// One picture, or a pair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EyeLayout {
    #[default]
    Single,
    /// The left eye's picture on the left, the right eye's on the right, each half as wide.
    SideBySide,
}

impl EyeLayout {
    pub(crate) fn eyes(self) -> &'static [Eye] {
        match self {
            Self::Single => &[Eye::Single],
            Self::SideBySide => &[Eye::Left, Eye::Right],
        }
    }
}

/// A surface and a probe, as a camera sees them.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Only rows of it that differ from those of the last picture go to the graphics processor.
    pub surface: Arc<SurfaceData>,
    pub probe: Option<Probe>,
    pub camera: Camera,
    pub eyes: EyeLayout,
    pub look: SurfaceStyle,
    pub level: DetailLevel,
}
