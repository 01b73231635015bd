//! Indenters and specimens beside the given ones, by their standard uncertainties.

use super::ModulusTerm;
use crate::document::{Indenter, Quantity, Specimen};

pub(super) type Varied = (ModulusTerm, [(Indenter, Specimen); 2]);

/// Indenter and specimen with each uncertain number one standard uncertainty lower and higher.
pub(super) fn varied(indenter: &Indenter, specimen: &Specimen) -> Vec<Varied> {
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
        [low, high].map(|value| Quantity { value, ..quantity })
    };
    let mut found: Vec<Varied> = Vec::new();
    let (term, size) = match *indenter {
        Indenter::FlatPunch { radius_mm } | Indenter::Sphere { radius_mm } => {
            (ModulusTerm::Radius, radius_mm)
        }
        Indenter::Cone { half_angle_degrees } | Indenter::Pyramid { half_angle_degrees, .. } => {
            (ModulusTerm::HalfAngle, half_angle_degrees)
        }
    };
    let with_size = |size: Quantity| match *indenter {
        Indenter::FlatPunch { .. } => Indenter::FlatPunch { radius_mm: size },
        Indenter::Sphere { .. } => Indenter::Sphere { radius_mm: size },
        Indenter::Cone { .. } => Indenter::Cone { half_angle_degrees: size },
        Indenter::Pyramid { faces, .. } => Indenter::Pyramid { faces, half_angle_degrees: size },
    };
    let all = [0.0, f64::INFINITY];
    if size.standard_uncertainty > 0.0 {
        found.push((term, ends(size, all).map(|size| (with_size(size), *specimen))));
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
