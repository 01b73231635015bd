//! `palpate material --property dynamic`.

use super::super::output::Output;
use super::super::{Failure, source_failure};
use palpate_analysis::dynamic::{DynamicError, DynamicRequest, dynamic};
use palpate_analysis::report::dynamic::dynamic_text;

pub(super) fn run(request: &DynamicRequest, output: &Output) -> Result<(), Failure> {
    let report = dynamic(request).map_err(failure)?;
    report.notes.iter().for_each(|note| output.note(note));
    output.answer("material", &report, || dynamic_text(&report));
    Ok(())
}

pub(super) fn failure(err: DynamicError) -> Failure {
    match err {
        DynamicError::Press(err) => super::failure(err),
        DynamicError::Source(err) => source_failure(err),
        DynamicError::ContactFree => Failure::usage(format!("{err} (--contact-error MM)")),
        DynamicError::NoFrequency | DynamicError::NoSine => {
            Failure::usage(format!("{err} (--frequency HZ)"))
        }
        // The record has no answer, whatever is given.
        err @ (DynamicError::Sine(_) | DynamicError::Amplitude { .. }) => Failure::failed(err),
        err => Failure::usage(err),
    }
}
