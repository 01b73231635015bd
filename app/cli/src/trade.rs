//! `palpate trade`: error against computing time on this machine, and a recommendation.

use super::Failure;
use super::arguments::above_zero;
use super::new_file;
use super::output::Output;
use clap::Args;
use palpate_analysis::progress::Progress;
use palpate_analysis::trade::stored::{
    quick_trade_file, read_trade, trade_file, trade_files, write_trade,
};
use palpate_analysis::trade::{self, TradeExtent};
use palpate_rheology::tolerance::Tolerance;
use palpate_rheology::trade::TradeCurves;
use palpate_sessions::library_folder;
use std::path::{Path, PathBuf};

/// Measure error against time on this machine and recommend what to use
#[derive(Debug, Args)]
pub struct TradeArgs {
    /// Largest acceptable error of force: newtons (0.05N), percent of the peak force (1%) or percent of what a hand notices (10%jnd)
    #[arg(long, value_name = "N|%|%jnd", default_value = "1%")]
    tolerance: String,
    /// Updates of the force per second
    #[arg(long, value_name = "HZ", default_value = "1000")]
    rate: f64,
    /// Share of each period for computing the force, in percent
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

pub(super) fn run(args: &TradeArgs, output: &Output) -> Result<(), Failure> {
    let tolerance: Tolerance = args.tolerance.parse().map_err(Failure::usage)?;
    // A gigahertz is a period of three clock cycles.
    above_zero("rate", args.rate, 1e9, "Hz")?;
    above_zero("share", args.share, 100.0, "%")?;
    new_file::check("plot", args.plot.as_deref())?;
    let library = match &args.store {
        Some(folder) => folder.clone(),
        None => library_folder().map_err(Failure::usage)?,
    };
    let (curves, file) = if args.show || args.check {
        stored(&library)?
    } else {
        let curves = measured(args.quick, output)?;
        let file = write_trade(&library, &curves).map_err(Failure::failed)?;
        (curves, file)
    };
    let doubts = curves.doubts(&trade::this_machine(), trade::version(), trade::age_days(&curves));
    doubts.iter().for_each(|doubt| output.note(doubt));
    if args.check {
        check(&curves, output)?;
    }
    let recommendation = curves.recommend(tolerance, args.rate, args.share / 100.0);
    let object = serde_json::json!({
        "file": file.display().to_string(), "doubts": doubts, "halves_worst": curves.worst_halves(),
        "recommendation": recommendation, "curves": curves,
    });
    output.answer("trade", &object, || trade::text(&curves, &recommendation));
    new_file::write("plot", args.plot.as_deref(), || trade::svg(&curves))
}

fn measured(is_quick: bool, output: &Output) -> Result<TradeCurves, Failure> {
    let extent = if is_quick { TradeExtent::Quick } else { TradeExtent::Full };
    with_bar(output, |progress| trade::measure(extent, progress))
}

/// Runs work with a progress bar.
pub(super) fn with_bar<T>(
    output: &Output,
    work: impl FnOnce(&dyn Progress) -> Result<Option<T>, String>,
) -> Result<T, Failure> {
    let curves = work(&output.count_bar(0));
    let curves = curves.map_err(Failure::failed)?;
    curves.ok_or_else(|| Failure::failed("the measurement ended early; start it again"))
}

/// The curves of this machine, or else any there are.
fn stored(library: &Path) -> Result<(TradeCurves, PathBuf), Failure> {
    let here = trade::this_machine();
    let own = [trade_file(library, &here), quick_trade_file(library, &here)];
    let own = own.into_iter().find(|file| file.exists());
    let file = own.or_else(|| trade_files(library).into_iter().next()).ok_or_else(|| {
        Failure::usage(format!(
            "no curves are stored in {}; measure the curves with 'palpate trade'",
            library.display()
        ))
    })?;
    let curves = read_trade(&file).map_err(Failure::failed)?;
    Ok((curves, file))
}

fn check(curves: &TradeCurves, output: &Output) -> Result<(), Failure> {
    let extent = if curves.quick { TradeExtent::Quick } else { TradeExtent::Full };
    let now = with_bar(output, |progress| trade::errors(extent, progress))?;
    curves.agrees_with(&now).map_err(Failure::failed)?;
    output.note("every stored error was reproduced");
    Ok(())
}
