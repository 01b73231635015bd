//! `palpate quality`: the checks of a run, each a rank and a sentence.

use super::Failure;
use super::output::Output;
use clap::Args;
use palpate_analysis::run_quality;
use palpate_sessions::library_folder;
use std::path::PathBuf;

/// Check a run as a good operator does: contact, noise, drift, force drops, lack of fit and more
#[derive(Debug, Args)]
pub struct QualityArgs {
    /// Session folder
    session: PathBuf,
}

pub(super) fn run(args: &QualityArgs, output: &Output) -> Result<(), Failure> {
    // The library has the daily checks of the rig, which say what noise is usual.
    let library = library_folder().ok();
    let quality = run_quality::of_folder(&args.session, library.as_deref());
    let quality = quality.map_err(super::source_failure)?;
    let object = serde_json::json!({
        "session": args.session, "rank": quality.rank(), "checks": quality.checks,
    });
    output.answer("quality", &object, || quality.text());
    Ok(())
}
