//! `palpate material --property master-curve`.

use super::super::Failure;
use super::super::output::Output;
use super::dynamic;
use palpate_analysis::dynamic::{MasterCurveError, MasterCurveRequest, master_curve};
use palpate_analysis::report::master_curve::master_curve_text;

pub(super) fn run(request: &MasterCurveRequest, output: &Output) -> Result<(), Failure> {
    let report = master_curve(request).map_err(failure)?;
    report.notes.iter().for_each(|note| output.note(note));
    output.answer("material", &report, || master_curve_text(&report));
    Ok(())
}

fn failure(err: MasterCurveError) -> Failure {
    match err {
        MasterCurveError::Sweep { path, reason } => {
            dynamic::failure(*reason).prefixed(&path.display().to_string())
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
