//! `palpate extremes`: numerical stability at extreme values.

use super::Failure;
use super::new_file;
use super::output::Output;
use clap::Args;
use palpate_analysis::extremes::{ExtremesError, survey};
use palpate_analysis::report::extremes::{PAGE_HEAD, page, text};
use palpate_rheology::extremes::{ExtremesExtent, ExtremesVerdict};
use palpate_sessions::atomic::replace;
use std::path::{Path, PathBuf};

/// Test numerical stability at the extremes, every family, integrator and fit
#[derive(Debug, Args)]
pub struct ExtremesArgs {
    /// Only corners and centres of every table; takes seconds
    #[arg(long, conflicts_with = "soak")]
    quick: bool,
    /// Also the longest records for every family; takes tens of minutes
    #[arg(long)]
    soak: bool,
    /// One family and its fit, such as series-3
    #[arg(long, value_name = "KEY")]
    family: Option<String>,
    /// Write the page with all tables here
    #[arg(long, value_name = "FILE.md")]
    page: Option<PathBuf>,
}

pub(super) fn run(args: &ExtremesArgs, output: &Output) -> Result<(), Failure> {
    let (extent, name) = match (args.quick, args.soak) {
        (true, _) => (ExtremesExtent::Quick, "quick"),
        (false, true) => (ExtremesExtent::Soak, "soak"),
        (false, false) => (ExtremesExtent::Whole, "whole"),
    };
    let own_page = args.page.as_deref().filter(|file| is_own_page(file));
    if own_page.is_none() {
        new_file::check("page", args.page.as_deref())?;
    }
    let rows = survey(extent, args.family.as_deref(), &output.share_bar());
    // Only cancelling gives no rows, and a progress bar never cancels.
    let rows = rows.map_err(|err| match err {
        ExtremesError::Family(err) => Failure::usage(err),
        err => Failure::failed(err),
    });
    let rows = rows?.unwrap_or_default();
    let count = |verdict| rows.iter().filter(|row| row.verdict == verdict).count();
    let wrong = count(ExtremesVerdict::Wrong);
    let object = serde_json::json!({
        "extent": name, "right": count(ExtremesVerdict::Right), "refused": count(ExtremesVerdict::Refused),
        "flagged": count(ExtremesVerdict::Flagged), "wrong": wrong, "rows": rows,
    });
    output.answer("extremes", &object, || text(&rows));
    match own_page {
        Some(file) => replace(file, page(&rows).as_bytes()).map_err(|err| {
            Failure::failed(format!(
                "the page {} cannot be replaced ({err}); check its permissions",
                file.display()
            ))
        })?,
        None => new_file::write("page", args.page.as_deref(), || page(&rows))?,
    }
    if wrong > 0 {
        return Err(Failure::failed(format!(
            "{wrong} of {} rows are wrong; report the rows marked WRONG above",
            rows.len()
        )));
    }
    Ok(())
}

/// Whether this command wrote the file, so that it may replace it.
fn is_own_page(file: &Path) -> bool {
    std::fs::read_to_string(file).is_ok_and(|text| text.starts_with(PAGE_HEAD))
}
