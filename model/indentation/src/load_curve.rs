//! Force over Young's modulus as a function of depth, fast enough for a fit.

use crate::document::{Indenter, Specimen};
use crate::layer::Layer;
use crate::shape::IndenterShape;
use crate::validity::{ContactError, ContactLaw};

/// A law as a function of depth, whose slope is known too.
pub(crate) enum LoadCurve {
    /// `coefficient * depth^exponent`.
    Power { coefficient: f64, exponent: f64 },
    /// Cubic between knots, of which each has the exact slope.
    Table(Vec<LoadKnot>),
}

/// Depth in mm, force over modulus in mm² and its slope in mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LoadKnot {
    pub depth: f64,
    pub force: f64,
    pub slope: f64,
}

/// Knots at equal steps of the contact radius: the cubic is off by less than 1e-6 of the highest force.
const KNOTS: u32 = 48;

impl LoadCurve {
    /// The law up to a depth in mm, which it must describe.
    pub fn new(
        law: ContactLaw,
        indenter: &Indenter,
        specimen: &Specimen,
        depth_max: f64,
    ) -> Result<Self, ContactError> {
        let deepest = law.contact(indenter, specimen, depth_max)?;
        let (shape, layer) = (indenter.shape()?, specimen.layer()?);
        let Some(exponent) = exponent(law, shape) else {
            let [begin, _] = shape.contact_radii();
            let numbered = |number: u32| {
                let share = f64::from(number) / f64::from(KNOTS);
                // From a flat on the depth grows with the root of the radius.
                let share = if begin > 0.0 { share * share } else { share };
                match begin + (deepest.radius_mm - begin) * share {
                    0.0 => LoadKnot::default(),
                    radius => knot(law, shape, layer, radius),
                }
            };
            return Ok(Self::Table((0..=KNOTS).map(numbered).collect()));
        };
        let coefficient = deepest.force_over_modulus / depth_max.powf(exponent);
        Ok(Self::Power { coefficient, exponent })
    }

    /// Force over modulus and its slope at a depth; nothing before the contact.
    pub fn at(&self, depth: f64) -> [f64; 2] {
        if depth <= 0.0 {
            return [0.0; 2];
        }
        match self {
            Self::Power { coefficient, exponent } => {
                let slope = match *exponent {
                    1.0 => *coefficient,
                    1.5 => coefficient * depth.sqrt(),
                    _ => coefficient * depth.powf(exponent - 1.0),
                };
                [slope * depth, exponent * slope]
            }
            Self::Table(knots) => {
                let after = knots.partition_point(|knot| knot.depth <= depth);
                let [from, to] = match knots.get(after) {
                    Some(to) => [knots[after - 1], *to],
                    // Beyond the last knot it goes on straight; what is found there is refused behind the fit.
                    None => {
                        let last = knots[knots.len() - 1];
                        return [last.force + last.slope * (depth - last.depth), last.slope];
                    }
                };
                hermite(from, to, depth)
            }
        }
    }
}

/// Force over modulus and its slope at one depth, without the curve to it.
pub(crate) fn load_at(
    law: ContactLaw,
    indenter: &Indenter,
    specimen: &Specimen,
    depth: f64,
) -> Result<[f64; 2], ContactError> {
    let contact = law.contact(indenter, specimen, depth)?;
    let (shape, layer) = (indenter.shape()?, specimen.layer()?);
    let force = contact.force_over_modulus;
    let slope = match exponent(law, shape) {
        Some(exponent) => exponent * force / depth,
        None => knot(law, shape, layer, contact.radius_mm).slope,
    };
    Ok([force, slope])
}

/// Of the depth, where the law is a power of it.
fn exponent(law: ContactLaw, shape: IndenterShape) -> Option<f64> {
    match (law, shape) {
        (_, IndenterShape::FlatPunch { .. }) => Some(1.0),
        (ContactLaw::Hertz, _) => Some(1.5),
        (ContactLaw::Sneddon, IndenterShape::Cone { .. }) => Some(2.0),
        _ => None,
    }
}

fn knot(law: ContactLaw, shape: IndenterShape, layer: Layer, radius: f64) -> LoadKnot {
    match law {
        ContactLaw::Layer => layer.load_knot(shape, radius),
        _ => half_space_knot(shape, radius, layer),
    }
}

/// The cubic through two knots with their slopes.
fn hermite(from: LoadKnot, to: LoadKnot, depth: f64) -> [f64; 2] {
    let width = to.depth - from.depth;
    let t = (depth - from.depth) / width;
    let rise = (to.force - from.force) / width;
    // Divided differences of the doubled knots.
    let second = rise - from.slope;
    let third = from.slope + to.slope - 2.0 * rise;
    let value = from.force + width * t * (from.slope + t * (second + (t - 1.0) * third));
    let slope = from.slope + 2.0 * t * second + third * t * (3.0 * t - 2.0);
    [value, slope]
}

/// A shape whose contact grows, on a half-space, at a contact radius.
fn half_space_knot(shape: IndenterShape, radius: f64, layer: Layer) -> LoadKnot {
    let plane = 1.0 / (1.0 - layer.poisson * layer.poisson);
    LoadKnot {
        depth: shape.taken(radius),
        force: plane * shape.half_space_force(radius),
        slope: 2.0 * plane * radius,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::{PoissonBasis, Quantity};
    use crate::layer::Base;

    fn exact(value: f64) -> Quantity {
        Quantity { value, standard_uncertainty: 0.0 }
    }

    #[test]
    fn a_curve_is_the_law_at_every_depth() {
        let rounded =
            Indenter::RoundedCone { half_angle_degrees: exact(70.0), tip_radius_mm: exact(1.0) };
        let chamfered = Indenter::ChamferedPunch { radius_mm: exact(2.5), chamfer_mm: exact(0.5) };
        let cases = [
            (ContactLaw::Hertz, Indenter::Sphere { radius_mm: exact(4.0) }, 400.0, 0.2),
            (ContactLaw::Sneddon, Indenter::Sphere { radius_mm: exact(4.0) }, 800.0, 0.9),
            (ContactLaw::Sneddon, Indenter::Cone { half_angle_degrees: exact(70.0) }, 400.0, 0.3),
            (ContactLaw::Layer, Indenter::FlatPunch { radius_mm: exact(2.0) }, 3.0, 0.2),
            (ContactLaw::Layer, Indenter::Sphere { radius_mm: exact(4.0) }, 2.0, 0.18),
            (ContactLaw::Layer, Indenter::Cone { half_angle_degrees: exact(70.0) }, 4.0, 0.3),
            (ContactLaw::Sneddon, rounded, 400.0, 0.3),
            (ContactLaw::Layer, rounded, 4.0, 0.3),
            (ContactLaw::Sneddon, chamfered, 800.0, 0.3),
            (ContactLaw::Layer, chamfered, 8.0, 0.3),
        ];
        for (law, indenter, thickness, depth_max) in cases {
            let specimen = Specimen {
                thickness_mm: exact(thickness),
                base: Base::Bonded,
                poisson_ratio: exact(0.45),
                poisson_basis: PoissonBasis::Assumed,
            };
            let curve = LoadCurve::new(law, &indenter, &specimen, depth_max).unwrap();
            let highest = curve.at(depth_max)[0];
            for share in [1e-3, 0.013, 0.11, 0.37, 0.71, 0.93, 1.0] {
                let depth = share * depth_max;
                let expected = law.contact(&indenter, &specimen, depth).unwrap().force_over_modulus;
                let [found, slope] = curve.at(depth);
                assert!((found - expected).abs() < 1e-6 * highest, "{law:?} {indenter:?} {share}");
                let step = 1e-4 * depth;
                let rise = (curve.at(depth + step)[0] - curve.at(depth - step)[0]) / (2.0 * step);
                assert!((slope / rise - 1.0).abs() < 1e-3 || share == 1.0, "{slope} {rise}");
            }
            let [force, slope] = load_at(law, &indenter, &specimen, depth_max).unwrap();
            let [expected, rise] = curve.at(depth_max);
            assert!((force / expected - 1.0).abs() < 1e-6 && (slope / rise - 1.0).abs() < 1e-6);
            assert_eq!(curve.at(-0.1), [0.0; 2]);
        }
    }
}
