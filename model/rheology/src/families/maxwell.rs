//! The Maxwell body: a spring and a dashpot in series.

use super::family::{Family, OuterParameter, OuterRange};
use super::model::ModelParameter;
use super::relaxation::{DepthDrive, RelaxationTerm};
use super::table::FamilyKind;
use std::sync::Arc;

/// `F + (eta / k) F' = eta x'`, as the spring `k` and its relaxation time `tau = eta / k`.
///
/// Fung, "Biomechanics: Mechanical Properties of Living Tissues", 2nd ed., section 2.11.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Maxwell;

pub(super) const KIND: FamilyKind = FamilyKind {
    word: "maxwell",
    of: |number| number.is_none().then(|| Arc::new(Maxwell) as _),
    compared: None,
};

impl Family for Maxwell {
    fn key(&self) -> String {
        "maxwell".into()
    }

    fn name(&self) -> String {
        "Maxwell".into()
    }

    fn equation(&self) -> &'static str {
        "F + tau F' = k tau x'"
    }

    fn cannot_represent(&self) -> &'static str {
        "an equilibrium force other than zero; stiffness that grows with depth; unloading that differs from loading"
    }

    fn outer(&self) -> Vec<OuterParameter> {
        vec![OuterParameter::new("tau", "s", OuterRange::Time)]
    }

    fn linear(&self) -> Vec<(String, &'static str)> {
        vec![("k".into(), "N/mm")]
    }

    fn columns(&self, outer: &[f64]) -> Vec<Vec<RelaxationTerm>> {
        vec![vec![RelaxationTerm::maxwell(DepthDrive::power(1, 1.0), outer[0])]]
    }

    fn fading(&self, outer: &[f64]) -> Option<f64> {
        Some(outer[0])
    }

    fn derived(&self, outer: &[f64], linear: &[f64]) -> Vec<ModelParameter> {
        vec![ModelParameter::new("eta", linear[0] * outer[0], "N*s/mm")]
    }
}
