//! The Kelvin body, or standard linear solid.

use super::family::{Family, Outer, OuterRange};
use super::model::ModelParameter;
use super::relaxation::{Drive, Relaxation};

/// `F + tau_eps F' = mu1 x + eta x'`, with `eta = mu1 tau_sig`.
///
/// Equation 3.2 of the thesis; Fung, "Biomechanics: Mechanical Properties of Living Tissues", 2nd
/// ed., section 2.11. The same body as a spring beside one spring in series with a dashpot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kelvin;

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

    fn outer(&self) -> Vec<Outer> {
        vec![Outer {
            name: "tau_eps".into(),
            unit: "s",
            range: OuterRange::Time,
        }]
    }

    fn linear(&self) -> Vec<(String, &'static str)> {
        vec![("mu1".into(), "N/mm"), ("eta".into(), "N*s/mm")]
    }

    fn columns(&self, outer: &[f64]) -> Vec<Vec<Relaxation>> {
        let tau = outer[0];
        let elastic = Relaxation {
            tau,
            elastic: Drive::power(1, 1.0),
            rate: Drive::default(),
        };
        let viscous = Relaxation {
            tau,
            elastic: Drive::default(),
            rate: Drive::power(1, 1.0),
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
