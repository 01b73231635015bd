//! `palpate select`: model families compared on sessions and tables.

use super::arguments::parse_columns;
use super::new_file;
use super::output::Output;
use super::{Failure, sources_failure};
use clap::Args;
use palpate_analysis::recordings::RecordingNames;
use palpate_analysis::report::{of_selection, selection};
use palpate_analysis::select::{ModelSelectionError, SelectRequest, select_sources};
use palpate_analysis::source::{RecordStretch, SourceSelection};
use palpate_rheology::families::find_family;
use palpate_rheology::select::{SelectError, SelectOptions};
use std::path::PathBuf;

/// Compare model families and recommend the cheapest adequate one
#[derive(Debug, Args)]
pub struct SelectArgs {
    /// Session folders, delimited tables with columns for time, depth and force, or folders of them;
    /// all are taken as presses on one material
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// Negligible error of force: newtons (0.05N), percent of the peak force (1%) or
    /// percent of what a hand notices (10%jnd)
    #[arg(long, value_name = "ERROR")]
    tolerance: Option<String>,
    /// What is held out and predicted: auto (each record in turn, or the last part of a single record),
    /// speed, depth, specimen or none
    #[arg(long, value_name = "WHAT", default_value = "auto")]
    hold_out: String,
    /// The specimen of each source in turn, as in S1,S1,S2; without it as the sessions state
    #[arg(long, value_name = "NAMES")]
    specimens: Option<String>,
    /// Families to compare, as in kelvin,series-3,prony-2; all without it
    #[arg(long, value_name = "NAMES")]
    families: Option<String>,
    /// Names of the columns of tables that have no header, as in t_s,x_mm,F_N
    #[arg(long, value_name = "NAMES")]
    columns: Option<String>,
    /// Compare unloading too, where it was recorded
    #[arg(long)]
    unload: bool,
    /// Include rejected sessions
    #[arg(long)]
    include_rejected: bool,
    /// Draw error over cost as a new SVG file
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
}

pub(super) fn run(args: &SelectArgs, output: &Output) -> Result<(), Failure> {
    let names = args.specimens.as_ref();
    let request = SelectRequest {
        paths: args.sources.clone(),
        columns: parse_columns(args.columns.as_deref())?,
        wanted: SourceSelection {
            stretch: RecordStretch::with_unload(args.unload),
            is_rejected_included: args.include_rejected,
        },
        options: options(args)?,
        specimens: names.map(|names| names.split(',').map(|name| name.trim().to_owned()).collect()),
        naming: RecordingNames::Path,
    };
    new_file::check("plot", args.plot.as_deref())?;
    let selected = select_sources(request, &output.count_bar(0)).map_err(failure)?;
    selected.notes.iter().for_each(|note| output.note(note));
    let selection = &selected.selection;
    let mut object = serde_json::json!(selection);
    object["seconds"] = selected.seconds.into();
    output.answer("select", &object, || selection::selection_text(selection));
    new_file::write("plot", args.plot.as_deref(), || of_selection(selection))
}

fn failure(err: ModelSelectionError) -> Failure {
    match err {
        ModelSelectionError::Sources(err) => sources_failure(err),
        ModelSelectionError::Specimens { .. } => Failure::usage(format!("--specimens: {err}")),
        ModelSelectionError::Select(SelectError::Fit(_) | SelectError::Ended) => {
            Failure::failed(err)
        }
        err => Failure::usage(err),
    }
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
        let families = keys.into_iter().map(find_family).collect::<Result<_, _>>();
        options.families = families.map_err(Failure::usage)?;
    }
    Ok(options)
}
