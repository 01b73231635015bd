//! Indenters and specimens beside the given ones, by their standard uncertainties.

use super::ModulusTerm;
use crate::document::{Indenter, Quantity, Specimen};

/// In degrees, short of a plane.
const HALF_ANGLE_MAX: f64 = 89.99;

pub(in crate::fit) type Varied = (ModulusTerm, [(Indenter, Specimen); 2]);

/// Indenter and specimen with each uncertain number one standard uncertainty lower and higher.
pub(in crate::fit) fn varied(indenter: &Indenter, specimen: &Specimen) -> Vec<Varied> {
    let ends = |quantity: Quantity, range: [f64; 2]| {
        let error = quantity.standard_uncertainty;
        // A number at its physical end, as a Poisson's ratio of 0.5, is moved to the other side only, and twice as far.
        let low = (quantity.value - error).max(range[0]);
        let high = (quantity.value + error).min(range[1]);
        let (low, high) = match (high - quantity.value < error, quantity.value - low < error) {
            (true, _) => ((high - 2.0 * error).max(range[0]), high),
            (_, true) => (low, (low + 2.0 * error).min(range[1])),
            _ => (low, high),
        };
        [low, high].map(|value| Quantity { value, standard_uncertainty: 0.0 })
    };
    let mut found: Vec<Varied> = Vec::new();
    let all = [0.0, f64::INFINITY];
    for (term, size, with_size) in sizes(*indenter) {
        if size.standard_uncertainty > 0.0 {
            let range = if term == ModulusTerm::HalfAngle { [0.0, HALF_ANGLE_MAX] } else { all };
            found.push((term, ends(size, range).map(|size| (with_size(size), *specimen))));
        }
    }
    if specimen.thickness_mm.standard_uncertainty > 0.0 {
        let ends = ends(specimen.thickness_mm, all);
        let with = |thickness_mm| (*indenter, Specimen { thickness_mm, ..*specimen });
        found.push((ModulusTerm::Thickness, ends.map(with)));
    }
    if specimen.poisson_ratio.standard_uncertainty > 0.0 {
        let ends = ends(specimen.poisson_ratio, [0.0, 0.5]);
        let with = |poisson_ratio| (*indenter, Specimen { poisson_ratio, ..*specimen });
        found.push((ModulusTerm::Poisson, ends.map(with)));
    }
    found
}

type Size = (ModulusTerm, Quantity, Box<dyn Fn(Quantity) -> Indenter>);

/// The numbers of an indenter, each with what makes the indenter of another one.
fn sizes(indenter: Indenter) -> Vec<Size> {
    fn size(
        term: ModulusTerm,
        quantity: Quantity,
        with: impl Fn(Quantity) -> Indenter + 'static,
    ) -> Size {
        (term, quantity, Box::new(with))
    }
    use ModulusTerm::{Chamfer, HalfAngle, Radius, TipRadius};
    match indenter {
        Indenter::FlatPunch { radius_mm } => {
            vec![size(Radius, radius_mm, |radius_mm| Indenter::FlatPunch { radius_mm })]
        }
        Indenter::Sphere { radius_mm } => {
            vec![size(Radius, radius_mm, |radius_mm| Indenter::Sphere { radius_mm })]
        }
        Indenter::Cone { half_angle_degrees } => {
            let with = |half_angle_degrees| Indenter::Cone { half_angle_degrees };
            vec![size(HalfAngle, half_angle_degrees, with)]
        }
        Indenter::Pyramid { faces, half_angle_degrees } => {
            let with = move |half_angle_degrees| Indenter::Pyramid { faces, half_angle_degrees };
            vec![size(HalfAngle, half_angle_degrees, with)]
        }
        Indenter::ChamferedPunch { radius_mm, chamfer_mm } => vec![
            size(Radius, radius_mm, move |radius_mm| Indenter::ChamferedPunch {
                radius_mm,
                chamfer_mm,
            }),
            size(Chamfer, chamfer_mm, move |chamfer_mm| Indenter::ChamferedPunch {
                radius_mm,
                chamfer_mm,
            }),
        ],
        Indenter::RoundedCone { half_angle_degrees, tip_radius_mm } => vec![
            size(HalfAngle, half_angle_degrees, move |half_angle_degrees| Indenter::RoundedCone {
                half_angle_degrees,
                tip_radius_mm,
            }),
            size(TipRadius, tip_radius_mm, move |tip_radius_mm| Indenter::RoundedCone {
                half_angle_degrees,
                tip_radius_mm,
            }),
        ],
        Indenter::RoundedPyramid { faces, half_angle_degrees, tip_radius_mm } => vec![
            size(HalfAngle, half_angle_degrees, move |half_angle_degrees| {
                Indenter::RoundedPyramid { faces, half_angle_degrees, tip_radius_mm }
            }),
            size(TipRadius, tip_radius_mm, move |tip_radius_mm| Indenter::RoundedPyramid {
                faces,
                half_angle_degrees,
                tip_radius_mm,
            }),
        ],
    }
}
