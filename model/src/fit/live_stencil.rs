//! Refinement of the live fit between its relaxation times: polynomials in log tau.

use super::live::{COLUMNS, NODES};

/// Nodes a polynomial passes through: degree five.
const STENCIL: usize = 6;

/// One node's linear solution: mu1, mu2, mu3, tau_sig, f0, f_offset in their units, their
/// variances per unit of residual variance, and the residual sum.
#[derive(Clone, Copy)]
pub(super) struct Solution {
    pub values: [f64; COLUMNS],
    pub variances: [f64; COLUMNS],
    pub residual: f64,
}

/// Six neighbouring solutions and the polynomials through them, in units of the node spacing.
pub(super) struct Stencil {
    pub first: usize,
    solutions: [Solution; STENCIL],
}

impl Stencil {
    pub fn around(best: usize, solutions: &[Option<Solution>]) -> Option<Self> {
        let ideal = best.saturating_sub(STENCIL / 2 - 1).min(NODES - STENCIL);
        // Next to nodes that cannot be solved the stencil leans the other way.
        let starts = (0..=NODES - STENCIL).filter(|first| {
            (first + 1..first + STENCIL - 1).contains(&best)
                && solutions[*first..first + STENCIL]
                    .iter()
                    .all(Option::is_some)
        });
        let first = starts.min_by_key(|first| first.abs_diff(ideal))?;
        let mut chosen = solutions[first..first + STENCIL].iter().flatten();
        let head = *chosen.next()?;
        let mut stencil = Self {
            first,
            solutions: [head; STENCIL],
        };
        for (slot, solution) in stencil.solutions[1..].iter_mut().zip(chosen) {
            *slot = *solution;
        }
        Some(stencil)
    }

    /// Value at `offset` nodes from the first of the polynomial through the six (Lagrange).
    pub fn at(&self, offset: f64, of: impl Fn(&Solution) -> f64) -> f64 {
        (0..STENCIL)
            .map(|i| {
                let weight: f64 = (0..STENCIL)
                    .filter(|&j| j != i)
                    .map(|j| (offset - j as f64) / (i as f64 - j as f64))
                    .product();
                weight * of(&self.solutions[i])
            })
            .sum()
    }

    /// Where the residual sum is smallest, and its second derivative there.
    pub fn minimum(&self) -> Option<(f64, f64)> {
        let residual = |offset: f64| self.at(offset, |solution| solution.residual);
        let best = (0..STENCIL).min_by(|&a, &b| {
            self.solutions[a]
                .residual
                .total_cmp(&self.solutions[b].residual)
        })?;
        let (mut low, mut high) = (best as f64 - 1.0, best as f64 + 1.0);
        // Golden section: forty steps shrink two spacings to 1e-8.
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        for _ in 0..40 {
            let (left, right) = (high - golden * (high - low), low + golden * (high - low));
            if residual(left) < residual(right) {
                high = right
            } else {
                low = left
            }
        }
        let offset = 0.5 * (low + high);
        let h = 0.05;
        let curvature =
            (residual(offset - h) - 2.0 * residual(offset) + residual(offset + h)) / (h * h);
        (curvature > 0.0).then_some((offset, curvature))
    }
}
