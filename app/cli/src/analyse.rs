//! `palpate analyse`: loops, shift, decay and relaxation of cycles.

use super::arguments::{parse_columns, positive};
use super::output::Output;
use super::{Failure, known_fit_failure, new_file, source_failure};
use clap::Args;
use palpate_analysis::cycle_analysis::{CycleAnalysisError, analyse};
use palpate_analysis::fit::KnownFit;
use palpate_analysis::report::cycles::{CycleSettings, cycles_text, object, picture};
use palpate_model::units::Depth;
use palpate_rheology::cycles::SteadyRule;
use std::path::PathBuf;

/// Analyse the cycles of a record: hysteresis loops, shift, peak decay, relaxation
#[derive(Debug, Args)]
pub struct AnalyseArgs {
    /// Session folders, or delimited tables with columns for time, depth and force
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// Depth in mm at which the stiffness is reported; without it 80 % of the depth of the first cycle
    #[arg(long, value_name = "MM", value_parser = positive)]
    at: Option<f64>,
    /// Cycles are steady when peak and shift change by less than this percentage, twice in a row
    #[arg(long, value_name = "PERCENT", default_value = "1", value_parser = positive)]
    steady: f64,
    /// Treat a table as one sine of this frequency in Hz; a session has its own
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
}

pub(super) fn run(args: &AnalyseArgs, output: &Output) -> Result<(), Failure> {
    if args.plot.is_some() && args.sources.len() > 1 {
        return Err(Failure::usage(
            "--plot draws one source; give one source, or leave out --plot",
        ));
    }
    new_file::check("plot", args.plot.as_deref())?;
    let columns = parse_columns(args.columns.as_deref())?;
    let fitted = args.validate.as_deref();
    let fitted = fitted.map(|path| KnownFit::of(path, columns.as_ref())?.0.body());
    let question = CycleSettings {
        at: args.at.map(Depth),
        rule: SteadyRule { percent: args.steady, ..SteadyRule::default() },
        frequency: args.frequency,
        body: fitted.transpose().map_err(known_fit_failure)?,
    };
    let bar = output.count_bar(0);
    let reports = analyse(&args.sources, columns.as_ref(), &question, &bar);
    drop(bar);
    let reports = reports.map_err(|err| match err {
        CycleAnalysisError::Source(err) => source_failure(err),
        err => Failure::failed(err),
    })?;
    let fitted = args.validate.as_ref().map(|path| path.display().to_string());
    output.object(&object(&reports, fitted.as_deref()));
    output.text_only(|| {
        let parts: Vec<String> = reports.iter().map(cycles_text).collect();
        parts.join("\n\n")
    });
    new_file::write("plot", args.plot.as_deref(), || picture(&reports[0]))
}
