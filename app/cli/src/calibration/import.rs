//! `palpate calibration import` and `supersede`: stores a calibration from a session, a table or a document.

use super::super::Failure;
use super::super::new_file;
use super::super::output::Output;
use super::source::{CalibrationSource, failure};
use chrono::{DateTime, SecondsFormat, Utc};
use clap::Args;
use palpate_analysis::calibrations::{UnacceptedCalibration, accepted};
use palpate_model::calibration::{Calibration, CurveKind};
use palpate_model::units::Volts;
use palpate_runner::programme::calibration_from_session;
use palpate_runner::wall_now;
use palpate_sessions::Session;
use palpate_sessions::library_folder;
use palpate_sessions::{document_store, read_calibration};
use palpate_tables::import::read_weights;
use std::path::PathBuf;

/// Arguments of `palpate calibration import`.
#[derive(Debug, Args)]
pub struct CalibrationImportArgs {
    /// A session of the protocol load-cell-calibration, a table with columns
    /// mass_g,volts[,direction,repeat,noise_v,samples,waited_s], or a document (.json)
    #[arg(value_name = "SESSION|FILE")]
    file: PathBuf,
    /// Name; a table has none of its own
    #[arg(long)]
    name: Option<String>,
    /// Rig of the cell
    #[arg(long)]
    rig: Option<String>,
    /// Serial number of the cell
    #[arg(long)]
    cell: Option<String>,
    /// Excitation of the bridge in V
    #[arg(long, value_name = "V")]
    excitation: Option<f64>,
    /// Operator
    #[arg(long)]
    operator: Option<String>,
    /// When it was taken, such as 2026-03-05T14:15:00Z; now, for a table without it
    #[arg(long, value_name = "TIME")]
    taken_at: Option<String>,
    /// Tolerance in g of each weight; each increase of mass counts as one added weight
    #[arg(long, value_name = "G")]
    tolerance: Option<f64>,
    /// Resolution of the readings in V
    #[arg(long, value_name = "V")]
    resolution: Option<f64>,
    /// Signal of the empty cell before the first weight in V
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    zero_before: Option<f64>,
    /// Signal of the empty cell after the last weight in V
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    zero_after: Option<f64>,
    /// Days for which it is valid [default: 365; under heavy use take 182]
    #[arg(long, value_name = "DAYS")]
    valid_days: Option<u32>,
    /// Curve: best (predicts weights left out best), monotone, segments=N or polynomial=N; best for a table
    #[arg(long, value_name = "KIND")]
    curve: Option<CurveChoice>,
    /// Reason to keep a calibration whose checks are bad; it is added to the source
    #[arg(long, value_name = "REASON")]
    despite: Option<String>,
    /// Source in words: who measured it on what
    #[arg(long, value_name = "WORDS")]
    source: Option<String>,
    /// Draw curve, residuals, sensitivity and uncertainty as a new SVG file
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

/// Arguments of `palpate calibration supersede`.
#[derive(Debug, Args)]
pub struct SupersedeArgs {
    /// Name or id of the calibration to supersede
    #[arg(value_name = "OLD")]
    old: String,
    #[command(flatten)]
    pub new: CalibrationImportArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CurveChoice {
    Best,
    Monotone,
    Segments(usize),
    Polynomial(usize),
}

impl std::str::FromStr for CurveChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || "give best, monotone, segments=N or polynomial=N, for example segments=4".to_owned();
        match text.split_once('=') {
            None if text == "best" => Ok(Self::Best),
            None if text == "monotone" => Ok(Self::Monotone),
            Some((kind, count)) => {
                let count: usize = count.parse().map_err(|_| wrong())?;
                match kind {
                    "segments" => Ok(Self::Segments(count)),
                    "polynomial" => Ok(Self::Polynomial(count)),
                    _ => Err(wrong()),
                }
            }
            None => Err(wrong()),
        }
    }
}

pub(super) fn import(args: &CalibrationImportArgs, output: &Output) -> Result<(), Failure> {
    new_file::check("picture", args.picture.as_deref())?;
    let library = library_folder().map_err(Failure::usage)?;
    let saved = document_store::save_document(&library, &document(args)?).map_err(failure)?;
    let source = CalibrationSource::from_library(&saved);
    super::report_calibration("calibration import", &source, args.picture.as_deref(), output)
}

pub(super) fn supersede(args: &SupersedeArgs, output: &Output) -> Result<(), Failure> {
    new_file::check("picture", args.new.picture.as_deref())?;
    let library = library_folder().map_err(Failure::usage)?;
    let new = document(&args.new)?;
    let saved = document_store::supersede_document(&library, &args.old, &new).map_err(failure)?;
    let (source, picture) = (CalibrationSource::from_library(&saved), args.new.picture.as_deref());
    super::report_calibration("calibration supersede", &source, picture, output)
}

fn now() -> String {
    DateTime::<Utc>::from(wall_now()).to_rfc3339_opts(SecondsFormat::Secs, true)
}

fn document(args: &CalibrationImportArgs) -> Result<Calibration, Failure> {
    let is_document = args.file.extension().is_some_and(|ending| ending == "json");
    let mut new = if args.file.is_dir() {
        let session = Session::open(&args.file).map_err(Failure::usage)?;
        calibration_from_session(&session, args.name.as_deref().unwrap_or("load cell"))
            .map_err(Failure::usage)?
    } else if is_document {
        read_calibration(&args.file).map_err(failure)?
    } else {
        let table = read_weights(&args.file).map_err(Failure::usage)?;
        let file = args.file.file_name().unwrap_or_default().to_string_lossy();
        Calibration { taken_at: Some(now()), source: format!("imported from {file}"), ..table }
    };
    let word = |to: &mut String, from: &Option<String>| {
        if let Some(from) = from {
            to.clone_from(from);
        }
    };
    word(&mut new.name, &args.name);
    word(&mut new.rig, &args.rig);
    word(&mut new.cell, &args.cell);
    word(&mut new.operator, &args.operator);
    word(&mut new.source, &args.source);
    new.taken_at = args.taken_at.clone().or(new.taken_at);
    new.excitation = args.excitation.map(Volts).or(new.excitation);
    new.resolution = args.resolution.map(Volts).or(new.resolution);
    new.zero_before = args.zero_before.map(Volts).or(new.zero_before);
    new.zero_after = args.zero_after.map(Volts).or(new.zero_after);
    new.valid_days = args.valid_days.or(new.valid_days);
    if new.name.trim().is_empty() {
        return Err(Failure::usage("the calibration has no name; give one with --name"));
    }
    if let Some(tolerance) = args.tolerance {
        new = new.with_stacked_weights(tolerance).map_err(Failure::usage)?;
    }
    let default = (!is_document).then_some(CurveChoice::Best);
    if let Some(choice) = args.curve.or(default) {
        new.curve = choose_curve(&new, choice)?;
    }
    accepted(new, args.despite.as_deref()).map_err(|err| match err {
        UnacceptedCalibration::Unreadable(_) => Failure::usage(err),
        UnacceptedCalibration::Bad(_) => Failure::failed(err),
    })
}

fn choose_curve(calibration: &Calibration, choice: CurveChoice) -> Result<CurveKind, Failure> {
    let points = calibration.points().map_err(Failure::usage)?;
    match choice {
        CurveChoice::Monotone => Ok(CurveKind::Monotone),
        CurveChoice::Polynomial(degree) => Ok(CurveKind::Polynomial { degree }),
        CurveChoice::Segments(count) => CurveKind::best_segments(&points, count).ok_or_else(|| {
            Failure::usage(format!(
                "{count} straight segments cannot be fitted through {} weights; give 1 to {} segments",
                points.len(),
                points.len() - 1
            ))
        }),
        CurveChoice::Best => calibration.best_curve().map_err(Failure::usage),
    }
}
