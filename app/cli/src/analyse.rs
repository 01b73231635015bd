//! `palpate analyse`: what the cycles of a record show.

use super::output::Output;
use super::{Failure, last_fit, new_file, source_failure};
use clap::Args;
use palpate_analysis::report::cycles::{CycleReport, Question, object, picture, whole};
use palpate_analysis::{cycles, source};
use palpate_model::units::Depth;
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::cycles::SteadyRule;
use palpate_rheology::fit::{FitOptions, fit};
use palpate_tables::import::ColumnNames;
use std::path::{Path, PathBuf};

/// Arguments of `palpate analyse`.
#[derive(Debug, Args)]
pub struct AnalyseArgs {
    /// Session folders, or delimited tables with columns for time, depth and force
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// Depth in mm at which the stiffness is told; without it 80 % of the first cycle's
    #[arg(long, value_name = "MM", value_parser = positive)]
    at: Option<f64>,
    /// Cycles are steady when peak and shift change by less than so many percent, twice in a row
    #[arg(long, value_name = "PERCENT", default_value = "1", value_parser = positive)]
    steady: f64,
    /// Take a table for one sine of this frequency in Hz; sessions know theirs
    #[arg(long, value_name = "HZ", value_parser = positive)]
    frequency: Option<f64>,
    /// Compare with the prediction of a fit: a file of 'palpate fit --json', or a session or table to fit
    #[arg(long, value_name = "FITTED")]
    validate: Option<PathBuf>,
    /// Names of the columns of tables that have no header, as in t_s,x_mm,F_N
    #[arg(long, value_name = "NAMES")]
    columns: Option<String>,
    /// Draw loops, peaks, shift and relaxation of a single source as a new SVG file
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("this is not a positive number; write it like 0.75".into()),
    }
}

pub(super) fn run(args: &AnalyseArgs, output: &Output) -> Result<(), Failure> {
    if args.plot.is_some() && args.sources.len() > 1 {
        return Err(Failure::usage(
            "a plot shows one source; give one, or leave out --plot",
        ));
    }
    new_file::check("plot", args.plot.as_deref())?;
    let columns = args.columns.as_deref().map(str::parse).transpose();
    let columns = columns.map_err(|reason| Failure::usage(format!("--columns: {reason}")))?;
    let body = args
        .validate
        .as_deref()
        .map(|path| fitted(path, columns.as_ref()));
    let question = Question {
        at: args.at.map(Depth),
        rule: SteadyRule {
            percent: args.steady,
            ..SteadyRule::default()
        },
        frequency: args.frequency,
        body: body.transpose()?,
    };
    let mut reports = Vec::new();
    let bar = output.count_bar(args.sources.len() as u64);
    for path in &args.sources {
        let source = cycles::read(path, columns.as_ref()).map_err(source_failure)?;
        let report = CycleReport::of(path.display().to_string(), source, &question);
        if report.cycles.is_empty() && report.sines.is_empty() {
            return Err(Failure::failed(format!(
                "no way in with at least 20 samples was found in {}; record one, or name the frequency of a sine",
                path.display()
            )));
        }
        reports.push(report);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let fitted = args
        .validate
        .as_ref()
        .map(|path| path.display().to_string());
    output.object(&object(&reports, fitted.as_deref()));
    output.text_only(|| {
        let parts: Vec<String> = reports.iter().map(whole).collect();
        parts.join("\n\n")
    });
    new_file::write("plot", args.plot.as_deref(), || picture(&reports[0]))
}

/// The body to predict with: as it was fitted, or fitted now.
fn fitted(path: &Path, columns: Option<&ColumnNames>) -> Result<ModifiedKelvin, Failure> {
    if path.extension().is_some_and(|ending| ending == "json") {
        return last_fit::read(path)?.body().map_err(Failure::usage);
    }
    let source = source::read_named(path, columns).map_err(source_failure)?;
    let report = fit(&source.samples, &FitOptions::default())
        .map_err(|err| Failure::failed(format!("{} cannot be fitted: {err}", path.display())))?;
    report
        .kelvin()
        .ok_or_else(|| Failure::failed("the fit is of another body"))
}
