//! `palpate extremes`: numerical stability where numbers end.

use super::Failure;
use super::output::Output;
use crate::report::extremes::{page, text};
use clap::Args;
use palpate_model::extremes::{Extent, Row, Verdict, parts};
use serde::Serialize;
use std::path::PathBuf;

/// Steps of the progress bar in one part.
const FINENESS: u64 = 100;

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
    let parts = parts(extent, args.family.as_deref()).map_err(Failure::usage)?;
    let bar = output.share_bar(parts.len() as u64 * FINENESS);
    let mut rows = Vec::new();
    for (index, part) in (0..).zip(&parts) {
        bar.set_message(format!("{}: {}", part.group, part.subject));
        rows.extend(part.rows(|share| {
            bar.set_position(index * FINENESS + (share * FINENESS as f64) as u64);
        }));
    }
    bar.finish_and_clear();
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
    if let Some(file) = &args.page {
        std::fs::write(file, page(&rows)).map_err(|err| {
            Failure::failed(format!(
                "the page could not be written to {}: {err}; choose another place",
                file.display()
            ))
        })?;
    }
    if wrong > 0 {
        return Err(Failure::failed(format!(
            "{wrong} of {} rows are wrong; they are marked WRONG above, please report them",
            rows.len()
        )));
    }
    Ok(())
}
