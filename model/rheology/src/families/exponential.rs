//! An exponential spring in a Kelvin body.

use super::family::{Family, OuterParameter, OuterRange};
use super::model::ModelParameter;
use super::relaxation::{DepthDrive, RelaxationTerm};
use super::table::FamilyKind;
use std::sync::Arc;

/// `F + tau_eps F' = T + tau_sig dT/dt` with `T = A (e^(B x) - 1)`: the Kelvin body with its spring
/// made exponential.
///
/// The exponential response is that of Fung, Am. J. Physiol. 213 (1967) 1532-1544, whose slope grows
/// in proportion to the force. As `B` tends to zero it is the Kelvin body with `mu1 = A B`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ExponentialKelvin;

/// Range of `B` times the greatest depth: below, the response is straight to 5 % and `A` and `B`
/// become one number; above, force grows by e^20 = 5e8 over the stroke.
pub(super) const CURVATURE: OuterRange = OuterRange::PerDepth(0.05, 20.0);

pub(super) const KIND: FamilyKind = FamilyKind {
    word: "exponential",
    of: |number| number.is_none().then(|| Arc::new(ExponentialKelvin) as _),
    compared: None,
};

impl Family for ExponentialKelvin {
    fn key(&self) -> String {
        "exponential".into()
    }

    fn name(&self) -> String {
        "exponential spring in a Kelvin body".into()
    }

    fn equation(&self) -> &'static str {
        "F + tau_eps F' = T + tau_sig T', T = A (e^(B x) - 1)"
    }

    fn cannot_represent(&self) -> &'static str {
        "more than one relaxation time; stiffness that does not grow in proportion to force; unloading that differs from loading"
    }

    fn adds_to(&self) -> Vec<(String, &'static str)> {
        vec![("kelvin".into(), "stiffness that grows with force")]
    }

    fn outer(&self) -> Vec<OuterParameter> {
        vec![
            OuterParameter::new("tau_eps", "s", OuterRange::Time),
            OuterParameter::new("B", "1/mm", CURVATURE),
        ]
    }

    fn linear(&self) -> Vec<(String, &'static str)> {
        vec![("A".into(), "N"), ("A_tau_sig".into(), "N*s")]
    }

    fn columns(&self, outer: &[f64]) -> Vec<Vec<RelaxationTerm>> {
        let (tau, spring) = (outer[0], DepthDrive::exponential(1.0, outer[1]));
        let elastic = RelaxationTerm::settling(spring, tau);
        let viscous = RelaxationTerm::driven(spring, tau);
        vec![vec![elastic], vec![viscous]]
    }

    fn fading(&self, outer: &[f64]) -> Option<f64> {
        Some(outer[0])
    }

    fn derived(&self, _outer: &[f64], linear: &[f64]) -> Vec<ModelParameter> {
        vec![ModelParameter::new("tau_sig", linear[1] / linear[0], "s")]
    }
}
