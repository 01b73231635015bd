//! Fung's quasi-linear viscoelasticity.

use super::exponential::CURVATURE;
use super::family::{Family, OuterParameter, OuterRange};
use super::model::ModelParameter;
use super::quadrature::gauss_legendre;
use super::relaxation::{DepthDrive, RelaxationTerm};
use super::table::FamilyKind;
use std::sync::Arc;

/// `F = int_0^t G(t - s) dT/ds ds` with the elastic response `T = A (e^(B x) - 1)` and the reduced
/// relaxation function of a box spectrum,
/// `G(t) = [1 + C (E1(t / tau_2) - E1(t / tau_1))] / [1 + C ln(tau_2 / tau_1)]`.
///
/// Fung, "Biomechanics: Mechanical Properties of Living Tissues", 2nd ed., section 7.6. Since
/// `E1(t / tau_2) - E1(t / tau_1) = int e^(-t / tau) d ln tau` between the two, the force is the
/// spring's plus an integral of Maxwell bodies over `ln tau`, taken by Gauss-Legendre quadrature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct QuasiLinear {
    nodes: usize,
}

/// Nodes of the quadrature unless asked otherwise: the exponential integrals to 1e-4 of the spectrum's
/// width over six decades of relaxation times, to 1e-7 over four.
const NODES: usize = 24;

/// Nodes that suffice to find the valley: one for each decade of the widest spectrum.
const COARSE_NODES: usize = 6;

pub(super) const KIND: FamilyKind = FamilyKind {
    word: "fung",
    of: |number| {
        let nodes = number.unwrap_or(NODES);
        (1..=64).contains(&nodes).then(|| Arc::new(QuasiLinear { nodes }) as _)
    },
    compared: None,
};

impl Family for QuasiLinear {
    fn key(&self) -> String {
        match self.nodes {
            NODES => "fung".into(),
            nodes => format!("fung-{nodes}"),
        }
    }

    fn name(&self) -> String {
        "Fung quasi-linear".into()
    }

    fn equation(&self) -> &'static str {
        "F = G * T', T = A (e^(B x) - 1), G = [1 + C (E1(t/tau_2) - E1(t/tau_1))] / [1 + C ln(tau_2/tau_1)]"
    }

    fn cannot_represent(&self) -> &'static str {
        "relaxation whose shape depends on depth; stiffness that does not grow in proportion to force; unloading that differs from loading"
    }

    fn adds_to(&self) -> Vec<(String, &'static str)> {
        vec![
            ("exponential".into(), "a continuous spectrum of relaxation times"),
            ("fractional".into(), "stiffness that grows with force"),
        ]
    }

    fn outer(&self) -> Vec<OuterParameter> {
        vec![
            OuterParameter::new("tau_1", "s", OuterRange::Time),
            OuterParameter::new("tau_2/tau_1", "", OuterRange::Ratio(3.0, 1e6)),
            OuterParameter::new("B", "1/mm", CURVATURE),
        ]
    }

    fn linear(&self) -> Vec<(String, &'static str)> {
        vec![("A_inf".into(), "N"), ("A_inf_C".into(), "N")]
    }

    fn columns(&self, outer: &[f64]) -> Vec<Vec<RelaxationTerm>> {
        let (tau_1, width) = (outer[0], outer[1].ln());
        let spring = DepthDrive::exponential(1.0, outer[2]);
        let (nodes, weights) = gauss_legendre(self.nodes);
        let spectrum = nodes.iter().zip(&weights).map(|(node, weight)| {
            let tau = tau_1 * (0.5 * (node + 1.0) * width).exp();
            RelaxationTerm::maxwell(spring, tau).scaled(0.5 * weight * width)
        });
        vec![vec![RelaxationTerm::spring(spring)], spectrum.collect()]
    }

    fn coarse(&self) -> Option<Arc<dyn Family>> {
        let nodes = COARSE_NODES;
        (self.nodes > nodes).then(|| Arc::new(Self { nodes }) as _)
    }

    fn is_non_negative(&self, _coefficient: usize) -> bool {
        true
    }

    fn derived(&self, outer: &[f64], linear: &[f64]) -> Vec<ModelParameter> {
        vec![
            ModelParameter::new("A", linear[0] + linear[1] * outer[1].ln(), "N"),
            ModelParameter::new("C", linear[1] / linear[0], ""),
            ModelParameter::new("tau_2", outer[0] * outer[1], "s"),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integral of `e^(-t / tau)` over `ln tau`, from the columns.
    fn spectrum(nodes: usize, ratio: f64, t: f64) -> f64 {
        let family = QuasiLinear { nodes };
        let columns = family.columns(&[1.0, ratio, 1.0]);
        let shares = columns[1].iter().map(|term| {
            let (amplitude, _) = term.rate.exponential.unwrap();
            amplitude / term.tau * (-t / term.tau).exp()
        });
        shares.sum()
    }

    #[test]
    fn nodes_suffice_for_the_decades_searched() {
        // 64 nodes stand for the integral: they and 60 agree to 1e-12 over six decades.
        for (ratio, tolerance) in [(1e2, 1e-12), (1e4, 1e-7), (1e6, 1e-4)] {
            for i in 0..200 {
                let t = 1e-2 * 10f64.powf(0.05 * f64::from(i));
                let exact = spectrum(64, ratio, t);
                assert!((exact - spectrum(60, ratio, t)).abs() < 1e-11);
                let miss = (spectrum(NODES, ratio, t) - exact).abs();
                assert!(miss < tolerance * ratio.ln(), "{ratio:e} {t:e}: {miss:e}");
            }
        }
    }
}
