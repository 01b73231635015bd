//! Indenters and specimens as they are written down: plain documents, checked when they are used.

use crate::invalid_value::{InvalidValue, check, check_poisson, positive};
use crate::layer::{Base, Layer};
use crate::shape::IndenterShape;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A value in the unit of its field.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quantity {
    pub value: f64,
    /// Standard uncertainty (GUM), in the unit of the value; zero where it is taken as exact.
    pub standard_uncertainty: f64,
}

/// A rigid indenter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "shape", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Indenter {
    /// The flat end of a cylinder.
    FlatPunch {
        radius_mm: Quantity,
    },
    Sphere {
        radius_mm: Quantity,
    },
    /// Angle between axis and flank.
    Cone {
        half_angle_degrees: Quantity,
    },
    /// Angle between axis and face.
    Pyramid {
        faces: PyramidFaces,
        half_angle_degrees: Quantity,
    },
    /// The end of a cylinder of this radius, flat but for a chamfer of 45 degrees of this width.
    ChamferedPunch {
        radius_mm: Quantity,
        chamfer_mm: Quantity,
    },
    /// A cone with a round tip.
    RoundedCone {
        half_angle_degrees: Quantity,
        tip_radius_mm: Quantity,
    },
    /// A pyramid with a round tip.
    RoundedPyramid {
        faces: PyramidFaces,
        half_angle_degrees: Quantity,
        tip_radius_mm: Quantity,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PyramidFaces {
    /// As Berkovich's.
    Three,
    /// As Vickers'.
    Four,
}

/// A flat specimen on a rigid base.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Specimen {
    pub thickness_mm: Quantity,
    pub base: Base,
    pub poisson_ratio: Quantity,
    pub poisson_basis: PoissonBasis,
}

/// Where Poisson's ratio comes from; a modulus is stated with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PoissonBasis {
    Assumed,
    Measured,
}

impl Quantity {
    fn check(&self, uncertainty_name: &'static str) -> Result<(), InvalidValue> {
        let wanted = "a number from 0 to less than the value itself, in its unit";
        let given = self.standard_uncertainty;
        // Poisson's ratio may be zero, and exactly so.
        let is_valid = given == 0.0 || (given > 0.0 && given < self.value);
        check(is_valid, uncertainty_name, given, wanted)
    }
}

impl PyramidFaces {
    /// Tangent of the half angle of the cone with the same projected area at each depth, over that of the pyramid: a regular
    /// pyramid of `n` faces has the area `n tan(pi / n) (depth tan(angle))^2`, so the factor is 1.2861 for three faces and
    /// 1.1284 for four (Oliver and Pharr, J. Mater. Res. 7 (1992) 1564-1583, take 70.3° for Berkovich's). What the edges
    /// add is left out.
    #[must_use]
    pub fn cone_factor(self) -> f64 {
        let count = match self {
            Self::Three => 3.0,
            Self::Four => 4.0,
        };
        (count / PI * (PI / count).tan()).sqrt()
    }
}

impl Indenter {
    /// How much stiffer the contact is than that of a circle of the same area (King, Int. J. Solids Struct. 23 (1987)
    /// 1657-1664).
    pub(crate) fn stiffness_factor(&self) -> f64 {
        match self {
            Self::Pyramid { faces, .. } | Self::RoundedPyramid { faces, .. } => match faces {
                PyramidFaces::Three => 1.034,
                PyramidFaces::Four => 1.012,
            },
            _ => 1.0,
        }
    }

    /// The shape that the laws take; a pyramid is its equivalent cone.
    pub fn shape(&self) -> Result<IndenterShape, InvalidValue> {
        match *self {
            Self::FlatPunch { radius_mm } => {
                Ok(IndenterShape::FlatPunch { radius_mm: checked_radius(radius_mm)? })
            }
            Self::Sphere { radius_mm } => {
                Ok(IndenterShape::Sphere { radius_mm: checked_radius(radius_mm)? })
            }
            Self::Cone { half_angle_degrees } => {
                let half_angle_rad = checked_angle(half_angle_degrees)?;
                Ok(IndenterShape::Cone { half_angle_rad })
            }
            Self::Pyramid { faces, half_angle_degrees } => {
                Ok(IndenterShape::Cone { half_angle_rad: cone_angle(faces, half_angle_degrees)? })
            }
            Self::ChamferedPunch { radius_mm, chamfer_mm } => {
                let radius_mm = checked_radius(radius_mm)?;
                let flat_radius_mm = radius_mm - checked_chamfer(chamfer_mm, radius_mm)?;
                Ok(IndenterShape::ChamferedPunch { flat_radius_mm, radius_mm })
            }
            Self::RoundedCone { half_angle_degrees, tip_radius_mm } => {
                let half_angle_rad = checked_angle(half_angle_degrees)?;
                let tip_radius_mm = checked_tip(tip_radius_mm)?;
                Ok(IndenterShape::RoundedCone { half_angle_rad, tip_radius_mm })
            }
            Self::RoundedPyramid { faces, half_angle_degrees, tip_radius_mm } => {
                let half_angle_rad = cone_angle(faces, half_angle_degrees)?;
                let tip_radius_mm = checked_tip(tip_radius_mm)?;
                Ok(IndenterShape::RoundedCone { half_angle_rad, tip_radius_mm })
            }
        }
    }
}

fn checked_radius(radius: Quantity) -> Result<f64, InvalidValue> {
    positive("the radius of the indenter", radius.value, "a length above 0 mm")?;
    radius.check("the standard uncertainty of the radius")?;
    Ok(radius.value)
}

fn checked_tip(radius: Quantity) -> Result<f64, InvalidValue> {
    positive("the radius of the tip", radius.value, "a length above 0 mm")?;
    radius.check("the standard uncertainty of the radius of the tip")?;
    Ok(radius.value)
}

fn checked_chamfer(chamfer: Quantity, radius_mm: f64) -> Result<f64, InvalidValue> {
    let is_valid = chamfer.value > 0.0 && chamfer.value < radius_mm;
    let wanted = "a width above 0 mm and below the radius";
    check(is_valid, "the chamfer of the indenter", chamfer.value, wanted)?;
    chamfer.check("the standard uncertainty of the chamfer")?;
    Ok(chamfer.value)
}

/// Of the cone of a pyramid's area, in radians.
fn cone_angle(faces: PyramidFaces, half_angle: Quantity) -> Result<f64, InvalidValue> {
    Ok((faces.cone_factor() * checked_angle(half_angle)?.tan()).atan())
}

/// In radians.
fn checked_angle(angle: Quantity) -> Result<f64, InvalidValue> {
    let is_valid = angle.value > 0.0 && angle.value < 90.0;
    let wanted = "an angle between 0 and 90 degrees, from axis to flank";
    check(is_valid, "the half angle of the indenter", angle.value, wanted)?;
    angle.check("the standard uncertainty of the half angle")?;
    Ok(angle.value.to_radians())
}

impl Specimen {
    /// The layer that the laws take.
    pub fn layer(&self) -> Result<Layer, InvalidValue> {
        let (thickness, poisson) = (self.thickness_mm, self.poisson_ratio);
        positive("the thickness of the specimen", thickness.value, "a length above 0 mm")?;
        thickness.check("the standard uncertainty of the thickness")?;
        check_poisson(poisson.value)?;
        poisson.check("the standard uncertainty of Poisson's ratio")?;
        Ok(Layer { thickness_mm: thickness.value, poisson: poisson.value, base: self.base })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exact(value: f64) -> Quantity {
        Quantity { value, standard_uncertainty: 0.0 }
    }

    const SPECIMEN: &str = r#"{
        "thickness_mm": { "value": 12.5, "standard_uncertainty": 0.2 },
        "base": "bonded",
        "poisson_ratio": { "value": 0.49, "standard_uncertainty": 0.01 },
        "poisson_basis": "assumed"
    }"#;

    #[test]
    fn documents_survive_writing_and_reading() {
        let specimen: Specimen = serde_json::from_str(SPECIMEN).unwrap();
        let expected = Layer { thickness_mm: 12.5, poisson: 0.49, base: Base::Bonded };
        assert_eq!(specimen.layer(), Ok(expected));
        let again = serde_json::to_string(&specimen).unwrap();
        assert_eq!(serde_json::from_str::<Specimen>(&again).unwrap(), specimen);
        let radius_mm = Quantity { value: 3.0, standard_uncertainty: 0.01 };
        for indenter in [
            Indenter::FlatPunch { radius_mm },
            Indenter::Sphere { radius_mm },
            Indenter::Cone { half_angle_degrees: exact(60.0) },
            Indenter::Pyramid { faces: PyramidFaces::Four, half_angle_degrees: exact(68.0) },
            Indenter::ChamferedPunch { radius_mm, chamfer_mm: exact(0.5) },
            Indenter::RoundedCone { half_angle_degrees: exact(60.0), tip_radius_mm: exact(0.1) },
            Indenter::RoundedPyramid {
                faces: PyramidFaces::Three,
                half_angle_degrees: exact(65.0),
                tip_radius_mm: exact(0.1),
            },
        ] {
            let text = serde_json::to_string(&indenter).unwrap();
            assert_eq!(serde_json::from_str::<Indenter>(&text).unwrap(), indenter, "{text}");
        }
        let text = serde_json::to_string(&Indenter::FlatPunch { radius_mm }).unwrap();
        assert!(text.starts_with(r#"{"shape":"flat-punch","radius_mm":{"value":3.0"#), "{text}");
        assert!(serde_json::from_str::<Specimen>(&SPECIMEN.replace("base", "bottom")).is_err());
    }

    /// Vickers' and Berkovich's pyramids, as their equivalent cones are printed.
    #[test]
    fn pyramids_are_the_cones_of_their_area() {
        for (faces, angle, cone) in
            [(PyramidFaces::Four, 68.0, 70.2996), (PyramidFaces::Three, 65.27, 70.3)]
        {
            let pyramid = Indenter::Pyramid { faces, half_angle_degrees: exact(angle) };
            let Ok(IndenterShape::Cone { half_angle_rad }) = pyramid.shape() else {
                panic!("{pyramid:?} is no cone");
            };
            assert!((half_angle_rad.to_degrees() - cone).abs() < 0.02, "{half_angle_rad}");
        }
    }

    #[test]
    fn bad_values_are_refused_in_one_sentence() {
        let message = |indenter: Indenter| indenter.shape().unwrap_err().to_string();
        assert_eq!(
            message(Indenter::Sphere { radius_mm: exact(-1.0) }),
            "the radius of the indenter is -1; give a length above 0 mm"
        );
        let radius_mm = Quantity { value: 1.0, standard_uncertainty: 1.5 };
        assert_eq!(
            message(Indenter::FlatPunch { radius_mm }),
            "the standard uncertainty of the radius is 1.5; give a number from 0 to less than the value itself, in its unit"
        );
        for value in [0.0, 90.0, f64::NAN] {
            let sentence = message(Indenter::Cone { half_angle_degrees: exact(value) });
            assert!(sentence.contains("between 0 and 90 degrees"), "{sentence}");
        }
        let radius_mm = exact(3.0);
        let whole = message(Indenter::ChamferedPunch { radius_mm, chamfer_mm: exact(3.0) });
        assert!(whole.contains("below the radius"), "{whole}");
        let half_angle_degrees = exact(60.0);
        let pointed =
            message(Indenter::RoundedCone { half_angle_degrees, tip_radius_mm: exact(0.0) });
        assert!(pointed.starts_with("the radius of the tip is 0;"), "{pointed}");
        let good: Specimen = serde_json::from_str(SPECIMEN).unwrap();
        let doubtful = Quantity { value: 0.4, standard_uncertainty: f64::NAN };
        for bad in [
            Specimen { thickness_mm: exact(f64::INFINITY), ..good },
            Specimen { poisson_ratio: exact(0.51), ..good },
            Specimen { poisson_ratio: doubtful, ..good },
        ] {
            assert!(bad.layer().is_err(), "{bad:?}");
        }
        assert!(Specimen { poisson_ratio: exact(0.0), ..good }.layer().is_ok());
    }
}
