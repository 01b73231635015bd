//! `palpate calibration`: documents that convert volts to newtons.

mod import;
pub(super) mod source;

use super::Failure;
use super::new_file;
use super::output::Output;
use clap::{Args, Subcommand};
use palpate_analysis::report::calibration as report;
use palpate_model::calibration::{Calibration, CalibrationUse, KnownWeight};
use palpate_model::units::Volts;
use palpate_sessions::calibrations::CalibrationStore;
use palpate_sessions::library_folder;
use serde::Serialize;
use source::CalibrationSource;
use std::path::PathBuf;

/// Store, show and check load-cell calibrations
#[derive(Debug, Subcommand)]
pub enum CalibrationCommand {
    /// List the calibrations of the library
    List,
    /// Show a calibration: curve, uncertainty, flat stretches
    Show(CalibrationShowArgs),
    /// Check a calibration with one known weight
    Check(CalibrationCheckArgs),
    /// Store a new calibration from a table of weights or a document
    Import(import::CalibrationImportArgs),
    /// Supersede a calibration by a new one; the old one is kept
    Supersede(import::SupersedeArgs),
}

/// Arguments of `palpate calibration show`.
#[derive(Debug, Args)]
pub struct CalibrationShowArgs {
    /// A name or id of the library, a file, or thesis for the table of the source thesis
    #[arg(value_name = "NAME|FILE")]
    calibration: String,
    /// Draw curve, residuals, sensitivity and uncertainty as a new SVG file
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

/// Arguments of `palpate calibration check`.
#[derive(Debug, Args)]
pub struct CalibrationCheckArgs {
    /// A name or id of the library, a file, or thesis
    #[arg(value_name = "NAME|FILE")]
    calibration: String,
    /// Mass of the known weight in g
    #[arg(long, value_name = "G")]
    mass: f64,
    /// Tolerance of its mass in g
    #[arg(long, value_name = "G")]
    tolerance: Option<f64>,
    /// Signal with the weight in V
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    volts: f64,
    /// Signal of the empty cell just before in V
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    tare: f64,
    /// Largest error in percent of the weight [default: 1, as ASTM E4 asks]
    #[arg(long, value_name = "PERCENT")]
    limit: Option<f64>,
}

pub(super) fn run(command: &CalibrationCommand, output: &Output) -> Result<(), Failure> {
    match command {
        CalibrationCommand::List => list(output),
        CalibrationCommand::Show(args) => show(args, output),
        CalibrationCommand::Check(args) => check(args, output),
        CalibrationCommand::Import(args) => import::import(args, output),
        CalibrationCommand::Supersede(args) => import::supersede(args, output),
    }
}

#[derive(Serialize)]
struct ListReport {
    folder: PathBuf,
    calibrations: Vec<report::CalibrationEntry>,
    unreadable: Vec<String>,
}

fn list(output: &Output) -> Result<(), Failure> {
    let library = library_folder().map_err(Failure::usage)?;
    let shelf = CalibrationStore::open(&library);
    let unreadable: Vec<String> = shelf.unreadable.iter().map(ToString::to_string).collect();
    unreadable.iter().for_each(|reason| output.note(reason));
    let entry = |saved| report::CalibrationEntry::of(&shelf, saved, source::age_days(saved));
    let found = ListReport {
        folder: library.join("calibrations"),
        calibrations: shelf.documents.iter().map(entry).collect(),
        unreadable,
    };
    output.answer("calibration list", &found, || match found.calibrations.is_empty() {
        true => format!(
            "{}; store one with 'palpate calibration import'",
            report::list(&found.calibrations, &found.folder)
        ),
        false => report::list(&found.calibrations, &found.folder),
    });
    Ok(())
}

#[derive(Serialize)]
struct ShowReport<'a> {
    /// Its id in the library, null where it is not from there.
    id: Option<&'a str>,
    file: Option<&'a PathBuf>,
    #[serde(flatten)]
    content: &'a report::CalibrationDetails,
    doubts: &'a [String],
    document: &'a Calibration,
}

fn show(args: &CalibrationShowArgs, output: &Output) -> Result<(), Failure> {
    new_file::check("picture", args.picture.as_deref())?;
    let source = CalibrationSource::find(&args.calibration)?;
    report_calibration("calibration show", &source, args.picture.as_deref(), output)
}

/// Prints and draws a calibration.
fn report_calibration(
    command: &str,
    source: &CalibrationSource,
    picture: Option<&std::path::Path>,
    output: &Output,
) -> Result<(), Failure> {
    let content = report::CalibrationDetails::of(&source.calibration).map_err(Failure::failed)?;
    let doubts = source.calibration.validity_warnings(&CalibrationUse {
        rig: &source.calibration.rig,
        age_days: source.age_days,
        ..CalibrationUse::default()
    });
    new_file::write("picture", picture, || report::picture(&source.calibration, &content))?;
    let object = ShowReport {
        id: source.id.as_deref(),
        file: source.file.as_ref(),
        content: &content,
        doubts: &doubts,
        document: &source.calibration,
    };
    output.answer(command, &object, || {
        report::calibration_page(&source.calibration, source.id.as_deref(), &content, &doubts)
    });
    Ok(())
}

fn check(args: &CalibrationCheckArgs, output: &Output) -> Result<(), Failure> {
    let source = CalibrationSource::find(&args.calibration)?;
    let weight = KnownWeight {
        mass_g: args.mass,
        tolerance_g: args.tolerance,
        volts: Volts(args.volts),
        tare: Volts(args.tare),
        limit_percent: args.limit,
    };
    let result = source.calibration.check(&weight).map_err(Failure::usage)?;
    let mut object = serde_json::json!(result);
    object["calibration"] = source.calibration.name.as_str().into();
    output.answer("calibration check", &object, || report::check(&result));
    match result.is_passed {
        true => Ok(()),
        false => Err(Failure::failed(&result.sentence)),
    }
}
