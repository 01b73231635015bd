//! A fit as machines read it: what `palpate fit --json` prints and what an analysis keeps.

use crate::compliance::ComplianceCorrection;
use crate::fit::FitIntervals;
use palpate_model::signal::work;
use palpate_model::units::Newtons;
use palpate_rheology::families::Family;
use palpate_rheology::fit::{FitReport, FitSample, JointReport, SystematicUncertainty};
use serde::Serialize;

/// The modelled force along a record, and what it says beside the measured one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FitOverlay {
    /// At every sample.
    #[serde(skip)]
    pub forces: Vec<Newtons>,
    /// The largest residual in N.
    pub worst_n: f64,
    /// Energy in N*mm put into the tissue along the path, as measured; over a closed loop what was lost.
    pub work_measured_n_mm: f64,
    /// Energy of the modelled force in N*mm.
    pub work_fitted_n_mm: f64,
}

impl FitOverlay {
    /// Of a report along the samples that were fitted; energies over those whose force counts.
    #[must_use]
    pub fn of(report: &FitReport, samples: &[FitSample]) -> Self {
        let forces = report.predict(samples);
        let pairs = || samples.iter().zip(&forces);
        let known = || pairs().filter(|(one, _)| one.is_measured());
        let off = known().map(|(one, fit)| (one.force.0 - fit.0).abs());
        Self {
            worst_n: off.fold(0.0, f64::max),
            work_measured_n_mm: work(known().map(|(one, _)| (one.depth, one.force))),
            work_fitted_n_mm: work(known().map(|(one, fit)| (one.depth, *fit))),
            forces,
        }
    }
}

#[derive(Serialize)]
struct FamilyText {
    equation: &'static str,
    cannot_represent: &'static str,
}

impl FamilyText {
    fn of(family: &dyn Family) -> Self {
        Self { equation: family.equation(), cannot_represent: family.cannot_represent() }
    }
}

#[derive(Serialize)]
pub struct FitObject<'a> {
    #[serde(flatten)]
    report: &'a FitReport,
    #[serde(flatten)]
    family_text: FamilyText,
    #[serde(flatten)]
    details: FitDetails<'a>,
    /// The fit alone, without reading.
    seconds: f64,
}

/// Parts of a fit beside its report.
#[derive(Clone, Copy, Serialize)]
pub struct FitDetails<'a> {
    #[serde(flatten)]
    pub overlay: &'a FitOverlay,
    #[serde(flatten)]
    pub intervals: &'a FitIntervals,
    /// Systematic uncertainty; absent for tables and where it was not requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub systematic: Option<&'a SystematicUncertainty>,
    /// Effect of the machine compliance on the depths; absent where none is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compliance: Option<&'a ComplianceCorrection>,
}

impl<'a> FitObject<'a> {
    pub fn of(
        family: &dyn Family,
        report: &'a FitReport,
        details: FitDetails<'a>,
        seconds: f64,
    ) -> Self {
        Self { report, family_text: FamilyText::of(family), details, seconds }
    }
}

#[derive(Serialize)]
pub struct JointObject<'a> {
    family: String,
    #[serde(flatten)]
    family_text: FamilyText,
    shared: &'a [String],
    records: Vec<RecordObject<'a>>,
    samples: usize,
    free: usize,
    rmse_n: f64,
    effective_samples: f64,
    /// Effect of the machine compliance on the depths of each record; null where none is known.
    compliances: Vec<Option<&'a ComplianceCorrection>>,
    /// Systematic uncertainty of each record; absent for tables and where it was not requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    systematic: Option<&'a [SystematicUncertainty]>,
    seconds: f64,
}

#[derive(Serialize)]
struct RecordObject<'a> {
    record: &'a str,
    report: &'a FitReport,
    #[serde(flatten)]
    details: FitDetails<'a>,
}

impl<'a> JointObject<'a> {
    /// `details` has one for each record.
    pub fn of(
        family: &dyn Family,
        report: &'a JointReport,
        details: &[FitDetails<'a>],
        systematic: Option<&'a [SystematicUncertainty]>,
        seconds: f64,
    ) -> Self {
        let records = report.records.iter().zip(details);
        Self {
            family: family.key(),
            family_text: FamilyText::of(family),
            shared: &report.shared,
            records: records
                .map(|(named, details)| RecordObject {
                    record: &named.record,
                    report: &named.report,
                    details: FitDetails { systematic: None, compliance: None, ..*details },
                })
                .collect(),
            samples: report.samples,
            free: report.free,
            rmse_n: report.rmse_n,
            effective_samples: report.effective_samples,
            compliances: details.iter().map(|one| one.compliance).collect(),
            systematic,
            seconds,
        }
    }
}
