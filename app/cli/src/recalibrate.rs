//! `palpate recalibrate`: forces made anew with another calibration, as an analysis beside a session.

use super::Failure;
use super::calibration::source::Source;
use super::output::Output;
use clap::Args;
use palpate_analysis::analysed::ForceChange;
use palpate_analysis::analyses::{self, DeedFailure};
use palpate_analysis::edits::author;
use palpate_analysis::report::kept;
use palpate_sessions::analyses::AnalysisError;
use serde::Serialize;
use std::path::PathBuf;

/// Make the forces of sessions anew from the raw signal with another calibration, as an analysis beside them
#[derive(Debug, Args)]
pub struct RecalibrateArgs {
    /// Session folders
    #[arg(required = true, value_name = "SESSION")]
    sessions: Vec<PathBuf>,
    /// A name or id of the library, a file, or thesis
    #[arg(long, value_name = "NAME|FILE")]
    calibration: String,
    /// Name of the analysis; without it "recalibrated" and the calibration's id or name
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    #[command(flatten)]
    who: Who,
}

/// Who makes an analysis, and why.
#[derive(Debug, Args)]
pub(super) struct Who {
    /// Why, in a few words
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub reason: String,
    /// Who says so; without it the login name
    #[arg(long, value_name = "NAME")]
    pub by: Option<String>,
}

impl Who {
    /// As an analysis names them.
    pub fn who(&self) -> analyses::Who {
        analyses::Who { by: author(self.by.as_deref()), reason: self.reason.clone() }
    }
}

#[derive(Serialize)]
struct Recalibrated {
    session: PathBuf,
    #[serde(flatten)]
    change: ForceChange,
}

pub(super) fn run(args: &RecalibrateArgs, output: &Output) -> Result<(), Failure> {
    let source = Source::find(&args.calibration)?;
    let own = source.id.as_ref().unwrap_or(&source.calibration.name);
    let name = args.name.clone().unwrap_or_else(|| format!("recalibrated {own}"));
    let who = args.who.who();
    let bar = output.count_bar(args.sessions.len() as u64);
    let mut done = Vec::new();
    for session in &args.sessions {
        bar.set_message(session.display().to_string());
        let made = analyses::recalibrate(session, &name, &source.calibration, &who);
        let made = made.map_err(deed_failure)?;
        for doubt in source.doubts(&made.rig) {
            bar.suspend(|| output.note(&format!("{}: {doubt}", session.display())));
        }
        done.push(Recalibrated { session: session.clone(), change: made.change });
        bar.inc(1);
    }
    drop(bar);
    let object = serde_json::json!({
        "analysis": name, "calibration": source.calibration.name, "calibration_id": source.id,
        "by": who.by, "sessions": done,
    });
    output.answer("recalibrate", &object, || {
        let line = |one: &Recalibrated| {
            format!("{}: {}", one.session.display(), kept::change(&one.change))
        };
        let mut lines: Vec<String> = done.iter().map(line).collect();
        lines.push(format!(
            "kept as analysis '{name}'; read with --analysis '{name}' of fit and export"
        ));
        lines.join("\n")
    });
    Ok(())
}

/// What could not be written beside a session.
pub(super) fn deed_failure(err: DeedFailure) -> Failure {
    match err {
        DeedFailure::Source(err) => super::source_failure(err),
        DeedFailure::Say(err) => super::review::say_failure(err),
        DeedFailure::Calibration(err) => super::calibration::source::failure(err),
        DeedFailure::NothingLeftOut => {
            Failure::usage(format!("{err}; see t_s of 'palpate export'"))
        }
        DeedFailure::WhichContact(several) => {
            Failure::usage(format!("{err} with --contact 1 to {several}"))
        }
        DeedFailure::Fit(_) | DeedFailure::Cancelled => Failure::failed(err),
        err => Failure::usage(err),
    }
}

/// An analysis that cannot be had: names are the user's, files are not.
pub(super) fn failure(err: AnalysisError) -> Failure {
    match err {
        AnalysisError::None { .. } => {
            Failure::usage(format!("{err}; 'palpate info' shows those there are"))
        }
        AnalysisError::Chain(_) | AnalysisError::Input { .. } | AnalysisError::Lock(_) => {
            Failure::failed(err)
        }
        AnalysisError::Session(err) => super::read_failure(err),
        _ => Failure::usage(err),
    }
}
