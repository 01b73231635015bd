//! `palpate review`: that somebody looked at a session, and what was decided.

use super::Failure;
use super::output::Output;
use super::verdict::Why;
use clap::Args;
use palpate_analysis::edits::{SayFailure, Subject};
use palpate_sessions::edits::{Change, Decision, EditError};
use std::path::PathBuf;

/// Say that you looked at a session and what you decided, with hashes of what was seen
#[derive(Debug, Args)]
pub struct ReviewArgs {
    /// Session folder
    session: PathBuf,
    #[command(flatten)]
    decision: DecisionArgs,
    #[command(flatten)]
    why: Why,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct DecisionArgs {
    /// It stands, with its analyses
    #[arg(long)]
    accept: bool,
    /// It does not stand
    #[arg(long)]
    reject: bool,
    /// It is to be done again
    #[arg(long)]
    repeat: bool,
}

impl DecisionArgs {
    fn decision(&self) -> Decision {
        match (self.accept, self.reject) {
            (true, _) => Decision::Accepted,
            (_, true) => Decision::Rejected,
            _ => Decision::Repeat,
        }
    }
}

/// What is wrong with an edit: the user's words are, the disk's state is not.
pub(super) fn edit_failure(err: EditError) -> Failure {
    match err {
        EditError::Chain(_) => Failure::failed(err),
        _ => Failure::usage(err),
    }
}

pub(super) fn say_failure(err: SayFailure) -> Failure {
    match err {
        SayFailure::Read(err) => super::read_failure(err),
        SayFailure::Analyses(err) => super::source_failure(err.into()),
        SayFailure::Edit(err) => edit_failure(err),
    }
}

/// All are looked at before any is changed.
pub(super) fn subjects(sessions: &[PathBuf]) -> Result<Vec<Subject>, Failure> {
    let read = |path: &PathBuf| Subject::read(path).map_err(say_failure);
    sessions.iter().map(read).collect()
}

pub(super) fn run(args: &ReviewArgs, output: &Output) -> Result<(), Failure> {
    let subject = Subject::read(&args.session).map_err(say_failure)?;
    let decision = args.decision.decision();
    let change = subject.review(decision).map_err(say_failure)?;
    let who = args.why.who();
    let edit = subject.say(&who.by, &who.reason, change).map_err(say_failure)?;
    let Change::Review { seen, .. } = &edit.change else {
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
