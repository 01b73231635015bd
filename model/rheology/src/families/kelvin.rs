//! The Kelvin body, or standard linear solid.

use super::family::{Family, OuterParameter, OuterRange};
use super::model::ModelParameter;
use super::relaxation::{DepthDrive, RelaxationTerm};
use super::table::FamilyKind;
use std::sync::Arc;

/// `F + tau_eps F' = mu1 x + eta x'`, with `eta = mu1 tau_sig`.
///
/// Equation 3.2 of the thesis; Fung, "Biomechanics: Mechanical Properties of Living Tissues", 2nd
/// ed., section 2.11. The same body as a spring beside one spring in series with a dashpot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kelvin;

pub(super) const KIND: FamilyKind = FamilyKind {
    word: "kelvin",
    of: |number| number.is_none().then(|| Arc::new(Kelvin) as _),
    compared: None,
};

impl Family for Kelvin {
    fn key(&self) -> String {
        "kelvin".into()
    }

    fn name(&self) -> String {
        "Kelvin (standard linear solid)".into()
    }

    fn equation(&self) -> &'static str {
        "F + tau_eps F' = mu1 x + eta x', eta = mu1 tau_sig (equation 3.2)"
    }

    fn cannot_represent(&self) -> &'static str {
        "stiffness that grows with depth; more than one relaxation time; unloading that differs from loading"
    }

    fn adds_to(&self) -> Vec<(String, &'static str)> {
        vec![
            ("voigt".into(), "a spring in series with the dashpot"),
            ("maxwell".into(), "a spring in parallel"),
        ]
    }

    fn outer(&self) -> Vec<OuterParameter> {
        vec![OuterParameter::new("tau_eps", "s", OuterRange::Time)]
    }

    fn linear(&self) -> Vec<(String, &'static str)> {
        vec![("mu1".into(), "N/mm"), ("eta".into(), "N*s/mm")]
    }

    fn columns(&self, outer: &[f64]) -> Vec<Vec<RelaxationTerm>> {
        let tau = outer[0];
        let elastic = RelaxationTerm::settling(DepthDrive::power(1, 1.0), tau);
        let viscous = RelaxationTerm::driven(DepthDrive::power(1, 1.0), tau);
        vec![vec![elastic], vec![viscous]]
    }

    fn fading(&self, outer: &[f64]) -> Option<f64> {
        Some(outer[0])
    }

    fn derived(&self, _outer: &[f64], linear: &[f64]) -> Vec<ModelParameter> {
        vec![ModelParameter::new("tau_sig", linear[1] / linear[0], "s")]
    }
}
