//! The generalised Maxwell body: a spring beside several Maxwell bodies.

use super::family::{Family, OuterParameter, OuterRange};
use super::relaxation::{DepthDrive, RelaxationTerm};
use super::table::FamilyKind;
use std::sync::Arc;

/// Most terms: more than one for each of the thirty-one decades of the longest master curve published
/// with its series.
pub const TERMS_MAX: usize = 40;

/// Most terms a selection tries on a recording: beyond one for each decade that it shows, terms are
/// not identifiable.
pub const TERMS_COMPARED: usize = 6;

/// Words for the second and each later term.
const ADDED: [&str; TERMS_COMPARED - 1] = [
    "a second relaxation time",
    "a third relaxation time",
    "a fourth relaxation time",
    "a fifth relaxation time",
    "a sixth relaxation time",
];

/// `F = k0 x + sum_i k_i m_i`, `m_i + tau_i m_i' = tau_i x'`: relaxation modulus `k0 + sum k_i e^(-t / tau_i)`
/// (Prony series), all `k_i >= 0`.
///
/// Wiechert 1893; Tschoegl, "The Phenomenological Theory of Linear Viscoelastic Behavior", section
/// 3.5. One term is the Kelvin body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Prony {
    terms: usize,
}

impl Prony {
    /// The body with `terms` relaxation times, 1 to [`TERMS_MAX`]; `None` for other numbers.
    #[must_use]
    pub fn of_terms(terms: usize) -> Option<Self> {
        (1..=TERMS_MAX).contains(&terms).then_some(Self { terms })
    }

    /// A series to search with: as many relaxation times as it takes to miss none.
    pub(crate) fn dense(terms: usize) -> Self {
        Self { terms }
    }
}

pub(super) const KIND: FamilyKind = FamilyKind {
    word: "prony",
    of: |number| Some(Arc::new(Prony::of_terms(number?)?)),
    compared: Some(2..=TERMS_COMPARED),
};

impl Family for Prony {
    fn key(&self) -> String {
        format!("prony-{}", self.terms)
    }

    fn name(&self) -> String {
        format!("generalised Maxwell, {} terms", self.terms)
    }

    fn equation(&self) -> &'static str {
        "F = k0 x + sum_i k_i m_i, m_i + tau_i m_i' = tau_i x', k_i >= 0"
    }

    fn cannot_represent(&self) -> &'static str {
        "stiffness that grows with depth; unloading that differs from loading"
    }

    fn adds_to(&self) -> Vec<(String, &'static str)> {
        let simpler = match self.terms {
            0 | 1 => return Vec::new(),
            2 => "kelvin".to_owned(),
            terms => format!("prony-{}", terms - 1),
        };
        let words = ADDED.get(self.terms - 2);
        vec![(simpler, words.unwrap_or(&"another relaxation time"))]
    }

    fn outer(&self) -> Vec<OuterParameter> {
        let time = |i| OuterParameter::new(format!("tau_{i}"), "s", OuterRange::Time);
        (1..=self.terms).map(time).collect()
    }

    fn linear(&self) -> Vec<(String, &'static str)> {
        (0..=self.terms).map(|i| (format!("k_{i}"), "N/mm")).collect()
    }

    fn columns(&self, outer: &[f64]) -> Vec<Vec<RelaxationTerm>> {
        let spring = DepthDrive::power(1, 1.0);
        let relaxing = outer.iter().map(|&tau| RelaxationTerm::maxwell(spring, tau));
        std::iter::once(RelaxationTerm::spring(spring))
            .chain(relaxing)
            .map(|term| vec![term])
            .collect()
    }

    fn is_non_negative(&self, coefficient: usize) -> bool {
        coefficient > 0
    }
}
