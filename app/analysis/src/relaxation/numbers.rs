//! The numbers of a report and how they follow those of the fit.

use super::record::JudgedFit;
use super::{
    ComplianceAtTime, CreepReport, ModulusAtTime, NoiseError, RelaxationTerm, RetardationTerm,
    UncertainNumber,
};
use palpate_indentation::{CreepTerm, RelaxationFit, RelaxationModulus};

/// Instantaneous and equilibrium modulus, the exponent, the terms, the modulus at the times; the instantaneous compliance, its terms, the
/// compliance at the times.
pub(super) struct Numbers<'a> {
    times: &'a [f64],
    values: Vec<f64>,
    /// For each number, how it rises with each unknown of the fit: each modulus in MPa, the equilibrium behind the terms, and the
    /// logarithms of the times and of the exponent.
    gradients: Vec<Vec<f64>>,
}

pub(super) struct CombinedNumbers {
    pub instantaneous: UncertainNumber,
    pub equilibrium: UncertainNumber,
    pub exponent: UncertainNumber,
    pub terms: Vec<RelaxationTerm>,
    pub modulus: Vec<ModulusAtTime>,
    pub creep: CreepReport,
}

/// Share of a number over which is differenced: the error is of its square, and rounding of 1e-16 over it.
const STEP: f64 = 1e-5;

impl<'a> Numbers<'a> {
    pub fn of(fit: &RelaxationFit, times: &'a [f64]) -> Self {
        let (series, count) = (&fit.modulus, fit.modulus.terms.len());
        let slopes = |unknown: usize| {
            let modulus = match unknown {
                index if index < count => series.terms[index].modulus_mpa,
                index if index == count => series.equilibrium_mpa,
                _ => 1.0,
            };
            let step = STEP * modulus;
            let [low, high] = [-step, step].map(|by| list(&moved(series, unknown, by), times));
            let slope = |(low, high): (&f64, &f64)| (high - low) / (2.0 * step);
            low.iter().zip(&high).map(slope).collect::<Vec<f64>>()
        };
        let columns: Vec<Vec<f64>> = (0..fit.tangents.len()).map(slopes).collect();
        let values = list(series, times);
        let gradient = |number: usize| columns.iter().map(|column| column[number]).collect();
        let gradients = (0..values.len()).map(gradient).collect();
        Self { times, values, gradients }
    }

    /// What the residuals make uncertain.
    pub fn noise(&self, judged: &JudgedFit) -> Vec<NoiseError> {
        self.gradients.iter().map(|gradient| judged.error_along(gradient)).collect()
    }

    /// Standard uncertainties from independent errors of all forces, in N.
    pub fn shifts(&self, fit: &RelaxationFit, errors: &[Vec<f64>]) -> Vec<f64> {
        let moved: Vec<Vec<f64>> = errors.iter().map(|errors| fit.shift_by(errors)).collect();
        let shift = |gradient: &Vec<f64>| {
            let along = |moved: &Vec<f64>| -> f64 {
                gradient.iter().zip(moved).map(|(slope, by)| slope * by).sum()
            };
            moved.iter().map(|moved| along(moved).powi(2)).sum::<f64>().sqrt()
        };
        self.gradients.iter().map(shift).collect()
    }

    /// All numbers with the root of the sum of squares of all sources, that of the residuals among them.
    pub fn combined(
        &self,
        noise: &[NoiseError],
        sources: &[(&'static str, Vec<f64>)],
    ) -> CombinedNumbers {
        let variance =
            |number: usize| sources.iter().map(|(_, errors)| errors[number].powi(2)).sum::<f64>();
        let number = |number: usize| {
            UncertainNumber::new(self.values[number], variance(number).sqrt(), noise[number])
        };
        let times = self.times.len();
        let count = (self.values.len() - 4 - 2 * times) / 4;
        let pair =
            |from: usize, term: usize| [number(from + 2 * term), number(from + 2 * term + 1)];
        let term = |term: usize| {
            let [modulus_mpa, time_s] = pair(3, term);
            RelaxationTerm { modulus_mpa, time_s }
        };
        let retardation = |term: usize| {
            let [compliance_per_mpa, time_s] = pair(4 + 2 * count + times, term);
            RetardationTerm { compliance_per_mpa, time_s }
        };
        let at = |k: usize| (self.times[k], number(3 + 2 * count + k));
        let creep_at = |k: usize| (self.times[k], number(4 + 4 * count + times + k));
        CombinedNumbers {
            instantaneous: number(0),
            equilibrium: number(1),
            exponent: number(2),
            terms: (0..count).map(term).collect(),
            modulus: (0..times).map(at).map(|(t_s, mpa)| ModulusAtTime { t_s, mpa }).collect(),
            creep: CreepReport {
                instantaneous_per_mpa: number(3 + 2 * count + times),
                terms: (0..count).map(retardation).collect(),
                compliance: (0..times)
                    .map(creep_at)
                    .map(|(t_s, per_mpa)| ComplianceAtTime { t_s, per_mpa })
                    .collect(),
            },
        }
    }
}

/// The modulus with one of its unknowns changed: a modulus in MPa, or the logarithm of a time or of the exponent.
fn moved(series: &RelaxationModulus, unknown: usize, by: f64) -> RelaxationModulus {
    let mut moved = series.clone();
    let count = moved.terms.len();
    match unknown {
        index if index < count => moved.terms[index].modulus_mpa += by,
        index if index == count => moved.equilibrium_mpa += by,
        index if index <= 2 * count => moved.terms[index - count - 1].time_secs *= by.exp(),
        _ => moved.exponent = (moved.exponent * by.exp()).min(1.0),
    }
    moved
}

fn list(series: &RelaxationModulus, times: &[f64]) -> Vec<f64> {
    let mut list = vec![series.modulus(0.0), series.equilibrium_mpa, series.exponent];
    list.extend(series.terms.iter().flat_map(|term| [term.modulus_mpa, term.time_secs]));
    list.extend(times.iter().map(|time| series.modulus(*time)));
    // A modulus with an equilibrium above zero, as every fit here, creeps to an end.
    let Ok(creep) = series.creep() else {
        list.resize(list.len() + 1 + 2 * series.terms.len() + times.len(), f64::NAN);
        return list;
    };
    list.push(creep.instantaneous_per_mpa);
    let both = |term: &CreepTerm| [term.compliance_per_mpa, term.time_secs];
    list.extend(creep.terms.iter().flat_map(both));
    list.extend(times.iter().map(|time| creep.compliance(*time)));
    list
}
