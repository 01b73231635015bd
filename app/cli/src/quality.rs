//! `palpate quality`: the checks of a run, each a rank and a sentence.

use super::Failure;
use super::output::Output;
use clap::Args;
use palpate_analysis::fit::FitRecipe;
use palpate_analysis::run_quality::{AssessedRun, assess_folder};
use palpate_analysis::source::{SourceError, SourceSelection};
use palpate_rheology::fit::FitOptions;
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
    let mut recipe = FitRecipe::new(FitOptions::default(), SourceSelection::default());
    // The checks look at the force, not at the intervals.
    recipe.is_systematic = false;
    let assessed = assess_folder(&args.session, library.as_deref(), &recipe);
    let AssessedRun { quality, fitted, .. } = assessed.map_err(super::source_failure)?;
    match fitted {
        // A run that pressed nothing has no force to look at.
        Ok(_) | Err(SourceError::Empty) => {}
        Err(error) => return Err(super::source_failure(error)),
    }
    let object = serde_json::json!({
        "session": args.session, "rank": quality.rank(), "checks": quality.checks,
    });
    output.answer("quality", &object, || quality.text());
    Ok(())
}
