//! An exponential spring in a Kelvin body.

use super::family::{Family, Outer, OuterRange};
use super::model::ModelParameter;
use super::relaxation::{Drive, Relaxation};

/// `F + tau_eps F' = T + tau_sig dT/dt` with `T = A (e^(B x) - 1)`: the Kelvin body with its spring
/// made exponential.
///
/// The exponential response is that of Fung, Am. J. Physiol. 213 (1967) 1532-1544, whose slope grows
/// in proportion to the force. As `B` tends to zero it is the Kelvin body with `mu1 = A B`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExponentialKelvin;

/// Range of `B` times the greatest depth: below, the response is straight to 5 % and `A` and `B`
/// become one number; above, force grows by e^20 = 5e8 over the stroke.
pub(super) const CURVATURE: OuterRange = OuterRange::PerDepth(0.05, 20.0);

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
        "more than one relaxation time; stiffness that grows other than in proportion to force; unloading that differs from loading"
    }

    fn outer(&self) -> Vec<Outer> {
        vec![
            Outer {
                name: "tau_eps".into(),
                unit: "s",
                range: OuterRange::Time,
            },
            Outer {
                name: "B".into(),
                unit: "1/mm",
                range: CURVATURE,
            },
        ]
    }

    fn linear(&self) -> Vec<(String, &'static str)> {
        vec![("A".into(), "N"), ("A_tau_sig".into(), "N*s")]
    }

    fn columns(&self, outer: &[f64]) -> Vec<Vec<Relaxation>> {
        let (tau, spring) = (outer[0], Drive::exponential(1.0, outer[1]));
        let elastic = Relaxation {
            tau,
            elastic: spring,
            rate: Drive::default(),
        };
        let viscous = Relaxation {
            tau,
            elastic: Drive::default(),
            rate: spring,
        };
        vec![vec![elastic], vec![viscous]]
    }

    fn fading(&self, outer: &[f64]) -> Option<f64> {
        Some(outer[0])
    }

    fn derived(&self, _outer: &[f64], linear: &[f64]) -> Vec<ModelParameter> {
        vec![ModelParameter {
            name: "tau_sig".into(),
            value: linear[1] / linear[0],
            unit: "s".into(),
        }]
    }
}
