//! What a fit found.

use super::design::walk;
use super::noise::Memory;
use super::options::{CONTACT, LINEAR, PARAMETER_NAMES, PARAMETER_UNITS, TAU};
use super::record::Record;
use super::sample::FitSample;
use super::solve::Fitted;
use super::system::Point;
use super::uncertainty::{Error, Uncertainty};
use super::{design::Scale, design::powers_from_legendre, sentences};
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
    /// Standard error, the memory of the residuals allowed for; `None` where it was fixed or not
    /// determined.
    pub std_error: Option<f64>,
    /// 95 % interval from Student's t.
    pub ci95: Option<[f64; 2]>,
    /// Whether it was kept at a given value.
    pub is_fixed: bool,
    /// Standard uncertainty that the calibration adds, the same in every repeat; `None` where it is not
    /// known or not asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub systematic_error: Option<f64>,
}

/// What the residuals remember.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseFound {
    /// Share of the residual variance that lasts longer than a sample, 0..=1.
    pub slow_share: f64,
    /// Time in s within which the lasting part forgets all but 1/e; `None` without memory.
    pub correlation_time_s: Option<f64>,
    /// How many independent samples would tell as much.
    pub effective_samples: f64,
}

/// The result of [`super::fit()`].
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
    /// Samples whose force was left out, being censored.
    pub censored: usize,
    /// What the residuals remember; `None` where the record is too short to tell.
    pub noise: Option<NoiseFound>,
    /// What a reader of the numbers must know, one sentence each.
    pub warnings: Vec<String>,
    /// What the fit found besides numbers, one sentence each: the memory of the noise, depths at
    /// which the body is unstable or returns energy.
    pub findings: Vec<String>,
}

/// The result of [`super::fit_joint`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointReport {
    /// The parameters that are the same in all records.
    pub shared: Vec<String>,
    /// One report for each record, in the order given.
    pub records: Vec<NamedReport>,
}

/// One record's part of a joint fit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NamedReport {
    /// The record.
    pub record: String,
    /// Its parameters, shared ones included.
    pub report: FitReport,
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
        // Depth scale 1: scaled and physical coefficients are the same.
        let scale = Scale {
            depth_mm: 1.0,
            contact: value(CONTACT),
        };
        let scaled = std::array::from_fn(|k| value(LINEAR + k));
        let mut forces = Vec::with_capacity(samples.len());
        let mut before = f64::NEG_INFINITY;
        let mut is_valid = true;
        walk::<false>(samples, scale, value(TAU), |block, rows| {
            let force = rows.force(&scaled);
            for (sample, force) in block.iter().zip(force) {
                is_valid &= sample.t.0 > before && sample.depth.is_finite() && sample.t.is_finite();
                before = sample.t.0;
                forces.push(Newtons(if is_valid { force } else { f64::NAN }));
            }
        });
        forces
    }
}

impl Fitted<'_> {
    /// The report of a fit of one record; of several, that of the first.
    #[must_use]
    pub fn report(&self) -> FitReport {
        self.record_report(&Uncertainty::of(&self.system, &self.refined), 0)
    }

    /// The reports of all records.
    #[must_use]
    pub fn joint_report(&self) -> JointReport {
        let uncertainty = Uncertainty::of(&self.system, &self.refined);
        JointReport {
            shared: (0..PARAMETER_NAMES.len())
                .filter(|&k| self.system.is_shared(k))
                .map(|k| PARAMETER_NAMES[k].to_owned())
                .collect(),
            records: (0..self.system.records.len())
                .map(|record| NamedReport {
                    record: self.system.records[record].name.to_owned(),
                    report: self.record_report(&uncertainty, record),
                })
                .collect(),
        }
    }

    fn record_report(&self, uncertainty: &Uncertainty, record: usize) -> FitReport {
        let samples = self.system.records[record].samples;
        let measured = self.system.records[record].measured;
        let point = &self.refined.points[record];
        let residuals = self.residuals(record);
        let errors = self.errors(uncertainty, record);
        let parameters = parameters(&self.system.physical(point), &errors, |k| {
            self.system.fixed(k).is_some()
        });
        let noise = uncertainty.memory(record).map(|memory| {
            let length = samples[samples.len() - 1].t.0 - samples[0].t.0;
            let interval = length / (samples.len() - 1) as f64;
            let block = uncertainty.block_length(record);
            noise_found(
                &memory,
                uncertainty.variance(record),
                interval,
                block,
                measured,
            )
        });
        let mut report = FitReport {
            model: MODEL_NAME.to_owned(),
            parameters,
            r2: residuals.r2,
            rmse_n: residuals.rmse_n,
            samples: measured,
            censored: samples.len() - measured,
            noise,
            warnings: Vec::new(),
            findings: Vec::new(),
        };
        report.warnings = sentences::warnings(self, record, &report);
        report.findings = sentences::findings(self, record, &report);
        report
    }

    /// Unweighted residuals of the final model: in one pass, unless all weights are one and the sum
    /// is known already.
    fn residuals(&self, record: usize) -> Residuals {
        let Record { samples, .. } = &self.system.records[record];
        let point = &self.refined.points[record];
        let scaled = scaled_powers(point);
        let measured = || samples.iter().filter(|sample| sample.is_measured());
        let count = self.system.records[record].measured as f64;
        let mean = measured().map(|sample| sample.force.0).sum::<f64>() / count;
        let total: f64 = measured()
            .map(|sample| (sample.force.0 - mean).powi(2))
            .sum();
        let is_even = measured().all(|sample| self.system.weight(sample) == 1.0);
        if is_even && self.system.records.len() == 1 && self.refined.is_converged {
            return Residuals::of(self.refined.sum, total, count);
        }
        let mut sum = 0.0;
        let scale = self.system.scale(point.outer);
        walk::<false>(samples, scale, point.outer.tau, |block, rows| {
            let model = rows.force(&scaled);
            for (sample, model) in block.iter().zip(model) {
                if sample.is_measured() {
                    sum += (sample.force.0 - model).powi(2);
                }
            }
        });
        Residuals::of(sum, total, count)
    }
}

struct Residuals {
    r2: f64,
    rmse_n: f64,
}

impl Residuals {
    fn of(sum: f64, total: f64, count: f64) -> Self {
        Self {
            r2: if total > 0.0 {
                1.0 - sum / total
            } else {
                f64::NAN
            },
            rmse_n: (sum / count).sqrt(),
        }
    }
}

/// Coefficients of the bare powers of scaled depth.
pub(super) fn scaled_powers(point: &Point) -> [f64; 6] {
    let [p1, p2, p3] = powers_from_legendre(&point.at);
    [p1, p2, p3, point.at[3], point.at[4], point.at[5]]
}

/// Values with their errors and intervals.
pub(super) fn parameters(
    values: &[f64; 8],
    errors: &[Option<Error>; 8],
    is_fixed: impl Fn(usize) -> bool,
) -> Vec<Parameter> {
    (0..PARAMETER_NAMES.len())
        .map(|index| {
            let value = values[index];
            Parameter {
                name: PARAMETER_NAMES[index].to_owned(),
                value,
                unit: PARAMETER_UNITS[index].to_owned(),
                std_error: errors[index].map(|error| error.std_error),
                ci95: errors[index].map(|error| {
                    let half = student_t975(error.freedom) * error.std_error;
                    // No relaxation time is negative.
                    let lowest = if index == TAU { 0.0 } else { f64::NEG_INFINITY };
                    [(value - half).max(lowest), value + half]
                }),
                is_fixed: is_fixed(index),
                systematic_error: None,
            }
        })
        .collect()
}

/// Memory in blocks as time and shares. The lasting part of variance `A` forgets as
/// `exp(-t / theta)`; neighbouring sums of `m` samples then have the covariance
/// `A m^2 ((1 - e^-r) / r)^2`, `r` being the length of a block over theta.
fn noise_found(
    memory: &Memory,
    white: f64,
    interval: f64,
    block: f64,
    samples: usize,
) -> NoiseFound {
    let effective_samples = (samples as f64 * white / memory.long_run()).clamp(1.0, samples as f64);
    if memory.neighbour <= 0.0 || white <= 0.0 {
        return NoiseFound {
            slow_share: 0.0,
            correlation_time_s: None,
            effective_samples: samples as f64,
        };
    }
    let r = -memory.forgetting.ln();
    let lost = -(-r).exp_m1();
    let slow = memory.level * memory.neighbour * (r / lost).powi(2) / block;
    NoiseFound {
        slow_share: (slow / white).min(1.0),
        correlation_time_s: Some(block * interval / r),
        effective_samples,
    }
}

/// The 97.5 % point of Student's t: exact for 1 and 2 degrees of freedom, else the expansion of
/// Abramowitz & Stegun 26.7.5, good to 1e-2 at 3 and to 1e-4 from 6 on.
pub(super) fn student_t975(degrees_of_freedom: f64) -> f64 {
    let z: f64 = 1.959_963_984_540_054;
    match degrees_of_freedom.floor() {
        ..1.0 => f64::NAN,
        ..2.0 => 12.706_204_736,
        ..3.0 => 4.302_652_730,
        _ => {
            let n = degrees_of_freedom;
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
            (3.0, 3.182_446, 1.5e-2),
            (6.0, 2.446_912, 1e-3),
            (10.0, 2.228_139, 1e-4),
            (30.0, 2.042_272, 1e-6),
            (1000.0, 1.962_339, 1e-6),
        ] {
            assert!((student_t975(n) - exact).abs() < allowed, "{n}");
        }
    }
}
