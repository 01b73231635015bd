//! The varpro crate on the same model: an independent solver (Levenberg-Marquardt over an SVD), fed
//! with columns computed here without palpate's recursions.

use crate::result::{Fit, median, seconds};
use nalgebra::{DMatrix, DVector};
use palpate_rheology::fit::FitSample;
use palpate_model::viscoelastic::{psi, psi_derivative};
use std::convert::Infallible;
use varpro::prelude::SeparableNonlinearModel;
use varpro::problem::SeparableProblemBuilder;
use varpro::solvers::levmar::LevMarSolver;
use varpro::statistics::FitStatistics;

/// Depth counts in its greatest value, 30 mm, so that the columns are of one size.
const DEPTH_MM: f64 = 30.0;

/// Columns of the modified Kelvin body and their derivatives by ln tau, cached for one tau. The solver
/// sees ln tau: it knows no bounds, and with a negative tau its decomposition never ends.
struct Kelvin {
    t: Vec<f64>,
    depth: Vec<f64>,
    tau: f64,
    columns: DMatrix<f64>,
    slopes: DMatrix<f64>,
}

impl Kelvin {
    fn new(samples: &[FitSample], tau: f64) -> Self {
        let mut model = Self {
            t: samples.iter().map(|sample| sample.t.0).collect(),
            depth: samples.iter().map(|s| s.depth.0 / DEPTH_MM).collect(),
            tau,
            columns: DMatrix::zeros(0, 0),
            slopes: DMatrix::zeros(0, 0),
        };
        model.evaluate();
        model
    }

    /// Filtered powers 1..3, viscous drive, decay of the initial force, offset.
    fn evaluate(&mut self) {
        let rows = self.t.len();
        let (mut columns, mut slopes) = (DMatrix::zeros(rows, 6), DMatrix::zeros(rows, 6));
        let (mut state, mut slope) = ([0.0; 4], [0.0; 4]);
        let mut weights = Weights::new(f64::NAN, self.tau);
        for row in 0..rows {
            if row > 0 {
                let dt = self.t[row] - self.t[row - 1];
                if dt != weights.dt {
                    weights = Weights::new(dt, self.tau);
                }
                let (x0, d) = (self.depth[row - 1], self.depth[row] - self.depth[row - 1]);
                let forcing = powers(x0, d, &weights.psi);
                let by_r = powers(x0, d, &weights.psi_by_r);
                let kept = 1.0 - weights.psi[0];
                // d r / d ln tau.
                let r_by_log_tau = -dt / self.tau;
                for k in 0..4 {
                    let (forcing, by_r) = match k {
                        3 => (forcing[0] * d / dt, by_r[0] * d / dt),
                        _ => (forcing[k], by_r[k]),
                    };
                    slope[k] += r_by_log_tau * (by_r - kept * state[k]) - weights.psi[0] * slope[k];
                    state[k] += forcing - weights.psi[0] * state[k];
                }
            }
            let since = self.t[row] - self.t[0];
            let decay = (-since / self.tau).exp();
            for k in 0..4 {
                columns[(row, k)] = state[k];
                slopes[(row, k)] = slope[k];
            }
            columns[(row, 4)] = decay;
            slopes[(row, 4)] = decay * since / self.tau;
            columns[(row, 5)] = 1.0;
        }
        (self.columns, self.slopes) = (columns, slopes);
    }
}

struct Weights {
    dt: f64,
    psi: [f64; 4],
    psi_by_r: [f64; 4],
}

impl Weights {
    fn new(dt: f64, tau: f64) -> Self {
        let r = dt / tau;
        Self {
            dt,
            psi: std::array::from_fn(|j| psi(j as u32, r)),
            psi_by_r: std::array::from_fn(|j| psi_derivative(j as u32, r)),
        }
    }
}

/// `sum_j C(k,j) x0^(k-j) d^j psi_j` for k = 1..3.
fn powers(x0: f64, d: f64, psi: &[f64; 4]) -> [f64; 3] {
    const BINOMIAL: [[f64; 4]; 3] = [
        [1.0, 1.0, 0.0, 0.0],
        [1.0, 2.0, 1.0, 0.0],
        [1.0, 3.0, 3.0, 1.0],
    ];
    std::array::from_fn(|i| {
        let k = i + 1;
        (0..=k)
            .map(|j| BINOMIAL[i][j] * x0.powi((k - j) as i32) * d.powi(j as i32) * psi[j])
            .sum()
    })
}

impl SeparableNonlinearModel for Kelvin {
    type ScalarType = f64;
    type Error = Infallible;

    fn parameter_count(&self) -> usize {
        1
    }

    fn base_function_count(&self) -> usize {
        6
    }

    fn output_len(&self) -> usize {
        self.t.len()
    }

    fn set_params(&mut self, parameters: DVector<f64>) -> Result<(), Infallible> {
        self.tau = parameters[0].exp();
        self.evaluate();
        Ok(())
    }

    fn params(&self) -> DVector<f64> {
        DVector::from_element(1, self.tau.ln())
    }

    fn eval(&self) -> Result<DMatrix<f64>, Infallible> {
        Ok(self.columns.clone())
    }

    fn eval_partial_deriv(&self, _index: usize) -> Result<DMatrix<f64>, Infallible> {
        Ok(self.slopes.clone())
    }
}

/// A fit with covariance from `tau_start`, the median of `repeats`.
pub fn fit(samples: &[FitSample], tau_start: f64, repeats: usize) -> Result<Fit, String> {
    let forces = DVector::from_iterator(samples.len(), samples.iter().map(|s| s.force.0));
    let mut times = Vec::new();
    let mut found = Err("no repeats".to_owned());
    for _ in 0..repeats {
        let (time, result) = seconds(|| once(samples, &forces, tau_start));
        times.push(time);
        found = result;
    }
    found.map(|(values, std_errors)| Fit {
        seconds: median(&mut times),
        values,
        std_errors: Some(std_errors),
    })
}

fn once(
    samples: &[FitSample],
    forces: &DVector<f64>,
    tau_start: f64,
) -> Result<([f64; 5], [f64; 5]), String> {
    let problem = SeparableProblemBuilder::new(Kelvin::new(samples, tau_start))
        .observations(forces.clone())
        .build()
        .map_err(|err| err.to_string())?;
    let result = LevMarSolver::default()
        .solve(problem)
        .map_err(|_| "the solver did not converge".to_owned())?;
    let statistics = FitStatistics::try_from(&result).map_err(|err| err.to_string())?;
    let linear = result.linear_coefficients().ok_or("no coefficients")?;
    let linear_variance = statistics.linear_coefficients_variance();
    let log_tau_variance = statistics.nonlinear_parameters_variance()[0];
    let units = [1, 2, 3, 2].map(|power| DEPTH_MM.powi(power));
    let in_mm = |k: usize| linear[k] / units[k];
    let deviation = |k: usize| linear_variance[k].sqrt() / units[k];
    let tau = result.nonlinear_parameters()[0].exp();
    Ok((
        [tau, in_mm(0), in_mm(1), in_mm(2), in_mm(3)],
        [
            tau * log_tau_variance.sqrt(),
            deviation(0),
            deviation(1),
            deviation(2),
            deviation(3),
        ],
    ))
}
