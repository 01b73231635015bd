//! The indenter as chosen in a list, and the sizes that it needs.

use palpate_indentation::{Indenter, PyramidFaces, Quantity};
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Shape {
    #[default]
    FlatPunch,
    Sphere,
    Cone,
    PyramidThree,
    PyramidFour,
    ChamferedPunch,
    RoundedCone,
    RoundedPyramidThree,
    RoundedPyramidFour,
}

pub(super) const SHAPES: [(Shape, &str); 9] = [
    (Shape::FlatPunch, "flat punch"),
    (Shape::Sphere, "sphere"),
    (Shape::Cone, "cone"),
    (Shape::PyramidThree, "pyramid of three faces"),
    (Shape::PyramidFour, "pyramid of four faces"),
    (Shape::ChamferedPunch, "flat punch with a chamfer"),
    (Shape::RoundedCone, "cone with a round tip"),
    (Shape::RoundedPyramidThree, "three faces, round tip"),
    (Shape::RoundedPyramidFour, "four faces, round tip"),
];

impl Shape {
    pub const fn has_radius(self) -> bool {
        matches!(self, Self::FlatPunch | Self::Sphere | Self::ChamferedPunch)
    }

    /// Name and meaning of its second length in mm, where it has one.
    pub const fn edge(self) -> Option<(&'static str, &'static str)> {
        match self {
            Self::ChamferedPunch => {
                Some(("chamfer", "its width at 45°, with its standard uncertainty"))
            }
            Self::RoundedCone | Self::RoundedPyramidThree | Self::RoundedPyramidFour => {
                Some(("tip radius", "with its standard uncertainty"))
            }
            _ => None,
        }
    }

    /// `size` is a radius in mm, or a half angle in degrees; `edge` a chamfer or the radius of a tip in mm.
    pub const fn indenter(self, size: Quantity, edge: Quantity) -> Indenter {
        match self {
            Self::ChamferedPunch => Indenter::ChamferedPunch { radius_mm: size, chamfer_mm: edge },
            Self::RoundedCone => {
                Indenter::RoundedCone { half_angle_degrees: size, tip_radius_mm: edge }
            }
            Self::RoundedPyramidThree => Indenter::RoundedPyramid {
                faces: PyramidFaces::Three,
                half_angle_degrees: size,
                tip_radius_mm: edge,
            },
            Self::RoundedPyramidFour => Indenter::RoundedPyramid {
                faces: PyramidFaces::Four,
                half_angle_degrees: size,
                tip_radius_mm: edge,
            },
            Self::FlatPunch => Indenter::FlatPunch { radius_mm: size },
            Self::Sphere => Indenter::Sphere { radius_mm: size },
            Self::Cone => Indenter::Cone { half_angle_degrees: size },
            Self::PyramidThree => {
                Indenter::Pyramid { faces: PyramidFaces::Three, half_angle_degrees: size }
            }
            Self::PyramidFour => {
                Indenter::Pyramid { faces: PyramidFaces::Four, half_angle_degrees: size }
            }
        }
    }
}
