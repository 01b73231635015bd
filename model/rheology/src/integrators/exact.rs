//! The exact step for depth that moves straight between samples: `F(+) = F - psi_0 F + w(x, d)`, where
//! `w` is a polynomial in the depth `x` at the start and the move `d`, its coefficients made once from
//! the psi functions of the step.

use super::body::SeriesBody;
use super::real::{CompensatedForce, Real};
use super::{Integrator, IntegratorStart, check_finite};
use crate::families::{POWER_MAX, StepError};
use palpate_model::viscoelastic::{ContactPieces, psi_first};

/// Exact whatever the step; steps across the surface are cut where they cross it.
#[derive(Clone, Copy, Debug)]
pub struct ExactIntegrator<R, const N: usize> {
    body: SeriesBody<N>,
    dt: f64,
    table: Table<R, N>,
    depth: R,
    force: CompensatedForce<R>,
}

/// Coefficients for one step length.
#[derive(Clone, Copy, Debug)]
struct Table<R, const N: usize> {
    psi_0: R,
    /// Coefficients of `d^j x^i`, by `j`, then `i`.
    rows: [[R; POWER_MAX + 1]; POWER_MAX + 1],
}

impl<R: Real, const N: usize> Table<R, N> {
    /// Highest power of `x` and `d` together: that of the elastic part, and two of the viscous one.
    const TOP: usize = if N > 2 { N } else { 2 };

    fn new(body: &SeriesBody<N>, dt: f64) -> Self {
        let psi: [f64; POWER_MAX + 1] = psi_first(dt / body.tau_eps);
        let mut rows = [[0.0; POWER_MAX + 1]; POWER_MAX + 1];
        for (k, mu) in (1..).zip(body.mu) {
            let mut binomial = 1.0;
            for j in 0..=k {
                rows[j][k - j] += mu * binomial * psi[j];
                binomial *= (k - j) as f64 / (j + 1) as f64;
            }
        }
        // tau_sig x x' with x' = d / dt.
        rows[1][1] += body.tau_sig / dt * psi[0];
        rows[2][0] += body.tau_sig / dt * psi[1];
        Self { psi_0: R::of(psi[0]), rows: rows.map(|row| row.map(R::of)) }
    }

    /// Row by row with constant numbers, so that a compiler writes every product out: the same in nested
    /// loops takes three times as long.
    #[inline]
    fn weighted(&self, x: R, d: R) -> R {
        let row = |j| self.row(j, x);
        match Self::TOP {
            2 => row(0) + d * (row(1) + d * row(2)),
            3 => row(0) + d * (row(1) + d * (row(2) + d * row(3))),
            4 => row(0) + d * (row(1) + d * (row(2) + d * (row(3) + d * row(4)))),
            _ => row(0) + d * (row(1) + d * (row(2) + d * (row(3) + d * (row(4) + d * row(5))))),
        }
    }

    #[inline(always)]
    fn row(&self, j: usize, x: R) -> R {
        let row = &self.rows[j];
        let higher = (0..Self::TOP - j).rev();
        higher.fold(row[Self::TOP - j], |value, i| value * x + row[i])
    }
}

/// A step that leaves or meets the surface on its way. All by value: a reference would keep the state
/// of every step in memory.
#[cold]
fn across<R: Real, const N: usize>(
    body: SeriesBody<N>,
    dt: f64,
    mut force: CompensatedForce<R>,
    pieces: [(R, R, f64); 2],
) -> CompensatedForce<R> {
    for (x, d, share) in pieces {
        if share > 0.0 {
            let table: Table<R, N> = Table::new(&body, dt * share);
            force = force.relaxed(table.weighted(x, d), table.psi_0);
        }
    }
    force
}

impl<R: Real, const N: usize> Integrator<R, N> for ExactIntegrator<R, N> {
    fn at_any_step(body: &SeriesBody<N>, dt: f64, start: IntegratorStart<R>) -> Self {
        let settled = super::drive::SeriesDrive::new(body, dt, start.depth).settled();
        Self {
            body: *body,
            dt,
            table: Table::new(body, dt),
            depth: start.depth,
            force: CompensatedForce::new(start.force.unwrap_or(settled)),
        }
    }

    #[inline]
    fn step(&mut self, depth: R) -> Result<R, StepError> {
        let from = self.depth;
        let force = if from >= R::ZERO && depth >= R::ZERO {
            let weighted = self.table.weighted(from, depth - from);
            self.force.relaxed(weighted, self.table.psi_0)
        } else {
            match ContactPieces::of(from.to_f64(), depth.to_f64()) {
                ContactPieces::Entering([outside, inside]) => {
                    let pieces = [(R::ZERO, R::ZERO, outside), (R::ZERO, depth, inside)];
                    across(self.body, self.dt, self.force, pieces)
                }
                ContactPieces::Leaving([inside, outside]) => {
                    let pieces = [(from, -from, inside), (R::ZERO, R::ZERO, outside)];
                    across(self.body, self.dt, self.force, pieces)
                }
                ContactPieces::Outside | ContactPieces::Inside => {
                    self.force.relaxed(R::ZERO, self.table.psi_0)
                }
            }
        };
        self.force = check_finite(force, [from, depth], self.dt)?;
        self.depth = depth;
        Ok(force.value)
    }
}
