//! `palpate trade`: error against time on this machine, and what to use.

use super::Failure;
use super::new_file;
use super::output::Output;
use clap::Args;
use palpate_analysis::progress::Progress;
use palpate_analysis::trade::stored::{
    TradeFileError, quick_trade_file, read_trade, trade_file, trade_files, write_trade,
};
use palpate_analysis::trade::{self, Extent};
use palpate_rheology::tolerance::Tolerance;
use palpate_rheology::trade::{Recommendation, TradeCurves};
use palpate_sessions::library_folder;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Measure error against time on this machine and recommend what to use
#[derive(Debug, Args)]
pub struct TradeArgs {
    /// How large an error of force may be: newtons (0.05N), percent of the peak force (1%) or percent of what a hand notices (10%jnd)
    #[arg(long, value_name = "N|%|%jnd", default_value = "1%")]
    tolerance: String,
    /// Updates of the force per second
    #[arg(long, value_name = "HZ", default_value = "1000")]
    rate: f64,
    /// Percent of each period that the force may take
    #[arg(long, value_name = "PERCENT", default_value = "10")]
    share: f64,
    /// Few rows and rough times
    #[arg(long)]
    quick: bool,
    /// Print the stored curves instead of measuring
    #[arg(long, conflicts_with = "quick")]
    show: bool,
    /// Compute the errors of the stored curves again and compare
    #[arg(long, conflicts_with_all = ["quick", "show"])]
    check: bool,
    /// Folder for the curves; without it the library
    #[arg(long, value_name = "FOLDER")]
    store: Option<PathBuf>,
    /// Also draw error against time
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
}

#[derive(Serialize)]
struct TradeReport<'a> {
    file: String,
    doubts: Vec<String>,
    /// Largest difference between even and odd rounds, as a share.
    halves_worst: f64,
    recommendation: Recommendation,
    curves: &'a TradeCurves,
}

pub(super) fn run(args: &TradeArgs, output: &Output) -> Result<(), Failure> {
    let tolerance: Tolerance = args.tolerance.parse().map_err(Failure::usage)?;
    let in_range = |name: &str, value: f64, high: f64| {
        (value > 0.0 && value <= high).then_some(()).ok_or_else(|| {
            Failure::usage(format!(
                "--{name} {value} is not possible; give a number above 0 and up to {high}"
            ))
        })
    };
    // A gigahertz is a period of three cycles: nobody waits for that.
    in_range("rate", args.rate, 1e9)?;
    in_range("share", args.share, 100.0)?;
    new_file::check("plot", args.plot.as_deref())?;
    let library = match &args.store {
        Some(folder) => folder.clone(),
        None => library_folder().map_err(Failure::usage)?,
    };
    let (curves, file) = if args.show || args.check {
        stored(&library)?
    } else {
        let curves = measured(args.quick, output)?;
        let file = write_trade(&library, &curves).map_err(failure)?;
        (curves, file)
    };
    let doubts = curves.doubts(&trade::this_machine(), trade::version(), trade::age_days(&curves));
    doubts.iter().for_each(|doubt| output.note(doubt));
    if args.check {
        check(&curves, output)?;
    }
    let recommendation = curves.recommend(tolerance, args.rate, args.share / 100.0);
    let report = TradeReport {
        file: file.display().to_string(),
        doubts,
        halves_worst: curves.worst_halves(),
        recommendation,
        curves: &curves,
    };
    output.answer("trade", &report, || trade::text(&curves, &report.recommendation));
    new_file::write("plot", args.plot.as_deref(), || trade::svg(&curves))
}

fn measured(is_quick: bool, output: &Output) -> Result<TradeCurves, Failure> {
    let extent = if is_quick { Extent::Quick } else { Extent::Full };
    with_bar(output, |progress| trade::measure(extent, progress))
}

/// Work with a progress bar that nobody ends early.
pub(super) fn with_bar<T>(
    output: &Output,
    work: impl FnOnce(&dyn Progress) -> Result<Option<T>, String>,
) -> Result<T, Failure> {
    let curves = work(&output.count_bar(0));
    let curves = curves.map_err(Failure::failed)?;
    curves.ok_or_else(|| Failure::failed("the measurement ended before it was done"))
}

/// The curves of this machine, or else any there are.
fn stored(library: &Path) -> Result<(TradeCurves, PathBuf), Failure> {
    let here = trade::this_machine();
    let own = [trade_file(library, &here), quick_trade_file(library, &here)];
    let own = own.into_iter().find(|file| file.exists());
    let file = own.or_else(|| trade_files(library).into_iter().next()).ok_or_else(|| {
        Failure::usage(format!(
            "no curves are stored in {}; measure with 'palpate trade'",
            library.display()
        ))
    })?;
    let curves = read_trade(&file).map_err(failure)?;
    Ok((curves, file))
}

fn check(curves: &TradeCurves, output: &Output) -> Result<(), Failure> {
    let extent = if curves.quick { Extent::Quick } else { Extent::Full };
    let now = with_bar(output, |progress| trade::errors(extent, progress))?;
    curves.agrees_with(&now).map_err(Failure::failed)?;
    output.note("every stored error was found again");
    Ok(())
}

fn failure(err: TradeFileError) -> Failure {
    Failure::failed(err)
}
