//! The shear relaxation modulus of a recorded press and hold, with what makes it uncertain, and the creep compliance of the same
//! solid.
//!
//! Lee and Radok's integral takes the depth as it was, so the ramp need not be fast. Every source of uncertainty is an error of the
//! forces, which the fit turns into one of its numbers (JCGM 100:2008, 5.1.2).

mod choice;
mod numbers;
mod record;

pub use choice::{TermCandidate, TermChoice};

use crate::compliance::ComplianceCorrection;
use crate::material::{
    ErrorSource, MaterialError, MaterialRequest, PressRecord, ValidityRow, above_noise, read_press,
    validity_rows,
};
use crate::source::RecordStretch;
use numbers::Numbers;
use palpate_indentation::{
    ContactLaw, Indenter, LoadHistoryError, RelaxationFamily, RelaxationFitError, Specimen,
};
use palpate_model::estimate::coverage_factor;
use record::{Record, Source};
use serde::Serialize;
use std::path::PathBuf;
use thiserror::Error;

/// A press, of which the greatest depth is not asked: the hold is part of it.
#[derive(Clone, Copy, Debug)]
pub struct RelaxationRequest<'a> {
    pub press: &'a MaterialRequest,
    /// `None` takes a Prony series with as many terms as the record is worth.
    pub family: Option<RelaxationFamily>,
}

/// A relaxation modulus and all it rests on.
#[derive(Clone, Debug, Serialize)]
pub struct RelaxationReport {
    pub source: PathBuf,
    pub property: &'static str,
    /// `prony` or `fractional`.
    pub family: &'static str,
    pub law: ContactLaw,
    pub indenter: Indenter,
    pub specimen: Specimen,
    /// Shear modulus in MPa just after a step.
    pub instantaneous_mpa: UncertainNumber,
    /// Shear modulus in MPa after all has relaxed.
    pub equilibrium_mpa: UncertainNumber,
    /// From the shortest relaxation time to the longest.
    pub terms: Vec<RelaxationTerm>,
    /// Of the Mittag-Leffler function by which the term of the fractional Zener model relaxes, and creeps; `None` for a Prony series.
    pub exponent: Option<UncertainNumber>,
    /// What relaxes within this time in s is in no number; `instantaneous_mpa` is that of the family.
    pub seen_from_s: f64,
    /// At the powers of ten from there to the end of the record.
    pub modulus: Vec<ModulusAtTime>,
    /// The creep compliance of the same solid.
    pub creep: CreepReport,
    /// The largest share in the equilibrium modulus first.
    pub budget: Vec<RelaxationBudgetRow>,
    pub not_included: Vec<&'static str>,
    /// `None` where the family was given.
    pub term_choice: Option<TermChoice>,
    pub samples: usize,
    /// Number of independent samples that carry the information of the residuals.
    pub effective_samples: f64,
    /// Greatest depth, in mm.
    pub depth_mm: f64,
    /// From the contact to 99 % of the greatest depth, in s.
    pub ramp_s: f64,
    /// From the contact to the end, in s.
    pub record_s: f64,
    /// Standard uncertainty of the contact at depth zero, in mm; `None` where it is not known.
    pub contact_error_mm: Option<f64>,
    /// Standard deviation of the residuals in N.
    pub residual_n: f64,
    /// Standard deviation of a force in N, where it is known.
    pub noise_n: Option<f64>,
    /// Residuals over the noise, where they are larger than it.
    pub lack_of_fit: Option<f64>,
    pub validity: Vec<ValidityRow>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compliance: Option<ComplianceCorrection>,
    #[serde(skip)]
    pub notes: Vec<String>,
    /// From `seen_from_s` to the end of the record, for a plot.
    #[serde(skip)]
    pub modulus_curve: Vec<ModulusAtTime>,
    /// At the same times.
    #[serde(skip)]
    pub creep_curve: Vec<ComplianceAtTime>,
}

/// A number with its combined standard uncertainty and 95 % interval, all in its unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct UncertainNumber {
    pub value: f64,
    pub standard_uncertainty: f64,
    pub total95: [f64; 2],
}

/// What residuals make uncertain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NoiseError {
    /// In the unit of the number.
    pub standard_error: f64,
    /// Degrees of freedom, for Student's t.
    pub freedom: f64,
}

impl UncertainNumber {
    /// A number with the standard uncertainty of all sources, of which the noise is one.
    pub(crate) fn new(value: f64, standard_uncertainty: f64, noise: NoiseError) -> Self {
        let variance = standard_uncertainty * standard_uncertainty;
        let factor = coverage_factor(noise.standard_error, noise.freedom, variance);
        let half = factor * standard_uncertainty;
        Self { value, standard_uncertainty, total95: [value - half, value + half] }
    }

    /// A number whose standard uncertainty is known, as of a sum of many sources.
    pub(crate) fn normal(value: f64, standard_uncertainty: f64) -> Self {
        let noise = NoiseError { standard_error: standard_uncertainty, freedom: f64::INFINITY };
        Self::new(value, standard_uncertainty, noise)
    }

    /// The same in a unit of which there are so many in its own.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            value: factor * self.value,
            standard_uncertainty: factor * self.standard_uncertainty,
            total95: self.total95.map(|end| factor * end),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RelaxationTerm {
    pub modulus_mpa: UncertainNumber,
    pub time_s: UncertainNumber,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ModulusAtTime {
    pub t_s: f64,
    pub mpa: UncertainNumber,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CreepReport {
    pub instantaneous_per_mpa: UncertainNumber,
    /// From the shortest retardation time to the longest.
    pub terms: Vec<RetardationTerm>,
    /// At the times of the modulus.
    pub compliance: Vec<ComplianceAtTime>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RetardationTerm {
    pub compliance_per_mpa: UncertainNumber,
    pub time_s: UncertainNumber,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ComplianceAtTime {
    pub t_s: f64,
    pub per_mpa: UncertainNumber,
}

/// Standard uncertainties in MPa that a source adds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RelaxationBudgetRow {
    pub source: &'static str,
    pub instantaneous_mpa: f64,
    pub equilibrium_mpa: f64,
}

#[derive(Debug, Error)]
pub enum RelaxationError {
    #[error(transparent)]
    Press(#[from] MaterialError),
    #[error(transparent)]
    History(#[from] LoadHistoryError),
    #[error(transparent)]
    Fit(#[from] RelaxationFitError),
    #[error(
        "the record has no press beyond depth zero with known forces; check the sign of the depth"
    )]
    NoPress,
    #[error(
        "a relaxation modulus cannot tell the contact from the relaxation; state the standard uncertainty of the contact, 0 for exact"
    )]
    ContactFree,
    #[error(
        "the term with the relaxation time of {time_secs:.3e} s is known to {percent:.0} % only, because the residuals are autocorrelated: the modulus does not describe the record; take another law or another model, or press less deep"
    )]
    Autocorrelated { time_secs: f64, percent: f64 },
    #[error("the standard uncertainty of the contact is {error_mm} mm; give mm, not below 0")]
    ContactError { error_mm: f64 },
    #[error(
        "the equilibrium modulus is {mpa:.3e} MPa, below 0; hold longer, and check the zero of the force"
    )]
    NegativeEquilibrium { mpa: f64 },
    #[error(
        "the residuals of {samples} samples say nothing of the uncertainty; record more of them"
    )]
    NoResiduals { samples: usize },
}

/// The relaxation modulus of ramp and hold of a session or a table.
pub fn relaxation(request: RelaxationRequest) -> Result<RelaxationReport, RelaxationError> {
    let press = request.press;
    let PressRecord { read, compliance, specimen } = read_press(press, RecordStretch::RampHold)?;
    let contact_error_mm = match press.contact {
        ErrorSource::Recorded => read.signal.as_ref().map(|signal| signal.contact_error_mm),
        ErrorSource::Stated(error_mm) if error_mm >= 0.0 => Some(error_mm),
        ErrorSource::Stated(error_mm) => {
            return Err(RelaxationError::ContactError { error_mm });
        }
        ErrorSource::Free => return Err(RelaxationError::ContactFree),
    };
    let record = Record::of(&read)?;
    let law = (press.law, &press.indenter, &specimen);
    let (judged, term_choice) = match request.family {
        Some(family) => (record.fit(law, family)?, None),
        None => {
            let (judged, choice) = choice::choose(&record, law)?;
            (judged, Some(choice))
        }
    };
    let fit = &judged.fit;
    if fit.modulus.equilibrium_mpa <= 0.0 {
        return Err(RelaxationError::NegativeEquilibrium { mpa: fit.modulus.equilibrium_mpa });
    }
    let seen_from_s = record.seen_from_secs(law, fit);
    let decades = record.decades(seen_from_s);
    let times: Vec<f64> = decades.iter().copied().chain(record.plot_times(seen_from_s)).collect();
    let numbers = Numbers::of(fit, &times);
    let noise = numbers.noise(&judged);
    let of_residuals = noise.iter().map(|one| one.standard_error).collect();
    let mut sources: Vec<(&'static str, Vec<f64>)> = vec![("residuals", of_residuals)];
    let mut not_included = Vec::new();
    let applied = compliance.as_ref().filter(|one| one.is_applied);
    for Source { name, errors } in record.sources(law, fit, &read, contact_error_mm, applied)? {
        match errors.is_empty() {
            true => not_included.push(name),
            false => sources.push((name, numbers.shifts(fit, &errors))),
        }
    }
    let mut found = numbers.combined(&noise, &sources);
    let modulus_curve = found.modulus.split_off(decades.len());
    let creep_curve = found.creep.compliance.split_off(decades.len());
    let is_fractional = fit.family == RelaxationFamily::Fractional;
    let validity = press.law.validity(&press.indenter, &specimen, record.deepest());
    let validity = validity_rows(&validity.map_err(LoadHistoryError::from)?);
    Ok(RelaxationReport {
        source: press.source.clone(),
        property: "relaxation",
        family: if is_fractional { "fractional" } else { "prony" },
        law: press.law,
        indenter: press.indenter,
        specimen,
        instantaneous_mpa: found.instantaneous,
        equilibrium_mpa: found.equilibrium,
        terms: found.terms,
        exponent: is_fractional.then_some(found.exponent),
        seen_from_s,
        modulus: found.modulus,
        creep: found.creep,
        budget: budget(&sources),
        not_included,
        term_choice,
        samples: record.forces.len(),
        effective_samples: judged.memory.effective_samples(),
        depth_mm: record.deepest(),
        ramp_s: record.ramp_secs(),
        record_s: record.secs(),
        contact_error_mm,
        residual_n: fit.residual_newtons,
        noise_n: record.noise,
        lack_of_fit: record
            .noise
            .and_then(|noise| above_noise(fit.residual_newtons, noise, record.forces.len())),
        validity,
        compliance,
        notes: read.notes,
        modulus_curve,
        creep_curve,
    })
}

/// The first two numbers are the instantaneous and the equilibrium modulus.
fn budget(sources: &[(&'static str, Vec<f64>)]) -> Vec<RelaxationBudgetRow> {
    let row = |(source, errors): &(&'static str, Vec<f64>)| RelaxationBudgetRow {
        source,
        instantaneous_mpa: errors[0],
        equilibrium_mpa: errors[1],
    };
    let mut rows: Vec<RelaxationBudgetRow> = sources.iter().map(row).collect();
    rows.sort_by(|a, b| b.equilibrium_mpa.total_cmp(&a.equilibrium_mpa));
    rows
}
