//! `palpate select`: model families compared on sessions and tables.

use super::Failure;
use super::fit::sources::{self, Recording};
use super::new_file;
use super::output::Output;
use clap::Args;
use palpate_analysis::compliance::Corrections;
use palpate_analysis::report::{of_selection, selection};
use palpate_analysis::source::{Stretch, Wanted};
use palpate_rheology::families::by_key;
use palpate_rheology::fit::FitSample;
use palpate_rheology::select::{SelectError, SelectOptions, Selection, select};
use palpate_runner::Stopwatch;
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// Arguments of `palpate select`.
#[derive(Debug, Args)]
pub struct SelectArgs {
    /// Session folders, delimited tables with columns for time, depth and force, or folders of them;
    /// all are taken for presses of one body
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// Error of force that does not matter: newtons (0.05N), percent of the peak force (1%) or
    /// percent of what a hand notices (10%jnd)
    #[arg(long, value_name = "ERROR")]
    tolerance: Option<String>,
    /// What is held out and predicted: auto (each record in turn; of one record its last part),
    /// speed, depth, specimen or none
    #[arg(long, value_name = "WHAT", default_value = "auto")]
    hold_out: String,
    /// The specimen of each source in turn, as in S1,S1,S2; without it what sessions say of themselves
    #[arg(long, value_name = "NAMES")]
    specimens: Option<String>,
    /// Families to compare, as in kelvin,series-3,prony-2; all without it
    #[arg(long, value_name = "NAMES")]
    families: Option<String>,
    /// Names of the columns of tables that have no header, as in t_s,x_mm,F_N
    #[arg(long, value_name = "NAMES")]
    columns: Option<String>,
    /// Compare the way back too, where it was recorded
    #[arg(long)]
    unload: bool,
    /// Take sessions though they were rejected
    #[arg(long)]
    include_rejected: bool,
    /// Draw error over cost as a new SVG file
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Serialize)]
struct SelectOutput<'a> {
    command: &'static str,
    #[serde(flatten)]
    selection: &'a Selection,
    /// The comparison alone, without reading.
    seconds: f64,
}

pub(super) fn run(args: &SelectArgs, output: &Output) -> Result<(), Failure> {
    let mut options = options(args)?;
    let columns = args.columns.as_deref().map(str::parse).transpose();
    let columns = columns.map_err(|reason| Failure::usage(format!("--columns: {reason}")))?;
    new_file::check("plot", args.plot.as_deref())?;
    let found = sources::find(&args.sources, output)?;
    let wanted = Wanted {
        stretch: match args.unload {
            true => Stretch::WithUnload,
            false => Stretch::RampHold,
        },
        is_rejected_included: args.include_rejected,
    };
    let records = sources::read(
        &found,
        columns.as_ref(),
        wanted,
        &Corrections::none(None),
        output,
    )?;
    options.specimens = specimens(args, &records)?;
    let borrowed: Vec<(&str, &[FitSample])> = records.iter().map(Recording::borrowed).collect();
    let bar = output.count_bar(0);
    let watch = Stopwatch::start();
    let selection = select(&borrowed, &options, &|news| {
        bar.set_length(news.total as u64);
        bar.set_position(news.done as u64);
        bar.set_message(news.family.clone());
        ControlFlow::Continue(())
    });
    let seconds = watch.seconds();
    bar.finish_and_clear();
    let selection = selection.map_err(|err| match err {
        SelectError::HoldOut(_) | SelectError::NoFamilies | SelectError::NoRecords => {
            Failure::usage(err)
        }
        SelectError::Fit(_) | SelectError::Ended => Failure::failed(err),
    })?;
    let object = SelectOutput {
        command: "select",
        selection: &selection,
        seconds,
    };
    output.result(&object, || selection::whole(&selection));
    new_file::write("plot", args.plot.as_deref(), || of_selection(&selection))
}

fn options(args: &SelectArgs) -> Result<SelectOptions, Failure> {
    let mut options = SelectOptions {
        hold_out: args.hold_out.parse().map_err(Failure::usage)?,
        ..SelectOptions::default()
    };
    let tolerance = args.tolerance.as_deref().map(str::parse).transpose();
    options.tolerance = tolerance.map_err(Failure::usage)?;
    if let Some(names) = &args.families {
        let mut keys: Vec<&str> = Vec::new();
        for key in names.split(',').map(str::trim) {
            if !keys.contains(&key) {
                keys.push(key);
            }
        }
        let families = keys.into_iter().map(by_key).collect::<Result<_, _>>();
        options.families = families.map_err(Failure::usage)?;
    }
    Ok(options)
}

/// The specimen of each record: as given, or as the sources say.
fn specimens(args: &SelectArgs, records: &[Recording]) -> Result<Vec<Option<String>>, Failure> {
    let Some(names) = &args.specimens else {
        return Ok(records.iter().map(|one| one.specimen.clone()).collect());
    };
    let names: Vec<&str> = names.split(',').map(str::trim).collect();
    if names.len() != records.len() || names.contains(&"") {
        return Err(Failure::usage(format!(
            "--specimens names {} and there are {} sources; give one name for each",
            names.iter().filter(|name| !name.is_empty()).count(),
            records.len()
        )));
    }
    Ok(names
        .into_iter()
        .map(|name| Some(name.to_owned()))
        .collect())
}
