//! The Voigt body: a spring and a dashpot side by side.

use super::family::{Family, OuterParameter};
use super::relaxation::{DepthDrive, RelaxationTerm};
use super::table::FamilyKind;
use std::sync::Arc;

/// `F = k x + eta x'`.
///
/// Fung, "Biomechanics: Mechanical Properties of Living Tissues", 2nd ed., section 2.11. It is the one
/// family that looks at speed directly, the mean speed since the sample before: noise of the depth
/// goes into its force undamped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Voigt;

pub(super) const KIND: FamilyKind = FamilyKind {
    word: "voigt",
    of: |number| number.is_none().then(|| Arc::new(Voigt) as _),
    compared: None,
};

impl Family for Voigt {
    fn key(&self) -> String {
        "voigt".into()
    }

    fn name(&self) -> String {
        "Voigt".into()
    }

    fn equation(&self) -> &'static str {
        "F = k x + eta x'"
    }

    fn cannot_represent(&self) -> &'static str {
        "relaxation at constant depth, because its force falls at once when the probe stops; a jump of depth, because a jump takes an infinite force; stiffness that grows with depth"
    }

    fn outer(&self) -> Vec<OuterParameter> {
        Vec::new()
    }

    fn linear(&self) -> Vec<(String, &'static str)> {
        vec![("k".into(), "N/mm"), ("eta".into(), "N*s/mm")]
    }

    fn columns(&self, _outer: &[f64]) -> Vec<Vec<RelaxationTerm>> {
        let dashpot = RelaxationTerm::driven(DepthDrive::power(1, 1.0), 0.0);
        vec![vec![RelaxationTerm::spring(DepthDrive::power(1, 1.0))], vec![dashpot]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::units::{Depth, Seconds};

    #[test]
    fn spring_and_dashpot_have_no_memory_at_any_step() {
        let family: &dyn Family = &Voigt;
        let model = family.model(&[], &[0.2, 0.15]).unwrap();
        for dt in [1e-6, 1e-3, 1.0] {
            let mut body = model.at_rest_from(Depth(0.0)).unwrap();
            let mut before = 0.0;
            for depth in [0.5, 2.0, 2.0, 1.0, 4.0] {
                let force = body.step(Depth(depth), Seconds(dt)).unwrap().0;
                let exact = 0.2 * depth + 0.15 * (depth - before) / dt;
                // A few roundings of the largest term.
                assert!((force - exact).abs() <= 1e-15 * (1.0 + 1.0 / dt), "{dt} {depth}");
                before = depth;
            }
        }
    }
}
