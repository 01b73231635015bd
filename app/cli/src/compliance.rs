//! `palpate compliance`: machine compliance of a rig, and the correction of depths by it.

use super::Failure;
use super::output::Output;
use clap::Args;
use palpate_analysis::compliance::{
    ComplianceCorrection, ComplianceCorrections, ComplianceMeasurementError, LATEST_COMPLIANCE,
    compliance_from_session,
};
use palpate_analysis::edited_session;
use palpate_model::rig::RigCompliance;
use palpate_model::units::Newtons;
use palpate_sessions::compliances::{ComplianceStore, StoredCompliance};
use palpate_sessions::document_store::{LibraryError, save_document, supersede_document};
use palpate_sessions::library_folder;
use std::path::PathBuf;

/// Measure the machine compliance of a rig, from a session of stiff-surface
#[derive(Debug, Args)]
pub struct ComplianceArgs {
    /// Session folder of a stiff-surface run
    session: PathBuf,
    /// Force in N from which the surfaces count as seated [default: 0.3 of the highest]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    seating: Option<f64>,
    /// Save it in the library and supersede the one in force for the rig
    #[arg(long)]
    save: bool,
}

pub(super) fn run(args: &ComplianceArgs, output: &Output) -> Result<(), Failure> {
    if let Some(seating) = args.seating
        && !(seating > 0.0 && seating.is_finite())
    {
        return Err(Failure::usage(format!(
            "a seating force of {seating} N is out of range; give a force above 0 N"
        )));
    }
    let edited = edited_session::open(&args.session).map_err(super::source_failure)?;
    edited.session.notes.iter().for_each(|note| output.note(note));
    if let Some(reason) = edited.rejection() {
        return Err(Failure::usage(format!(
            "the session was rejected ({reason}), so it gives no compliance; change the verdict with 'palpate verdict'"
        )));
    }
    let found =
        compliance_from_session(&edited.session, args.seating.map(Newtons)).map_err(failure)?;
    let saved = args.save.then(|| save_compliance(&found)).transpose()?;
    let document = saved.as_ref().map_or(&found, |saved| &saved.document);
    let object = serde_json::json!({
        "id": saved.as_ref().map(|saved| &saved.id),
        "file": saved.as_ref().map(|saved| saved.path.display().to_string()),
        "um_per_n": 1e3 * document.mm_per_n,
        "std_error_um_per_n": 1e3 * document.std_error_mm_per_n,
        "document": document,
    });
    output.answer("compliance", &object, || text(document, saved.as_ref()));
    Ok(())
}

/// Saves the compliance and supersedes the one in force for its rig.
fn save_compliance(found: &RigCompliance) -> Result<StoredCompliance, Failure> {
    let library = library_folder().map_err(Failure::usage)?;
    let saved = match ComplianceStore::open(&library).in_force(&found.rig) {
        Some(old) if is_same(&old.document, found) => {
            Err(LibraryError::AlreadyThere { kind: "compliance", id: old.id.clone() })
        }
        Some(old) => supersede_document(&library, &old.id, found),
        None => save_document(&library, found),
    };
    saved.map_err(|err| match err {
        LibraryError::Io { .. } => Failure::failed(err),
        _ => Failure::usage(err),
    })
}

/// Whether two are equal apart from what they supersede.
fn is_same(saved: &RigCompliance, found: &RigCompliance) -> bool {
    let saved = RigCompliance { supersedes: None, ..saved.clone() };
    saved == *found
}

fn text(found: &RigCompliance, saved: Option<&StoredCompliance>) -> String {
    let um = |mm: f64| 1e3 * mm;
    let mut lines = vec![
        format!(
            "machine compliance of rig {}: {:.6} ± {:.6} mm/N ({:.3} ± {:.3} µm/N)",
            found.rig,
            found.mm_per_n,
            found.std_error_mm_per_n,
            um(found.mm_per_n),
            um(found.std_error_mm_per_n)
        ),
        format!(
            "  surface at {:.4} ± {:.4} mm from home; residual about the fitted line {:.1} mN rms",
            found.surface_mm,
            found.surface_std_error_mm,
            1e3 * found.rmse_n
        ),
        format!(
            "  {} loading samples from {:.2} to {:.2} N, in {} presses",
            found.samples,
            found.seating_n,
            found.force_max_n,
            found.presses.len()
        ),
    ];
    lines.extend(found.presses.iter().map(|press| {
        format!(
            "  press {}: {:.3} ± {:.3} µm/N, {} samples",
            press.press,
            um(press.mm_per_n),
            um(press.std_error_mm_per_n),
            press.samples
        )
    }));
    lines.push(match saved {
        Some(saved) => format!("saved as {}, {}", saved.id, saved.path.display()),
        None => "not saved; add --save to store the compliance for 'palpate fit --compliance last'"
            .into(),
    });
    lines.join("\n")
}

/// A session of another kind is wrong use; a run without a result is a failure.
fn failure(err: ComplianceMeasurementError) -> Failure {
    match err {
        ComplianceMeasurementError::Source(err) => super::source_failure(err),
        ComplianceMeasurementError::NoSurface | ComplianceMeasurementError::Imported => {
            Failure::usage(err)
        }
        _ => Failure::failed(err),
    }
}

/// The correction of `--compliance`; without it depths stay raw, and a missing library is no error.
pub(super) fn corrections(name: Option<&str>) -> Result<ComplianceCorrections, Failure> {
    let library = library_folder();
    let Some(name) = name else {
        return Ok(ComplianceCorrections::none(library.ok().as_deref()));
    };
    let library = library.map_err(Failure::usage)?;
    ComplianceCorrections::named(name, Some(&library))
        .map_err(|err| super::source_failure(err.into()))
}

/// How a compliance changes depths, and the flag that applies it.
pub(super) fn correction_sentence(correction: &ComplianceCorrection) -> String {
    match correction.is_applied {
        true => correction.sentence(),
        false => format!("{} (--compliance {LATEST_COMPLIANCE})", correction.sentence()),
    }
}
