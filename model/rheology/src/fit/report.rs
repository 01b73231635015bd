//! The report of a fit.

use super::columns::{ColumnSource, OuterPoint, ParameterPoint};
use super::design::Scale;
use super::options::Layout;
use super::sample::FitSample;
use super::sentences;
use super::solve::FitSolution;
use super::uncertainty::UncertaintyEstimate;
use crate::distinct;
use crate::families::{Model, ModelParameter, OuterRange, find_family};
use palpate_model::autocorrelation::Memory;
use palpate_model::estimate::student_t975;
use palpate_model::units::Newtons;
use palpate_model::viscoelastic::ModifiedKelvin;
use serde::{Deserialize, Serialize};

pub use palpate_model::estimate::{BudgetEntry, FittedParameter};

/// Autocorrelation of the residuals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseEstimate {
    /// Share of the residual variance that lasts longer than a sample, 0..=1.
    pub slow_share: f64,
    /// Time in s in which the autocorrelation of the lasting part falls to 1/e; `None` for white noise.
    pub correlation_time_s: Option<f64>,
    /// Number of independent samples that carry the same information.
    pub effective_samples: f64,
}

/// The result of [`super::fit()`].
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FitReport {
    pub model: String,
    /// The family by its key, with the values of the body's parameters.
    #[serde(flatten)]
    pub body: Model,
    /// All parameters, in the order of [`FitOptions::names`](super::FitOptions::names), then what the family derives
    /// from them.
    pub parameters: Vec<FittedParameter>,
    /// Share of the variance of the force that the model explains, unweighted.
    pub r2: f64,
    /// Root mean square of measured minus modelled force in N, unweighted.
    pub rmse_n: f64,
    pub samples: usize,
    /// Samples whose force was left out, being censored.
    pub censored: usize,
    /// Numbers found, of all records that were fitted together.
    pub free: usize,
    /// Whether the body is relaxed at the first depth but for the initial force, and not at zero force.
    #[serde(skip)]
    pub is_at_rest: bool,
    /// Autocorrelation of the residuals; `None` where the record is too short to show any.
    pub noise: Option<NoiseEstimate>,
    /// Warnings without which the numbers would be misread, one sentence each.
    pub warnings: Vec<String>,
    /// Findings that are not numbers, one sentence each: autocorrelation of the noise, depths at
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
    /// Samples whose force counts, in all records.
    pub samples: usize,
    pub free: usize,
    /// Sum of squared residuals of all records, each over its sigma.
    pub weighted_square: f64,
    /// Root mean square residual of all records in N, unweighted.
    pub rmse_n: f64,
    /// Number of independent samples that carry the same information.
    pub effective_samples: f64,
}

/// One record's part of a joint fit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NamedReport {
    pub record: String,
    /// Its parameters, shared ones included.
    pub report: FitReport,
}

impl JointReport {
    /// The warnings of all records, each once.
    pub fn warnings(&self) -> Vec<String> {
        distinct(self.records.iter().flat_map(|one| one.report.warnings.clone()))
    }
}

impl FitReport {
    /// Warnings, then findings: what window, command line and files say in the same words.
    pub fn sentences(&self) -> impl Iterator<Item = &str> {
        self.warnings.iter().chain(&self.findings).map(String::as_str)
    }

    /// The warning that the model does not describe the record to within its noise; `None` where it does.
    pub fn lack_of_fit(&self) -> Option<&str> {
        let is_one = |one: &&String| one.starts_with(sentences::LACK_OF_FIT);
        self.warnings.iter().find(is_one).map(String::as_str)
    }

    /// The value of a parameter, in its unit; `None` for a name that is not one.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.parameter(name).map(|parameter| parameter.value)
    }

    pub fn parameter(&self, name: &str) -> Option<&FittedParameter> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }

    /// The body found, where it is a modified Kelvin body of third order or less.
    pub fn kelvin(&self) -> Option<ModifiedKelvin> {
        let order: usize = self.body.family.strip_prefix("series-")?.parse().ok()?;
        let (mu, tau_sig) = self.body.linear.split_at(order.min(self.body.linear.len()));
        (order <= 3).then(|| ModifiedKelvin {
            tau_eps: self.body.outer[0],
            mu: std::array::from_fn(|k| mu.get(k).copied().unwrap_or(0.0)),
            tau_sig: tau_sig.first().copied().unwrap_or(f64::NAN),
        })
    }

    /// The same with other values of some parameters, in their units, such as contact in mm; names that it lacks change nothing.
    #[must_use]
    pub fn with_values<'n>(mut self, values: impl IntoIterator<Item = (&'n str, f64)>) -> Self {
        for (name, value) in values {
            if let Some(place) = self.parameters.iter().position(|one| one.name == name) {
                self.parameters[place].value = value;
                // The nonlinear ones come first.
                if let Some(outer) = self.body.outer.get_mut(place) {
                    *outer = value;
                }
            }
        }
        self
    }

    /// The modelled force in N at each sample, along the depth of the samples; their forces are
    /// not used. NaN from where depths or times are not finite or times do not increase.
    pub fn predict(&self, samples: &[FitSample]) -> Vec<Newtons> {
        let mut before = f64::NEG_INFINITY;
        let is_valid = |sample: &&FitSample| {
            let is_valid = sample.t.0 > before && sample.depth.is_finite() && sample.t.is_finite();
            before = sample.t.0;
            is_valid
        };
        let valid = samples.iter().take_while(is_valid).count();
        let mut forces = self.forces(&samples[..valid]).unwrap_or_default();
        forces.resize(samples.len(), f64::NAN);
        forces.into_iter().map(Newtons).collect()
    }

    /// The largest residual of the samples that were fitted, in size.
    pub fn worst(&self, samples: &[FitSample]) -> Newtons {
        let pairs = samples.iter().zip(self.predict(samples));
        let known = pairs.filter(|(sample, _)| sample.is_measured());
        let sizes = known.map(|(sample, force)| (sample.force.0 - force.0).abs());
        Newtons(sizes.fold(0.0, f64::max))
    }

    fn forces(&self, samples: &[FitSample]) -> Option<Vec<f64>> {
        let family = find_family(&self.body.family).ok()?;
        let layout = Layout::of(&*family);
        let value = |k: usize| self.parameters[k].value;
        let source = ColumnSource::new(family, self.is_at_rest);
        // Depth scale 1: scaled and physical coefficients are the same.
        let scale = Scale { depth_mm: 1.0, contact: value(layout.contact()) };
        let bare: Vec<f64> = layout.linear().map(value).collect();
        let point = ParameterPoint {
            outer: OuterPoint { values: self.body.outer.clone(), contact: scale.contact },
            at: source.to_basis(&bare),
        };
        source.forces(samples, scale, &point)
    }
}

impl FitSolution<'_> {
    /// The report of a fit of one record; of several, that of the first.
    pub fn report(&self) -> FitReport {
        self.record_report(0)
    }

    /// The reports of all records.
    pub fn joint_report(&self) -> JointReport {
        let uncertainty = self.uncertainty();
        let system = &self.system;
        let known = system.known().iter().enumerate();
        let shared = known.filter(|(k, _)| system.shared[*k]);
        let records = (0..system.records.len()).map(|record| NamedReport {
            record: system.records[record].name.to_owned(),
            report: self.record_report(record),
        });
        let records: Vec<NamedReport> = records.collect();
        let squares = records.iter().map(|one| &one.report);
        let squares = squares.map(|one| one.rmse_n.powi(2) * one.samples as f64);
        let each = system.records.iter().enumerate();
        let effective = each.map(|(k, record)| uncertainty.effective_samples(k, record.measured));
        JointReport {
            shared: shared.map(|(_, one)| one.name.clone()).collect(),
            samples: system.measured(),
            free: system.unknowns.len(),
            weighted_square: self.refined.sum / system.sigma_scale.powi(2),
            rmse_n: (squares.sum::<f64>() / system.measured() as f64).sqrt(),
            effective_samples: effective.sum::<f64>().max(1.0),
            records,
        }
    }

    /// Values of all records' parameters and of what is derived from them, one record behind the other.
    pub(super) fn values(&self) -> Vec<f64> {
        let each = self.refined.points.iter().enumerate();
        let values = each.flat_map(|(record, point)| {
            let own = self.system.physical_values(record, point);
            let derived = self.derived(&own).into_iter().map(|one| one.value);
            own.into_iter().chain(derived).collect::<Vec<_>>()
        });
        values.collect()
    }

    /// Names of these of one record.
    pub(super) fn value_names(&self) -> Vec<String> {
        let own = self.system.known().iter().map(|one| one.name.clone());
        let values = self.system.physical_values(0, &self.refined.points[0]);
        let derived = self.derived(&values).into_iter().map(|one| one.name);
        own.chain(derived).collect()
    }

    fn derived(&self, values: &[f64]) -> Vec<ModelParameter> {
        let layout = self.system.layout();
        let (outer, linear) = values.split_at(layout.outers);
        let family = &self.system.source.family;
        family.derived(outer, &linear[..layout.coefficients])
    }

    fn record_report(&self, record: usize) -> FitReport {
        let (system, uncertainty) = (&self.system, self.uncertainty());
        let samples = system.records[record].samples;
        let measured = system.records[record].measured;
        let (r2, rmse_n) = self.residuals(record);
        let parameters = self.parameters(record);
        let noise = uncertainty.memory(record).map(|memory| {
            let length = samples[samples.len() - 1].t.0 - samples[0].t.0;
            let interval = length / (samples.len() - 1) as f64;
            let block = uncertainty.block_length(record);
            estimate_noise(&memory, uncertainty.variance(record), interval, block, measured)
        });
        let layout = system.layout();
        let values = |range: std::ops::Range<usize>| {
            let values = parameters[range].iter();
            values.map(|one| one.value).collect()
        };
        let mut report = FitReport {
            model: system.source.family.name(),
            body: Model {
                family: system.source.family.key(),
                outer: values(0..layout.outers),
                linear: values(layout.outers..layout.outers + layout.coefficients),
            },
            parameters,
            r2,
            rmse_n,
            samples: measured,
            censored: samples.len() - measured,
            free: system.unknowns.len(),
            is_at_rest: !system.source.is_fast(),
            noise,
            warnings: Vec::new(),
            findings: Vec::new(),
        };
        report.warnings = sentences::warnings(self, record, &report);
        report.findings = sentences::findings(self, record, &report);
        report
    }

    /// Share of the variance explained and rms of the unweighted residuals: in one pass, unless all weights are one and the sum
    /// is known already.
    fn residuals(&self, record: usize) -> (f64, f64) {
        let system = &self.system;
        let (samples, point) = (system.records[record].samples, &self.refined.points[record]);
        let measured = || samples.iter().filter(|sample| sample.is_measured());
        let count = system.records[record].measured as f64;
        let mean = measured().map(|sample| sample.force.0).sum::<f64>() / count;
        let total: f64 = measured().map(|sample| (sample.force.0 - mean).powi(2)).sum();
        let is_even = measured().all(|sample| system.weight(sample) == 1.0);
        if is_even && system.records.len() == 1 && self.refined.is_converged {
            return residual_statistics(self.refined.sum, total, count);
        }
        let forces = system.source.forces(samples, system.scale(&point.outer), point);
        let pairs = samples.iter().zip(forces.unwrap_or_default());
        let squares = pairs
            .filter(|(sample, _)| sample.is_measured())
            .map(|(sample, force)| (sample.force.0 - force).powi(2));
        residual_statistics(squares.sum(), total, count)
    }

    /// Values with their errors and intervals.
    fn parameters(&self, record: usize) -> Vec<FittedParameter> {
        let system = &self.system;
        let values = system.physical_values(record, &self.refined.points[record]);
        let derived = self.derived(&values);
        let known = system.known().iter().zip(&values).enumerate();
        let own = known.map(|(k, (one, value))| {
            let is_fixed = system.fixed(record, k).is_some();
            (one.name.clone(), one.unit.to_owned(), *value, one.range, is_fixed)
        });
        let derived = derived.into_iter().map(|one| (one.name, one.unit, one.value, None, false));
        let errors = self.estimates(record);
        let all = own.chain(derived).zip(errors);
        all.map(|((name, unit, value, range, is_fixed), error)| FittedParameter {
            name,
            value,
            unit,
            std_error: error.map(|error| error.std_error),
            ci95: error.map(|error| interval(value, error, range)),
            is_fixed,
            systematic_error: None,
            total95: None,
            budget: error.map_or_else(Vec::new, statistical_budget),
        })
        .collect()
    }
}

/// Noise, drift and contact position, where these are told apart.
fn statistical_budget(error: UncertaintyEstimate) -> Vec<BudgetEntry> {
    let Some([drift, contact]) = error.shares else { return Vec::new() };
    let entry = |source: &str, share: f64| BudgetEntry {
        source: source.to_owned(),
        error: error.std_error * share.sqrt(),
    };
    let noise = (1.0 - drift - contact).max(0.0);
    vec![entry("noise", noise), entry("drift", drift), entry("contact position", contact)]
}

/// The 95 % interval of a value.
fn interval(value: f64, error: UncertaintyEstimate, range: Option<OuterRange>) -> [f64; 2] {
    let half = student_t975(error.freedom) * error.std_error;
    // No relaxation time is negative, and no curvature.
    let lowest = match range {
        None | Some(OuterRange::Share(..)) => f64::NEG_INFINITY,
        Some(_) => 0.0,
    };
    [(value - half).max(lowest), value + half]
}

/// Explained share of the variance and root mean square, from sums of squares left and in all.
fn residual_statistics(sum: f64, total: f64, count: f64) -> (f64, f64) {
    (if total > 0.0 { 1.0 - sum / total } else { f64::NAN }, (sum / count).sqrt())
}

/// Autocorrelation over blocks as time and shares. The lasting part of variance `A` decays as
/// `exp(-t / theta)`; neighbouring sums of `m` samples then have the covariance
/// `A m^2 ((1 - e^-r) / r)^2`, `r` being the length of a block over theta.
fn estimate_noise(
    memory: &Memory,
    white: f64,
    interval: f64,
    block: f64,
    samples: usize,
) -> NoiseEstimate {
    let effective_samples = (samples as f64 * white / memory.long_run()).clamp(1.0, samples as f64);
    if memory.neighbour <= 0.0 || white <= 0.0 {
        return NoiseEstimate {
            slow_share: 0.0,
            correlation_time_s: None,
            effective_samples: samples as f64,
        };
    }
    let r = -memory.forgetting.ln();
    let decayed = -(-r).exp_m1();
    let slow = memory.level * memory.neighbour * (r / decayed).powi(2) / block;
    NoiseEstimate {
        slow_share: (slow / white).min(1.0),
        correlation_time_s: Some(block * interval / r),
        effective_samples,
    }
}
