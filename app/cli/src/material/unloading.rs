//! `palpate material --property unloading`.

use super::super::Failure;
use super::super::output::Output;
use palpate_analysis::material::MaterialRequest;
use palpate_analysis::report::unloading::unloading_text;
use palpate_analysis::unloading::{UnloadingError, unloading};
use palpate_indentation::UnloadingFitError;

pub(super) fn run(press: &MaterialRequest, output: &Output) -> Result<(), Failure> {
    let report = unloading(press).map_err(failure)?;
    report.notes.iter().for_each(|note| output.note(note));
    output.answer("material", &report, || unloading_text(&report));
    Ok(())
}

fn failure(err: UnloadingError) -> Failure {
    match err {
        UnloadingError::Press(err) => super::failure(err),
        UnloadingError::ContactFree => Failure::usage(format!("{err} (--contact-error MM)")),
        UnloadingError::Fit(err @ UnloadingFitError::Contact(_)) => Failure::usage(err),
        // The record has no answer, whatever is given.
        UnloadingError::Fit(err) => Failure::failed(err),
    }
}
