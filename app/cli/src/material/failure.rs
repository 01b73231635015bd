//! Why a property was not found, with the flags that help, and whether the use or the record is at fault.

use super::super::{Failure, source_failure};
use palpate_analysis::dynamic::{DynamicError, MasterCurveError};
use palpate_analysis::material::MaterialError;
use palpate_analysis::property::PropertyError;
use palpate_analysis::relaxation::RelaxationError;
use palpate_analysis::unloading::UnloadingError;
use palpate_indentation::{LoadingFitError, RelaxationFitError, UnloadingFitError};

pub fn of_property(err: PropertyError) -> Failure {
    match err {
        PropertyError::Modulus(err) => of_press(err),
        PropertyError::Unloading(err) => of_unloading(err),
        PropertyError::Relaxation(err) => of_relaxation(err),
        PropertyError::Dynamic(err) => of_dynamic(err),
    }
}

pub fn of_press(err: MaterialError) -> Failure {
    match err {
        MaterialError::Source(err) => source_failure(err),
        // The record has no answer, whatever is given.
        MaterialError::Fit(
            LoadingFitError::NoContact
            | LoadingFitError::ContactMoved { .. }
            | LoadingFitError::ZeroMoved { .. }
            | LoadingFitError::Samples { .. },
        ) => Failure::failed(err),
        MaterialError::TooDeep { reason, depth_max_mm } => Failure::usage(format!(
            "{reason}; for this indenter and specimen give --depth-max {depth_max_mm} or less"
        )),
        MaterialError::NoThickness => Failure::usage(format!("{err}; give --thickness")),
        err => Failure::usage(err),
    }
}

fn of_unloading(err: UnloadingError) -> Failure {
    match err {
        UnloadingError::Press(err) => of_press(err),
        UnloadingError::ContactFree => Failure::usage(format!("{err} (--contact-error MM)")),
        UnloadingError::Fit(err @ UnloadingFitError::Contact(_)) => Failure::usage(err),
        // The record has no answer, whatever is given.
        UnloadingError::Fit(err) => Failure::failed(err),
    }
}

fn of_relaxation(err: RelaxationError) -> Failure {
    match err {
        RelaxationError::Press(err) => of_press(err),
        RelaxationError::ContactFree => Failure::usage(format!("{err} (--contact-error MM)")),
        err @ (RelaxationError::Fit(RelaxationFitError::TermCount { .. })
        | RelaxationError::History(_)
        | RelaxationError::ContactError { .. }) => Failure::usage(err),
        // The record has no answer, whatever is given.
        err => Failure::failed(err),
    }
}

fn of_dynamic(err: DynamicError) -> Failure {
    match err {
        DynamicError::Press(err) => of_press(err),
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

pub fn of_master_curve(err: MasterCurveError) -> Failure {
    match err {
        MasterCurveError::Sweep { path, reason } => {
            of_dynamic(*reason).prefixed(&path.display().to_string())
        }
        MasterCurveError::Reference { .. } => {
            Failure::usage(format!("{err} (--reference-temperature CELSIUS)"))
        }
        MasterCurveError::NoTemperature(_) => {
            Failure::usage(format!("{err} (--about specimen.temperature_c=CELSIUS)"))
        }
        // The records have no answer, whatever is given.
        MasterCurveError::Superposition(_) => Failure::failed(err),
        err => Failure::usage(err),
    }
}
