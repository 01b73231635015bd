//! `palpate extremes`: numerical stability where numbers end.

use super::Failure;
use super::new_file;
use super::output::Output;
use clap::Args;
use palpate_analysis::extremes::survey;
use palpate_analysis::report::extremes::{PAGE_HEAD, page, text};
use palpate_rheology::extremes::{Extent, Row, Verdict};
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Arguments of `palpate extremes`.
#[derive(Debug, Args)]
pub struct ExtremesArgs {
    /// Corners and middles of every table only, in seconds
    #[arg(long, conflicts_with = "soak")]
    quick: bool,
    /// The longest records for every family too, in tens of minutes
    #[arg(long)]
    soak: bool,
    /// One family and its fit, such as series-3
    #[arg(long, value_name = "KEY")]
    family: Option<String>,
    /// Write the page with all tables here
    #[arg(long, value_name = "FILE.md")]
    page: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Serialize)]
struct Extremes<'a> {
    command: &'static str,
    extent: &'static str,
    right: usize,
    refused: usize,
    flagged: usize,
    wrong: usize,
    rows: &'a [Row],
}

pub(super) fn run(args: &ExtremesArgs, output: &Output) -> Result<(), Failure> {
    let (extent, name) = match (args.quick, args.soak) {
        (true, _) => (Extent::Quick, "quick"),
        (false, true) => (Extent::Soak, "soak"),
        (false, false) => (Extent::Whole, "whole"),
    };
    if !args.page.as_deref().is_some_and(is_own_page) {
        new_file::check("page", args.page.as_deref())?;
    }
    let bar = output.share_bar(0);
    let rows = survey(extent, args.family.as_deref(), &|done, of, what| {
        bar.set_length(of as u64);
        bar.set_position(done as u64);
        bar.set_message(what.to_owned());
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    // Nobody ends it early here, so there is always an answer.
    let rows = rows.map_err(Failure::usage)?.unwrap_or_default();
    let count = |verdict| rows.iter().filter(|row| row.verdict == verdict).count();
    let wrong = count(Verdict::Wrong);
    output.result(
        &Extremes {
            command: "extremes",
            extent: name,
            right: count(Verdict::Right),
            refused: count(Verdict::Refused),
            flagged: count(Verdict::Flagged),
            wrong,
            rows: &rows,
        },
        || text(&rows),
    );
    new_file::write("page", args.page.as_deref(), || page(&rows))?;
    if wrong > 0 {
        return Err(Failure::failed(format!(
            "{wrong} of {} rows are wrong; they are marked WRONG above, please report them",
            rows.len()
        )));
    }
    Ok(())
}

/// Whether a file is a page that this command wrote: that one may be written anew.
fn is_own_page(file: &Path) -> bool {
    std::fs::read_to_string(file).is_ok_and(|text| text.starts_with(PAGE_HEAD))
}
