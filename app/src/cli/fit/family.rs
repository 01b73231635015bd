//! `palpate fit --family KEY`: any model family, one body for all sources.

use super::super::{Failure, new_file, output::Output};
use super::FitArgs;
use super::sources::{self, Recording};
use crate::report::family::{self, FittedRecord};
use crate::report::family_json::{FamilyOutput, fitted, forces};
use palpate_model::calibration::ForceUncertainty;
use palpate_model::families::by_key;
use palpate_model::fit::{FamilyOptions, FitSample, Traced, fit_family, systematic_family};
use palpate_protocols::runner::Stopwatch;
use palpate_sessions::import::ColumnNames;

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
    let forces = forces(&fit, &borrowed).map_err(Failure::failed)?;
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
    let compliances = named.iter().map(|one| one.compliance.as_ref());
    let compliances: Vec<_> = compliances.collect();
    let object = FamilyOutput::of(
        &*family,
        &fit,
        &records,
        &compliances,
        systematic.as_ref(),
        seconds,
    );
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
