//! `palpate note`: remarks on sessions.

use super::Failure;
use super::output::Output;
use super::review::{say_failure, subjects};
use clap::Args;
use palpate_analysis::edits::author;
use palpate_sessions::edits::Change;
use std::path::PathBuf;

/// Remark on sessions, beside their logs
#[derive(Debug, Args)]
pub struct NoteArgs {
    /// Session folders
    #[arg(required = true, value_name = "SESSION")]
    sessions: Vec<PathBuf>,
    /// What there is to say
    #[arg(long, value_name = "TEXT")]
    text: String,
    /// Who says so; without it the login name
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
}

pub(super) fn run(args: &NoteArgs, output: &Output) -> Result<(), Failure> {
    let by = author(args.by.as_deref());
    for subject in subjects(&args.sessions)? {
        let said = subject.say(&by, &args.text, Change::Note);
        said.map_err(say_failure)?;
    }
    let text = args.text.trim();
    let object = serde_json::json!({ "by": by, "note": text, "sessions": args.sessions,
    });
    output.answer("note", &object, || {
        let line = |session: &PathBuf| format!("{}: noted by {by}: {text}", session.display());
        args.sessions.iter().map(line).collect::<Vec<_>>().join("\n")
    });
    Ok(())
}
