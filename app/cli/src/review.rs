//! `palpate review`: records a reviewer's decision about a session.

use super::Failure;
use super::output::Output;
use super::verdict::ReasonArgs;
use clap::Args;
use palpate_analysis::edits::{EditFailure, EditTarget};
use palpate_sessions::edits::{EditChange, EditError, ReviewDecision};
use std::path::PathBuf;

/// Record your decision about a session, with hashes of the files you saw
#[derive(Debug, Args)]
pub struct ReviewArgs {
    /// Session folder
    session: PathBuf,
    #[command(flatten)]
    decision: DecisionArgs,
    #[command(flatten)]
    reason: ReasonArgs,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct DecisionArgs {
    /// Accept the session with its analyses
    #[arg(long)]
    accept: bool,
    /// Reject the session
    #[arg(long)]
    reject: bool,
    /// Ask for a repeat
    #[arg(long)]
    repeat: bool,
}

impl DecisionArgs {
    fn decision(&self) -> ReviewDecision {
        match (self.accept, self.reject) {
            (true, _) => ReviewDecision::Accepted,
            (_, true) => ReviewDecision::Rejected,
            _ => ReviewDecision::Repeat,
        }
    }
}

/// Wrong words in an edit are wrong use, an unreadable journal is a failure.
pub(super) fn edit_failure(err: EditError) -> Failure {
    match err {
        EditError::Chain(_) => Failure::failed(err),
        _ => Failure::usage(err),
    }
}

pub(super) fn session_edit_failure(err: EditFailure) -> Failure {
    match err {
        EditFailure::Read(err) => super::read_failure(err),
        EditFailure::Analyses(err) => super::source_failure(err.into()),
        EditFailure::Edit(err) => edit_failure(err),
    }
}

/// Reads all before any is changed.
pub(super) fn read_subjects(sessions: &[PathBuf]) -> Result<Vec<EditTarget>, Failure> {
    let read = |path: &PathBuf| EditTarget::read(path).map_err(session_edit_failure);
    sessions.iter().map(read).collect()
}

pub(super) fn run(args: &ReviewArgs, output: &Output) -> Result<(), Failure> {
    let subject = EditTarget::read(&args.session).map_err(session_edit_failure)?;
    let decision = args.decision.decision();
    let change = subject.review(decision).map_err(session_edit_failure)?;
    let author = args.reason.author();
    let edit =
        subject.add_edit(&author.by, &author.reason, change).map_err(session_edit_failure)?;
    let EditChange::Review { seen, .. } = &edit.change else {
        return Ok(());
    };
    let object = serde_json::json!({ "session": args.session, "decision": decision, "by": edit.by,
        "reason": edit.reason, "seen": seen,
    });
    output.answer("review", &object, || {
        let files: Vec<String> =
            seen.iter().map(|one| format!("  {} {}", one.sha256, one.what)).collect();
        format!(
            "{}: {} by {}: {}\nseen (SHA-256):\n{}",
            args.session.display(),
            decision.name(),
            edit.by,
            edit.reason,
            files.join("\n")
        )
    });
    Ok(())
}
