//! The fit of a model family as machines read it.

use super::family::FittedRecord;
use palpate_model::families::{AlongError, Family};
use palpate_model::fit::{FamilyFit, FitSample, Systematic};
use palpate_model::signal::work;
use palpate_model::units::Newtons;
use palpate_protocols::compliance::Correction;
use serde::Serialize;

/// A fit of a family as `palpate fit --json` prints it and as an analysis keeps it.
#[derive(Serialize)]
pub(crate) struct FamilyOutput<'a> {
    command: &'static str,
    family: &'a str,
    name: String,
    equation: &'static str,
    cannot_represent: &'static str,
    parameters: Vec<ParameterOutput<'a>>,
    records: Vec<RecordOutput<'a>>,
    samples: usize,
    free: usize,
    rmse_n: f64,
    effective_samples: f64,
    warnings: &'a [String],
    /// What calibrations and compliances add; absent for tables and with `--no-systematic`.
    #[serde(skip_serializing_if = "Option::is_none")]
    systematic: Option<&'a Systematic>,
    /// The fit alone, without reading.
    seconds: f64,
}

#[derive(Serialize)]
struct ParameterOutput<'a> {
    name: &'a str,
    value: f64,
    unit: &'a str,
    std_error: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    systematic_error: Option<f64>,
}

#[derive(Serialize)]
struct RecordOutput<'a> {
    record: &'a str,
    f_offset_n: f64,
    f0_n: f64,
    samples: usize,
    r2: f64,
    rmse_n: f64,
    worst_n: f64,
    /// What the rig's compliance did to the depths, or would; null where none is known.
    compliance: Option<&'a Correction>,
    work_measured_n_mm: f64,
    work_fitted_n_mm: f64,
}

impl<'a> FamilyOutput<'a> {
    /// Of a fit to these records, each with what the rig's compliance did to its depths, or would.
    pub fn of(
        family: &dyn Family,
        fit: &'a FamilyFit,
        records: &[FittedRecord<'_>],
        compliances: &[Option<&'a Correction>],
        systematic: Option<&'a Systematic>,
        seconds: f64,
    ) -> Self {
        Self {
            command: "fit",
            family: &fit.model.family,
            name: family.name(),
            equation: family.equation(),
            cannot_represent: family.cannot_represent(),
            parameters: parameters(fit),
            records: outputs(fit, records, compliances),
            samples: fit.samples,
            free: fit.free,
            rmse_n: fit.rms,
            effective_samples: fit.effective_samples,
            warnings: &fit.warnings,
            systematic,
            seconds,
        }
    }
}

/// The fitted force of every record at each of its samples.
pub(crate) fn forces(
    fit: &FamilyFit,
    records: &[(&str, &[FitSample])],
) -> Result<Vec<Vec<Newtons>>, AlongError> {
    let each = records.iter().enumerate();
    each.map(|(index, (_, samples))| fit.forces(index, samples))
        .collect()
}

/// A record beside its fit; energies over the samples whose force counts.
pub(crate) fn fitted<'a>(
    samples: &'a [FitSample],
    forces: &'a [Newtons],
    r2: f64,
) -> FittedRecord<'a> {
    let known = || {
        samples
            .iter()
            .zip(forces)
            .filter(|(one, _)| one.is_measured())
    };
    FittedRecord {
        samples,
        forces,
        r2,
        work: [
            work(known().map(|(one, _)| (one.depth, one.force))),
            work(known().map(|(one, fit)| (one.depth, *fit))),
        ],
    }
}

fn parameters(fit: &FamilyFit) -> Vec<ParameterOutput<'_>> {
    let all = fit.parameters.iter().map(|one| ParameterOutput {
        name: &one.name,
        value: one.value,
        unit: &one.unit,
        std_error: one.std_error,
        systematic_error: one.systematic_error,
    });
    all.collect()
}

fn outputs<'a>(
    fit: &'a FamilyFit,
    records: &[FittedRecord<'_>],
    compliances: &[Option<&'a Correction>],
) -> Vec<RecordOutput<'a>> {
    let pairs = fit.records.iter().zip(records).zip(compliances);
    pairs
        .map(|((own, record), compliance)| RecordOutput {
            record: &own.name,
            f_offset_n: own.offset,
            f0_n: own.initial,
            samples: own.samples,
            r2: record.r2,
            rmse_n: own.rms,
            worst_n: own.worst,
            compliance: *compliance,
            work_measured_n_mm: record.work[0],
            work_fitted_n_mm: record.work[1],
        })
        .collect()
}
