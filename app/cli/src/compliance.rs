//! `palpate compliance`: how far a rig gives way under force, and what to take from its depths.

use super::Failure;
use super::output::Output;
use clap::Args;
use palpate_analysis::compliance::{Correction, Corrections, LAST, MeasureError, measured};
use palpate_analysis::edited;
use palpate_model::rig::RigCompliance;
use palpate_model::units::Newtons;
use palpate_sessions::compliances::{Kept, Shelf};
use palpate_sessions::library_folder;
use palpate_sessions::shelf::{LibraryError, save, supersede};
use serde::Serialize;
use std::path::PathBuf;

/// Find how far a rig gives way, from a session of stiff-surface
#[derive(Debug, Args)]
pub struct ComplianceArgs {
    /// Session folder of a stiff-surface run
    session: PathBuf,
    /// Force in N from which the surfaces count as seated [default: 0.3 of the highest]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    seating: Option<f64>,
    /// Keep it in the library, in the place of the one in force for the rig
    #[arg(long)]
    save: bool,
}

#[derive(Serialize)]
struct Report<'a> {
    /// Its id in the library, null where it was not kept.
    id: Option<&'a str>,
    file: Option<&'a PathBuf>,
    um_per_n: f64,
    std_error_um_per_n: f64,
    document: &'a RigCompliance,
}

pub(super) fn run(args: &ComplianceArgs, output: &Output) -> Result<(), Failure> {
    if let Some(seating) = args.seating
        && !(seating > 0.0 && seating.is_finite())
    {
        return Err(Failure::usage(format!(
            "a seating force of {seating} N is not possible; give one above 0 N"
        )));
    }
    let edited = edited::open(&args.session).map_err(super::source_failure)?;
    edited.session.notes.iter().for_each(|note| output.note(note));
    if let Some(reason) = edited.rejection() {
        return Err(Failure::usage(format!(
            "the session was rejected ({reason}) and tells no compliance; 'palpate verdict' changes the verdict"
        )));
    }
    let found = measured(&edited.session, args.seating.map(Newtons)).map_err(failure)?;
    let kept = args.save.then(|| keep(&found)).transpose()?;
    let document = kept.as_ref().map_or(&found, |kept| &kept.document);
    let report = Report {
        id: kept.as_ref().map(|kept| kept.id.as_str()),
        file: kept.as_ref().map(|kept| &kept.path),
        um_per_n: 1e3 * document.mm_per_n,
        std_error_um_per_n: 1e3 * document.std_error_mm_per_n,
        document,
    };
    output.answer("compliance", &report, || text(document, kept.as_ref()));
    Ok(())
}

/// Stores what was found, in the place of the one in force for its rig.
fn keep(found: &RigCompliance) -> Result<Kept, Failure> {
    let library = library_folder().map_err(Failure::usage)?;
    let kept = match Shelf::open(&library).in_force(&found.rig) {
        Some(old) if is_same(&old.document, found) => {
            Err(LibraryError::AlreadyThere { kind: "compliance", id: old.id.clone() })
        }
        Some(old) => supersede(&library, &old.id, found),
        None => save(&library, found),
    };
    kept.map_err(|err| match err {
        LibraryError::Io { .. } => Failure::failed(err),
        _ => Failure::usage(err),
    })
}

/// Whether two differ in nothing but whose place they take.
fn is_same(kept: &RigCompliance, found: &RigCompliance) -> bool {
    let kept = RigCompliance { supersedes: None, ..kept.clone() };
    kept == *found
}

fn text(found: &RigCompliance, kept: Option<&Kept>) -> String {
    let um = |mm: f64| 1e3 * mm;
    let mut lines = vec![
        format!(
            "rig {} gives way by {:.6} ± {:.6} mm/N ({:.3} ± {:.3} um/N)",
            found.rig,
            found.mm_per_n,
            found.std_error_mm_per_n,
            um(found.mm_per_n),
            um(found.std_error_mm_per_n)
        ),
        format!(
            "  surface at {:.4} ± {:.4} mm from home; forces {:.1} mN rms about the line",
            found.surface_mm,
            found.surface_std_error_mm,
            1e3 * found.rmse_n
        ),
        format!(
            "  {} samples of {:.2} to {:.2} N on the way in, {} presses",
            found.samples,
            found.seating_n,
            found.force_max_n,
            found.presses.len()
        ),
    ];
    lines.extend(found.presses.iter().map(|press| {
        format!(
            "  press {}: {:.3} ± {:.3} um/N, {} samples",
            press.press,
            um(press.mm_per_n),
            um(press.std_error_mm_per_n),
            press.samples
        )
    }));
    lines.push(match kept {
        Some(kept) => format!("kept as {}, {}", kept.id, kept.path.display()),
        None => "not kept; --save keeps it for 'palpate fit --compliance last'".into(),
    });
    lines.join("\n")
}

/// A session of another kind is wrong use; a run that tells nothing has failed.
fn failure(err: MeasureError) -> Failure {
    match err {
        MeasureError::Source(err) => super::source_failure(err),
        MeasureError::NoSurface | MeasureError::Imported => Failure::usage(err),
        _ => Failure::failed(err),
    }
}

/// What `--compliance` of a command asks for; without it depths stay raw. A library that cannot be found
/// matters only where it is asked for.
pub(super) fn corrections(name: Option<&str>) -> Result<Corrections, Failure> {
    let library = library_folder();
    let Some(name) = name else {
        return Ok(Corrections::none(library.ok().as_deref()));
    };
    let library = library.map_err(Failure::usage)?;
    Corrections::named(name, Some(&library)).map_err(|err| super::source_failure(err.into()))
}

/// What a compliance does to depths, and how to take it from them where it is not.
pub(super) fn sentence(told: &Correction) -> String {
    match told.is_applied {
        true => told.sentence(),
        false => format!("{} (--compliance {LAST})", told.sentence()),
    }
}
