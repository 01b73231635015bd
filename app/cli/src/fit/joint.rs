//! Fits several sources together, with some parameters shared.

use super::super::{Failure, output::Output, sources_failure};
use super::{FitArgs, intervals};
use palpate_analysis::fit::{FitRecipe, JointFitRequest, fit_together};
use palpate_analysis::recordings::{self, RecordingNames, RecordingOptions};
use palpate_analysis::report::text;
use palpate_rheology::fit::FitError;

/// `shared` is a list of names with commas, the whole model without it.
pub(super) fn run(
    args: &FitArgs,
    shared: Option<&str>,
    recipe: &FitRecipe,
    output: &Output,
) -> Result<(), Failure> {
    let found = recordings::find(&args.sources).map_err(sources_failure)?;
    found.note().iter().for_each(|note| output.note(note));
    if shared.is_some() && found.paths.len() < 2 {
        return Err(Failure::usage(
            "--share needs at least two recordings; give each recording, or their folder",
        ));
    }
    let reading = RecordingOptions {
        columns: recipe.columns.as_ref(),
        wanted: recipe.selection,
        corrections: &recipe.corrections,
        naming: RecordingNames::Path,
    };
    let mut records = recordings::read(&found.paths, reading).map_err(sources_failure)?;
    records.notes.iter().for_each(|note| output.note(note));
    let request = JointFitRequest {
        options: &recipe.options,
        shared: shared.unwrap_or("body").split(',').map(str::trim).collect(),
        is_systematic: recipe.is_systematic,
        intervals: intervals::wanted(args),
    };
    let bar = intervals::bar(args, output);
    let fitted = fit_together(&mut records, &request, |_, done| intervals::show(&bar, done));
    drop(bar);
    let fitted = fitted.map_err(|err| match err {
        FitError::NotShareable { .. } | FitError::UnknownParameter { .. } => Failure::usage(err),
        _ => Failure::failed(err),
    })?;
    fitted.notes.iter().for_each(|note| output.note(note));
    let extras = fitted.details(&records);
    let object = fitted.object(&recipe.options, &extras);
    output.result(&object, || text::joint_fit_text(&fitted, &extras));
    Ok(())
}
