//! `palpate recalibrate`: recomputes forces with another calibration, as a named analysis.

use super::Failure;
use super::calibration::source::CalibrationSource;
use super::output::Output;
use clap::Args;
use palpate_analysis::analysed_session::ForceChange;
use palpate_analysis::edits;
use palpate_analysis::report::stored_analysis;
use palpate_analysis::session_actions::{self, SessionActionError};
use palpate_sessions::analyses::AnalysisError;
use serde::Serialize;
use std::path::PathBuf;

/// Recompute forces of sessions from the raw signal with another calibration, as a named analysis
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
    author: AuthorArgs,
}

#[derive(Debug, Args)]
pub(super) struct AuthorArgs {
    /// Reason, in a few words
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub reason: String,
    /// Author; without it the login name
    #[arg(long, value_name = "NAME")]
    pub by: Option<String>,
}

impl AuthorArgs {
    pub fn author(&self) -> session_actions::Attribution {
        session_actions::Attribution {
            by: edits::author(self.by.as_deref()),
            reason: self.reason.clone(),
        }
    }
}

#[derive(Serialize)]
struct Recalibrated {
    session: PathBuf,
    #[serde(flatten)]
    change: ForceChange,
}

pub(super) fn run(args: &RecalibrateArgs, output: &Output) -> Result<(), Failure> {
    let source = CalibrationSource::find(&args.calibration)?;
    let label = source.id.as_ref().unwrap_or(&source.calibration.name);
    let name = args.name.clone().unwrap_or_else(|| format!("recalibrated {label}"));
    let author = args.author.author();
    let bar = output.count_bar(args.sessions.len() as u64);
    let mut done = Vec::new();
    for session in &args.sessions {
        bar.set_message(session.display().to_string());
        let made = session_actions::recalibrate(session, &name, &source.calibration, &author);
        let made = made.map_err(analysis_edit_failure)?;
        for doubt in source.doubts(&made.rig) {
            bar.suspend(|| output.note(&format!("{}: {doubt}", session.display())));
        }
        done.push(Recalibrated { session: session.clone(), change: made.change });
        bar.inc(1);
    }
    drop(bar);
    let object = serde_json::json!({
        "analysis": name, "calibration": source.calibration.name, "calibration_id": source.id,
        "by": author.by, "sessions": done,
    });
    output.answer("recalibrate", &object, || {
        let line = |one: &Recalibrated| {
            format!(
                "{}: {}",
                one.session.display(),
                stored_analysis::describe_force_change(&one.change)
            )
        };
        let mut lines: Vec<String> = done.iter().map(line).collect();
        lines.push(format!(
            "saved as analysis '{name}'; fit and export read it with --analysis '{name}'"
        ));
        lines.join("\n")
    });
    Ok(())
}

pub(super) fn analysis_edit_failure(err: SessionActionError) -> Failure {
    match err {
        SessionActionError::Source(err) => super::source_failure(err),
        SessionActionError::Say(err) => super::review::session_edit_failure(err),
        SessionActionError::Calibration(err) => super::calibration::source::failure(err),
        SessionActionError::NothingLeftOut => Failure::usage(format!(
            "{err}; 'palpate export' writes the time of every sample in column t_s"
        )),
        SessionActionError::WhichContact(several) => {
            Failure::usage(format!("{err} with --contact 1 to {several}"))
        }
        SessionActionError::Fit(_) | SessionActionError::Cancelled => Failure::failed(err),
        err => Failure::usage(err),
    }
}

/// A wrong name of an analysis is wrong use, an unreadable file is a failure.
pub(super) fn analysis_failure(err: AnalysisError) -> Failure {
    match err {
        AnalysisError::None { .. } => {
            Failure::usage(format!("{err}; 'palpate info' lists the analyses"))
        }
        AnalysisError::Chain(_) | AnalysisError::Input { .. } | AnalysisError::Lock(_) => {
            Failure::failed(err)
        }
        AnalysisError::Session(err) => super::read_failure(err),
        _ => Failure::usage(err),
    }
}
