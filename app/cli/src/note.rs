//! `palpate note`: adds notes to sessions.

use super::Failure;
use super::output::Output;
use super::review::{read_subjects, session_edit_failure};
use clap::Args;
use palpate_analysis::edits::author;
use palpate_sessions::edits::EditChange;
use std::path::PathBuf;

/// Add a note to sessions; their logs stay unchanged
#[derive(Debug, Args)]
pub struct NoteArgs {
    /// Session folders
    #[arg(required = true, value_name = "SESSION")]
    sessions: Vec<PathBuf>,
    /// Text of the note
    #[arg(long, value_name = "TEXT")]
    text: String,
    /// Author; without it the login name
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
}

pub(super) fn run(args: &NoteArgs, output: &Output) -> Result<(), Failure> {
    let by = author(args.by.as_deref());
    for subject in read_subjects(&args.sessions)? {
        let edit = subject.add_edit(&by, &args.text, EditChange::Note);
        edit.map_err(session_edit_failure)?;
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
