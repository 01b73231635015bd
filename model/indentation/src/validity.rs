//! How far each contact law holds.

use crate::document::{Indenter, Specimen};
use crate::invalid_value::{InvalidValue, positive};
use crate::layer::{LayerError, RADIUS_OVER_THICKNESS_MAX};
use crate::shape::{Contact, IndenterShape};
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_2_PI;
use thiserror::Error;

/// A law for the force of an indenter at a depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ContactLaw {
    /// A sphere as a parabola on a half-space (Hertz 1882).
    Hertz,
    /// Any shape on a half-space (Sneddon, Int. J. Eng. Sci. 3 (1965) 47-57).
    Sneddon,
    /// Any shape on a layer on a rigid base (Hayes et al., J. Biomech. 5 (1972) 541-551).
    Layer,
}

/// A ratio beside the largest at which the law holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounded {
    pub value: f64,
    pub max: f64,
}

/// Where a contact stands in the range of its law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Validity {
    /// Depth over tip radius; `None` where the law follows the shape at any depth.
    pub depth_over_radius: Option<Bounded>,
    /// Contact radius over specimen thickness.
    pub radius_over_thickness: Bounded,
    /// The larger of depth over thickness and the representative strain beneath the indenter: 0.2 times contact radius over tip
    /// radius for a sphere, 0.2 times the cotangent of the half angle for a cone, the smaller of both for a rounded one (Tabor, The Hardness of Metals, 1951), and
    /// for a flat punch its mean pressure over `E / (1 - nu^2)`, `2 / pi` times depth over radius.
    pub strain: Bounded,
}

/// A contact that the chosen law does not describe.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ContactError {
    #[error(transparent)]
    Value(#[from] InvalidValue),
    #[error(transparent)]
    Layer(#[from] LayerError),
    #[error("Hertz's law describes a sphere only; take Sneddon's law or that of a layer")]
    NotASphere,
    #[error("{ratio} is {value:.4}, above {max}, up to which the law holds; {way_out}")]
    Outside { ratio: &'static str, value: f64, max: f64, way_out: &'static str },
}

/// A parabola takes 0.5 % more force than its sphere here: the next term is a tenth of depth over radius.
const DEPTH_OVER_RADIUS_MAX: f64 = 0.05;
/// A layer, bonded and incompressible, takes 0.46 % more force than a half-space here: 1.14 times the ratio.
const HALF_SPACE_RADIUS_OVER_THICKNESS_MAX: f64 = 0.004;
/// Linear elasticity leaves out the squares of strains: a tenth of what it keeps here.
const STRAIN_MAX: f64 = 0.1;

impl ContactLaw {
    /// The contact at a depth in mm, refused outside of the range of the law.
    pub fn contact(
        self,
        indenter: &Indenter,
        specimen: &Specimen,
        depth_mm: f64,
    ) -> Result<Contact, ContactError> {
        let (contact, validity) = self.assess(indenter, specimen, depth_mm)?;
        validity.check()?;
        Ok(contact)
    }

    /// Where the contact at a depth in mm stands in the range of the law.
    pub fn validity(
        self,
        indenter: &Indenter,
        specimen: &Specimen,
        depth_mm: f64,
    ) -> Result<Validity, ContactError> {
        Ok(self.assess(indenter, specimen, depth_mm)?.1)
    }

    fn assess(
        self,
        indenter: &Indenter,
        specimen: &Specimen,
        depth_mm: f64,
    ) -> Result<(Contact, Validity), ContactError> {
        let (shape, layer) = (indenter.shape()?, specimen.layer()?);
        positive("the depth", depth_mm, "a length above 0 mm")?;
        let contact = match (self, shape) {
            (Self::Layer, _) => layer.contact(shape, depth_mm)?,
            (Self::Sneddon, _) => on_half_space(shape, depth_mm, layer.poisson)?,
            (Self::Hertz, IndenterShape::Sphere { radius_mm }) => {
                on_half_space(IndenterShape::Parabola { radius_mm }, depth_mm, layer.poisson)?
            }
            (Self::Hertz, _) => return Err(ContactError::NotASphere),
        };
        let (depth_over_radius, strain) = match shape {
            IndenterShape::FlatPunch { radius_mm }
            | IndenterShape::ChamferedPunch { flat_radius_mm: radius_mm, .. } => {
                (None, FRAC_2_PI * depth_mm / radius_mm)
            }
            IndenterShape::Parabola { radius_mm } | IndenterShape::Sphere { radius_mm } => {
                let bounded = Bounded { value: depth_mm / radius_mm, max: DEPTH_OVER_RADIUS_MAX };
                let strain = 0.2 * contact.radius_mm / radius_mm;
                ((self == Self::Hertz).then_some(bounded), strain)
            }
            IndenterShape::Cone { half_angle_rad } => (None, 0.2 / half_angle_rad.tan()),
            IndenterShape::RoundedCone { half_angle_rad, tip_radius_mm } => {
                let slope = (contact.radius_mm / tip_radius_mm).min(1.0 / half_angle_rad.tan());
                (None, 0.2 * slope)
            }
        };
        let radius_over_thickness = Bounded {
            value: contact.radius_mm / layer.thickness_mm,
            max: match self {
                Self::Layer => RADIUS_OVER_THICKNESS_MAX,
                Self::Hertz | Self::Sneddon => HALF_SPACE_RADIUS_OVER_THICKNESS_MAX,
            },
        };
        let strain = Bounded { value: strain.max(depth_mm / layer.thickness_mm), max: STRAIN_MAX };
        Ok((contact, Validity { depth_over_radius, radius_over_thickness, strain }))
    }
}

fn on_half_space(
    shape: IndenterShape,
    depth_mm: f64,
    poisson: f64,
) -> Result<Contact, InvalidValue> {
    let contact = shape.on_half_space(depth_mm, poisson);
    let wanted = "a depth in mm at which it does not touch beyond the equator of its sphere or the end of its chamfer";
    contact.ok_or(InvalidValue { name: "the depth", value: depth_mm, wanted })
}

impl Validity {
    /// The first ratio that is outside of the range of the law, as a sentence.
    pub fn check(&self) -> Result<(), ContactError> {
        let within = |ratio, bounded: Bounded, way_out| match bounded.value <= bounded.max {
            true => Ok(()),
            false => Err(ContactError::Outside {
                ratio,
                value: bounded.value,
                max: bounded.max,
                way_out,
            }),
        };
        if let Some(bounded) = self.depth_over_radius {
            let way_out = "take a smaller depth, or another law";
            within("the depth over the tip radius", bounded, way_out)?;
        }
        let way_out = "take the law of a layer or a smaller contact";
        within("the contact radius over the thickness", self.radius_over_thickness, way_out)?;
        within("the strain", self.strain, "take a smaller depth or a blunter indenter")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::{PoissonBasis, PyramidFaces, Quantity};
    use crate::layer::Base;

    fn exact(value: f64) -> Quantity {
        Quantity { value, standard_uncertainty: 0.0 }
    }

    fn specimen(thickness_mm: f64) -> Specimen {
        Specimen {
            thickness_mm: exact(thickness_mm),
            base: Base::Bonded,
            poisson_ratio: exact(0.5),
            poisson_basis: PoissonBasis::Assumed,
        }
    }

    fn sphere(radius_mm: f64) -> Indenter {
        Indenter::Sphere { radius_mm: exact(radius_mm) }
    }

    fn refusal(law: ContactLaw, indenter: &Indenter, thickness: f64, depth: f64) -> String {
        law.contact(indenter, &specimen(thickness), depth).unwrap_err().to_string()
    }

    /// At each limit the law is off by what its comment says, and no more.
    #[test]
    fn laws_are_off_by_what_is_stated_at_their_limits() {
        let force = |law: ContactLaw, thickness: f64, depth: f64| {
            let found = law.assess(&sphere(1.0), &specimen(thickness), depth).unwrap();
            found.0.force_over_modulus
        };
        let shape = force(ContactLaw::Hertz, 1e6, DEPTH_OVER_RADIUS_MAX)
            / force(ContactLaw::Sneddon, 1e6, DEPTH_OVER_RADIUS_MAX)
            - 1.0;
        assert!((0.004..0.006).contains(&shape), "{shape}");
        // A punch is stiffened most.
        let (punch, thick) = (
            Indenter::FlatPunch { radius_mm: exact(1.0) },
            specimen(1.0 / HALF_SPACE_RADIUS_OVER_THICKNESS_MAX),
        );
        let force = |law: ContactLaw| law.contact(&punch, &thick, 0.1).unwrap().force_over_modulus;
        let base = force(ContactLaw::Layer) / force(ContactLaw::Sneddon) - 1.0;
        assert!((0.0045..0.005).contains(&base), "{base}");
    }

    #[test]
    fn contact_within_the_range_is_the_law_s() {
        let found = ContactLaw::Hertz.contact(&sphere(4.0), &specimen(200.0), 0.1).unwrap();
        let parabola = IndenterShape::Parabola { radius_mm: 4.0 };
        assert_eq!(Some(found), parabola.on_half_space(0.1, 0.5));
        let validity = ContactLaw::Hertz.validity(&sphere(4.0), &specimen(200.0), 0.1).unwrap();
        assert_eq!(validity.depth_over_radius.unwrap().value, 0.025);
        assert!((validity.radius_over_thickness.value - 0.4f64.sqrt() / 200.0).abs() < 1e-15);
        assert!((validity.strain.value - 0.05 * 0.4f64.sqrt()).abs() < 1e-15);
        // Depth over thickness is the larger strain on a thin layer.
        let punch = Indenter::FlatPunch { radius_mm: exact(4.0) };
        let thin = ContactLaw::Layer.validity(&punch, &specimen(1.0), 0.08).unwrap();
        assert_eq!(thin.strain.value, 0.08);
        assert_eq!(thin.check(), Ok(()));
    }

    #[test]
    fn contact_outside_of_the_range_is_refused_in_one_sentence() {
        assert_eq!(
            refusal(ContactLaw::Hertz, &sphere(1.0), 100.0, 0.08),
            "the depth over the tip radius is 0.0800, above 0.05, up to which the law holds; take a smaller depth, or another law"
        );
        let deep = refusal(ContactLaw::Sneddon, &sphere(1.0), 400.0, 0.4);
        assert!(deep.starts_with("the strain is 0.1"), "{deep}");
        let thin = refusal(ContactLaw::Sneddon, &sphere(1.0), 3.0, 0.02);
        assert!(thin.starts_with("the contact radius over the thickness is 0.0"), "{thin}");
        assert!(thin.contains("take the law of a layer"), "{thin}");
        let pyramid =
            Indenter::Pyramid { faces: PyramidFaces::Four, half_angle_degrees: exact(35.0) };
        let sharp = refusal(ContactLaw::Sneddon, &pyramid, 100.0, 0.01);
        assert!(sharp.contains("blunter indenter"), "{sharp}");
        let cone = Indenter::Cone { half_angle_degrees: exact(70.0) };
        assert!(refusal(ContactLaw::Hertz, &cone, 1.0, 0.01).starts_with("Hertz's law describes"));
        assert!(refusal(ContactLaw::Sneddon, &sphere(1.0), 1.0, 1e9).contains("equator"));
        assert!(refusal(ContactLaw::Layer, &sphere(1.0), 1.0, f64::NAN).contains("the depth"));
        let hair = refusal(ContactLaw::Layer, &sphere(1e4), 1.0, 0.08);
        assert!(hair.contains("8 times the thickness"), "{hair}");
    }
}
