//! `palpate fit --family KEY`: any model family, one body for all sources.

use super::super::{Failure, new_file, output::Output};
use super::FitArgs;
use super::sources::{self, Recording};
use crate::report::family::{self, FittedRecord};
use palpate_model::calibration::ForceUncertainty;
use palpate_model::families::by_key;
use palpate_model::fit::{
    FamilyFit, FamilyOptions, FitSample, Systematic, Traced, fit_family, systematic_family,
};
use palpate_model::signal::work;
use palpate_model::units::Newtons;
use palpate_protocols::compliance::Correction;
use palpate_protocols::runner::Stopwatch;
use palpate_sessions::import::ColumnNames;
use serde::Serialize;

#[derive(Serialize)]
struct FamilyOutput<'a> {
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

/// Fits the family of `key` to all sources together.
pub(super) fn run(
    key: &str,
    args: &FitArgs,
    columns: Option<&ColumnNames>,
    output: &Output,
) -> Result<(), Failure> {
    let family = by_key(key).map_err(Failure::usage)?;
    let found = sources::find(&args.sources, output)?;
    let to = args.picture.as_deref();
    new_file::check("picture", to)?;
    if to.is_some() && found.len() > 1 {
        return Err(Failure::usage(
            "--picture is for one record; name a single session or table",
        ));
    }
    let named = sources::read(&found, columns, args.wanted(), &args.corrections()?, output)?;
    let borrowed: Vec<(&str, &[FitSample])> = named.iter().map(Recording::borrowed).collect();
    let watch = Stopwatch::start();
    let mut fit =
        fit_family(&*family, &borrowed, FamilyOptions::default()).map_err(Failure::failed)?;
    let seconds = watch.seconds();
    let find = |records: &[Traced<'_>]| {
        systematic_family(&fit, &*family, records, FamilyOptions::default())
    };
    let systematic = match args.no_systematic {
        true => None,
        false => sources::systematic(&named, find, output),
    };
    if let Some(found) = &systematic {
        fit = fit.with_systematic(found);
    }
    let forces = forces(&fit, &borrowed)?;
    let records: Vec<FittedRecord<'_>> = borrowed
        .iter()
        .zip(&forces)
        .zip(&fit.records)
        .map(|((&(_, samples), forces), own)| fitted(samples, forces, own.r2(samples)))
        .collect();
    if let (Some(to), [record]) = (to, records.as_slice()) {
        let name = found[0].file_name().unwrap_or(found[0].as_os_str());
        let calibration = named.first().and_then(|one| one.calibration.as_ref());
        let uncertainty = calibration.and_then(|one| ForceUncertainty::of(one).ok());
        let name = name.to_string_lossy();
        let picture = family::picture(&name, &*family, &fit, record, uncertainty.as_ref());
        new_file::write("picture", Some(to), || picture)?;
    }
    let object = FamilyOutput {
        command: "fit",
        family: &fit.model.family,
        name: family.name(),
        equation: family.equation(),
        cannot_represent: family.cannot_represent(),
        parameters: parameters(&fit),
        records: outputs(&fit, &records, &named),
        samples: fit.samples,
        free: fit.free,
        rmse_n: fit.rms,
        effective_samples: fit.effective_samples,
        warnings: &fit.warnings,
        systematic: systematic.as_ref(),
        seconds,
    };
    output.result(&object, || {
        let sentence = systematic
            .as_ref()
            .map(|one| format!("- {}", one.sentence()));
        let whole = [family::whole(&*family, &fit, &records)];
        let lines: Vec<String> = whole.into_iter().chain(sentence).collect();
        lines.join("\n")
    });
    Ok(())
}

fn forces(fit: &FamilyFit, records: &[(&str, &[FitSample])]) -> Result<Vec<Vec<Newtons>>, Failure> {
    let each = records.iter().enumerate();
    each.map(|(index, (_, samples))| fit.forces(index, samples).map_err(Failure::failed))
        .collect()
}

/// A record beside its fit; energies over the samples whose force counts.
fn fitted<'a>(samples: &'a [FitSample], forces: &'a [Newtons], r2: f64) -> FittedRecord<'a> {
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
    named: &'a [Recording],
) -> Vec<RecordOutput<'a>> {
    let pairs = fit.records.iter().zip(records).zip(named);
    pairs
        .map(|((own, record), read)| RecordOutput {
            record: &own.name,
            f_offset_n: own.offset,
            f0_n: own.initial,
            samples: own.samples,
            r2: record.r2,
            rmse_n: own.rms,
            worst_n: own.worst,
            compliance: read.compliance.as_ref(),
            work_measured_n_mm: record.work[0],
            work_fitted_n_mm: record.work[1],
        })
        .collect()
}
