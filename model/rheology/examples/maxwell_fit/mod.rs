//! Identification of a Maxwell body: variable projection with one column.
//!
//! Given the relaxation time the stress is `k` times a known response to strain, so the search is
//! one-dimensional and needs no guess: a scan finds the deepest valley of the sum of squares, and
//! the root of its slope in it is bisected to the last digit.

#![allow(dead_code, unused_imports, reason = "the example and its test each take their own part")]

mod body;

pub use body::{Integrator, Maxwell, MaxwellState, MaxwellStep};
use palpate_model::units::Seconds;
use palpate_rheology::fit::FitError;

/// Relaxation times tried by the scan.
const NODES: usize = 96;
/// Longest relaxation time searched, in lengths of the record; the shortest is one interval.
const LENGTHS: f64 = 10.0;
/// Halvings of the bracket; it has shrunk below one rounding of `ln tau` by then.
const HALVINGS: usize = 60;

/// One sample of a strain-controlled test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrainSample {
    /// When, in s on any clock; must increase from sample to sample.
    pub t: Seconds,
    /// Strain, a ratio. The body is taken to be relaxed at the strain of the first sample.
    pub strain: f64,
    /// Measured stress, in any unit; `k` comes out in it.
    pub stress: f64,
}

/// The Maxwell body nearest to a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaxwellFit {
    /// The body, in the unit of the stress.
    pub body: Maxwell,
    /// Standard error of `eta` for independent noise of unknown size.
    pub eta_std_error: f64,
    /// Standard error of `k`, likewise.
    pub k_std_error: f64,
    /// Sum of squared residuals, in the squared unit of the stress.
    pub residual_sum: f64,
    pub samples: usize,
}

/// Identifies `sigma + (eta / k) sigma' = eta eps'` by least squares on the response that
/// `integrator` gives. Exact and backward-difference parameters differ by `r / (1 - e^-r)` with
/// `r = dt / tau`: see [`Integrator`].
pub fn fit_maxwell(
    samples: &[StrainSample],
    integrator: Integrator,
) -> Result<MaxwellFit, FitError> {
    if samples.len() < 3 {
        return Err(FitError::TooFewSamples { samples: samples.len(), parameters: 2 });
    }
    check(samples)?;
    let length = samples[samples.len() - 1].t.0 - samples[0].t.0;
    let (low, high) = ((length / (samples.len() - 1) as f64).ln(), (LENGTHS * length).ln());
    let spacing = (high - low) / (NODES - 1) as f64;
    let at = |node: usize| low + spacing * node as f64;
    let deepest = (0..NODES)
        .map(|node| (node, Products::new(samples, at(node), integrator)))
        // A strain that never moves gives NaN, and no valley.
        .filter(|(_, products)| products.explained().is_finite())
        .max_by(|a, b| a.1.explained().total_cmp(&b.1.explained()));
    let node = match deepest {
        None => {
            return Err(inseparable("the strain never changes; record a ramp or a step"));
        }
        Some((0, _)) => {
            return Err(inseparable(
                "the stress follows the speed of the strain at once and no relaxation is seen; \
                 sample faster or strain faster",
            ));
        }
        Some((node, _)) if node == NODES - 1 => {
            return Err(inseparable(
                "the stress does not relax within the record; record a longer hold",
            ));
        }
        Some((node, _)) => node,
    };
    let (mut short, mut long) = (at(node - 1), at(node + 1));
    for _ in 0..HALVINGS {
        let middle = 0.5 * (short + long);
        if Products::new(samples, middle, integrator).slope() > 0.0 {
            short = middle;
        } else {
            long = middle;
        }
    }
    let log_tau = 0.5 * (short + long);
    Ok(report(samples, log_tau, integrator))
}

fn inseparable(advice: &str) -> FitError {
    FitError::Inseparable {
        names: vec!["eta".to_owned(), "k".to_owned()],
        advice: advice.to_owned(),
    }
}

fn check(samples: &[StrainSample]) -> Result<(), FitError> {
    let mut before = f64::NEG_INFINITY;
    for (index, sample) in samples.iter().enumerate() {
        let named = [("time", sample.t.0), ("strain", sample.strain), ("stress", sample.stress)];
        if let Some((what, value)) = named.into_iter().find(|(_, value)| !value.is_finite()) {
            return Err(FitError::NotFinite { index, what, value });
        }
        if sample.t.0 <= before {
            return Err(FitError::TimeNotIncreasing { index, t: sample.t.0, before });
        }
        before = sample.t.0;
    }
    Ok(())
}

/// Visits every sample with the response to strain and its derivative by `ln tau`.
fn walk(
    samples: &[StrainSample],
    log_tau: f64,
    integrator: Integrator,
    mut visit: impl FnMut(&StrainSample, f64, f64),
) {
    let tau = log_tau.exp();
    let (mut response, mut slope) = (0.0, 0.0);
    visit(&samples[0], response, slope);
    for pair in samples.windows(2) {
        let step = MaxwellStep::new(pair[1].t.0 - pair[0].t.0, tau, integrator);
        let strain = pair[1].strain - pair[0].strain;
        // d(e^-r)/d(ln tau) = r e^-r; d(psi_0 / r)/d(ln tau) = psi_0 / r - e^-r.
        let decay = 1.0 - step.decayed;
        let gain_slope = match integrator {
            Integrator::Exact => step.gain - decay,
            Integrator::BackwardDifference => 0.0,
        };
        slope += gain_slope * strain + step.r * decay * response - step.decayed * slope;
        response += step.gain * strain - step.decayed * response;
        visit(&pair[1], response, slope);
    }
}

/// Scalar products of response, its derivative by `ln tau`, and measured stress.
#[derive(Clone, Copy, Debug, Default)]
struct Products {
    response_response: f64,
    response_slope: f64,
    slope_slope: f64,
    response_stress: f64,
    slope_stress: f64,
}

impl Products {
    fn new(samples: &[StrainSample], log_tau: f64, integrator: Integrator) -> Self {
        let mut sums = Self::default();
        walk(samples, log_tau, integrator, |sample, response, slope| {
            sums.response_response += response * response;
            sums.response_slope += response * slope;
            sums.slope_slope += slope * slope;
            sums.response_stress += response * sample.stress;
            sums.slope_stress += slope * sample.stress;
        });
        sums
    }

    /// The best `k` at this relaxation time.
    fn stiffness(&self) -> f64 {
        self.response_stress / self.response_response
    }

    /// By how much the response lowers the sum of squares.
    fn explained(&self) -> f64 {
        self.response_stress * self.stiffness()
    }

    /// Half the slope of that by `ln tau`, from first-order terms: its root has all digits, where
    /// the top of the sum of squares itself would have half of them.
    fn slope(&self) -> f64 {
        self.stiffness() * (self.slope_stress - self.stiffness() * self.response_slope)
    }
}

fn report(samples: &[StrainSample], log_tau: f64, integrator: Integrator) -> MaxwellFit {
    let products = Products::new(samples, log_tau, integrator);
    let k = products.stiffness();
    let body = Maxwell { eta: k * log_tau.exp(), k };
    let mut residual_sum = 0.0;
    walk(samples, log_tau, integrator, |sample, response, _| {
        residual_sum += (sample.stress - k * response).powi(2);
    });
    // Inverse of the 2 x 2 normal matrix of (ln k, ln tau); ln eta is their sum.
    let [aa, ab, bb] = [products.response_response, products.response_slope, products.slope_slope]
        .map(|product| k * k * product);
    let variance = residual_sum / (samples.len() - 2) as f64 / (aa * bb - ab * ab);
    MaxwellFit {
        body,
        eta_std_error: body.eta.abs() * (variance * (aa + bb - 2.0 * ab)).sqrt(),
        k_std_error: k.abs() * (variance * bb).sqrt(),
        residual_sum,
        samples: samples.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_of_the_response_agrees_with_differences() {
        // Uneven steps and a strain that turns, so that no term is a multiple of another.
        let times = [0.0, 0.3, 0.35, 1.1, 1.2, 2.9, 3.0];
        let samples = times.map(|t: f64| StrainSample {
            t: Seconds(t),
            strain: (2.0 * t).sin(),
            stress: 0.0,
        });
        for integrator in [Integrator::Exact, Integrator::BackwardDifference] {
            let at = |log_tau: f64| {
                let mut rows = Vec::new();
                walk(&samples, log_tau, integrator, |_, response, slope| {
                    rows.push((response, slope));
                });
                rows
            };
            let (centre, h) = (-0.2, 1e-3);
            let [far_below, below, here, above, far_above] =
                [-2.0, -1.0, 0.0, 1.0, 2.0].map(|steps| at(centre + steps * h));
            for i in 0..samples.len() {
                let numerical = (far_below[i].0 - far_above[i].0 + 8.0 * (above[i].0 - below[i].0))
                    / (12.0 * h);
                // h^4 of truncation and a rounding of 1e-16 over h.
                let miss = (here[i].1 - numerical).abs();
                assert!(miss < 1e-11, "{integrator:?}, row {i}: {miss:e}");
            }
        }
    }
}
