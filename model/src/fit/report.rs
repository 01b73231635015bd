//! What a fit found.

use super::design::Columns;
use super::options::{CONTACT, LINEAR, PARAMETER_NAMES, TAU};
use super::problem::{Outer, Problem, linear_units, product, walk};
use super::sample::FitSample;
use crate::units::Newtons;
use crate::viscoelastic::ModifiedKelvin;
use serde::{Deserialize, Serialize};

/// The one model a fit knows, by name.
pub const MODEL_NAME: &str = "modified Kelvin, third order";

/// One parameter of a fitted model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its name, one of [`super::PARAMETER_NAMES`].
    pub name: String,
    /// Its value.
    pub value: f64,
    /// The unit of value, error and interval.
    pub unit: String,
    /// Standard error for independent force noise; `None` where it was fixed or not determined.
    pub std_error: Option<f64>,
    /// 95 % interval from Student's t, under the same assumption.
    pub ci95: Option<[f64; 2]>,
    /// Whether it was kept at a given value.
    pub is_fixed: bool,
}

/// The result of [`super::fit`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FitReport {
    /// The model fitted.
    pub model: String,
    /// All parameters, in the order of [`super::PARAMETER_NAMES`].
    pub parameters: Vec<Parameter>,
    /// Share of the variance of the force that the model explains, unweighted.
    pub r2: f64,
    /// Root mean square of measured minus modelled force in N, unweighted.
    pub rmse_n: f64,
    /// Samples used.
    pub samples: usize,
    /// What a reader of the numbers must know, one sentence each.
    pub warnings: Vec<String>,
    /// What the fit found besides numbers, one sentence each: the memory of the noise, depths at
    /// which the body is unstable or returns energy.
    pub findings: Vec<String>,
}

impl FitReport {
    /// Warnings, then findings: what window, command line and files say in the same words.
    pub fn sentences(&self) -> impl Iterator<Item = &str> {
        self.warnings
            .iter()
            .chain(&self.findings)
            .map(String::as_str)
    }

    /// The value of a parameter, in its unit; `None` for a name that is not one.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<f64> {
        self.parameter(name).map(|parameter| parameter.value)
    }

    /// A parameter by name.
    #[must_use]
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters
            .iter()
            .find(|parameter| parameter.name == name)
    }

    /// The tissue body found, without initial force, offset and contact position.
    #[must_use]
    pub fn body(&self) -> ModifiedKelvin {
        let value = |index: usize| self.parameters[index].value;
        ModifiedKelvin {
            tau_eps: value(TAU),
            mu: [value(LINEAR), value(LINEAR + 1), value(LINEAR + 2)],
            tau_sig: value(LINEAR + 3),
        }
    }

    /// The modelled force in N at each sample, along the depth of the samples; their forces are
    /// not used. NaN where depths or times are not finite or times do not increase.
    #[must_use]
    pub fn predict(&self, samples: &[FitSample]) -> Vec<Newtons> {
        let value = |index: usize| self.parameters[index].value;
        let outer = Outer {
            log_tau: value(TAU).ln(),
            contact: value(CONTACT),
        };
        let scaled = std::array::from_fn(|k| value(LINEAR + k));
        let mut forces = Vec::with_capacity(samples.len());
        let mut before = f64::NEG_INFINITY;
        let mut is_valid = true;
        // Depth scale 1: scaled and physical coefficients are the same.
        walk(samples, 1.0, outer, |sample, columns: &Columns<true>| {
            is_valid &= sample.t.0 > before && sample.depth.is_finite() && sample.t.is_finite();
            before = sample.t.0;
            forces.push(Newtons(if is_valid {
                product(&columns.row(), &scaled)
            } else {
                f64::NAN
            }));
        });
        forces
    }
}

/// Everything a report is made from.
pub(super) struct Findings {
    /// Physical values in the order of [`PARAMETER_NAMES`].
    pub values: [f64; 8],
    pub std_errors: [Option<f64>; 8],
    pub is_fixed: [bool; 8],
    pub degrees_of_freedom: usize,
}

impl Findings {
    pub fn parameters(&self) -> Vec<Parameter> {
        let quantile = student_t975(self.degrees_of_freedom);
        (0..PARAMETER_NAMES.len())
            .map(|index| {
                let value = self.values[index];
                let std_error = self.std_errors[index].filter(|error| error.is_finite());
                Parameter {
                    name: PARAMETER_NAMES[index].to_owned(),
                    value,
                    unit: super::options::PARAMETER_UNITS[index].to_owned(),
                    std_error,
                    ci95: std_error.map(|error| {
                        let half = quantile * error;
                        [value - half, value + half]
                    }),
                    is_fixed: self.is_fixed[index],
                }
            })
            .collect()
    }
}

/// Residuals of the final model in one pass.
pub(super) struct Residuals {
    pub r2: f64,
    pub rmse_n: f64,
    /// Correlation of neighbouring weighted residuals.
    pub lag_one: f64,
}

pub(super) fn residuals(problem: &Problem<'_>, outer: Outer, scaled: &[f64; 6]) -> Residuals {
    let count = problem.samples.len() as f64;
    let mean = problem.samples.iter().map(|s| s.force.0).sum::<f64>() / count;
    let (mut sum, mut total, mut weighted, mut lagged) = (0.0, 0.0, 0.0, 0.0);
    let mut before = 0.0;
    problem.visit(outer, |sample, columns| {
        let residual = sample.force.0 - product(&columns.row(), scaled);
        sum += residual * residual;
        total += (sample.force.0 - mean).powi(2);
        let here = residual * problem.weight(sample);
        weighted += here * here;
        lagged += here * before;
        before = here;
    });
    Residuals {
        r2: if total > 0.0 {
            1.0 - sum / total
        } else {
            f64::NAN
        },
        rmse_n: (sum / count).sqrt(),
        lag_one: if weighted > 0.0 {
            lagged / weighted
        } else {
            0.0
        },
    }
}

/// Scaled coefficients and outer parameters as physical values.
pub(super) fn physical(outer: Outer, scaled: &[f64; 6], depth_scale: f64) -> [f64; 8] {
    let units = linear_units(depth_scale);
    std::array::from_fn(|index| match index {
        TAU => outer.tau(),
        CONTACT => outer.contact * depth_scale,
        _ => scaled[index - LINEAR] / units[index - LINEAR],
    })
}

/// The 97.5 % point of Student's t: exact for 1 and 2 degrees of freedom, else the expansion of
/// Abramowitz & Stegun 26.7.5, good to 1e-2 at 3 and to 1e-4 from 6 on.
fn student_t975(degrees_of_freedom: usize) -> f64 {
    let z: f64 = 1.959_963_984_540_054;
    match degrees_of_freedom {
        0 => f64::NAN,
        1 => 12.706_204_736,
        2 => 4.302_652_730,
        _ => {
            let n = degrees_of_freedom as f64;
            let (z3, z5) = (z.powi(3), z.powi(5));
            let (z7, z9) = (z.powi(7), z.powi(9));
            z + (z3 + z) / (4.0 * n)
                + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * n.powi(2))
                + (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * n.powi(3))
                + (79.0 * z9 + 776.0 * z7 + 1482.0 * z5 - 1920.0 * z3 - 945.0 * z)
                    / (92160.0 * n.powi(4))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn student_quantiles_match_the_table() {
        for (n, exact, allowed) in [
            (3, 3.182_446, 1.5e-2),
            (6, 2.446_912, 1e-3),
            (10, 2.228_139, 1e-4),
            (30, 2.042_272, 1e-6),
            (1000, 1.962_339, 1e-6),
        ] {
            assert!((student_t975(n) - exact).abs() < allowed, "{n}");
        }
    }
}
