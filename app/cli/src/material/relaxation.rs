//! `palpate material --property relaxation`.

use super::super::Failure;
use super::super::output::Output;
use palpate_analysis::material::MaterialRequest;
use palpate_analysis::relaxation::{RelaxationError, RelaxationRequest, relaxation};
use palpate_analysis::report::relaxation::relaxation_text;
use palpate_indentation::{RelaxationFamily, RelaxationFitError};

pub(super) fn run(
    press: &MaterialRequest,
    family: Option<RelaxationFamily>,
    output: &Output,
) -> Result<(), Failure> {
    let report = relaxation(RelaxationRequest { press, family }).map_err(failure)?;
    report.notes.iter().for_each(|note| output.note(note));
    output.answer("material", &report, || relaxation_text(&report));
    Ok(())
}

fn failure(err: RelaxationError) -> Failure {
    match err {
        RelaxationError::Press(err) => super::failure(err),
        RelaxationError::ContactFree => Failure::usage(format!("{err} (--contact-error MM)")),
        err @ (RelaxationError::Fit(RelaxationFitError::TermCount { .. })
        | RelaxationError::History(_)
        | RelaxationError::ContactError { .. }) => Failure::usage(err),
        // The record has no answer, whatever is given.
        err => Failure::failed(err),
    }
}
