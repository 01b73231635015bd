//! `palpate about`: adds or corrects metadata entries of sessions.

use super::Failure;
use super::output::Output;
use super::review::session_edit_failure;
use clap::Args;
use palpate_analysis::edits::author;
use palpate_analysis::session_actions::Attribution;
use palpate_analysis::session_entries::{EnteredSession, SessionEntriesError, enter};
use palpate_model::metadata::{SessionMetadata, split_pair};
use palpate_runner::study::STUDY_FILE;
use palpate_sessions::library_folder;
use std::path::{Path, PathBuf};

/// Add or correct metadata entries of sessions; their logs stay unchanged
#[derive(Debug, Args)]
pub struct AboutArgs {
    /// Session folders, then entries such as animal.name=pig-3; without entries those of study.toml in the library are added
    #[arg(required = true, value_name = "SESSION|KEY=VALUE")]
    words: Vec<String>,
    /// Reason, in a few words; only entries of study.toml need none
    #[arg(long, value_name = "TEXT", default_value = "", hide_default_value = true)]
    reason: String,
    /// Author; without it the login name
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
}

pub(super) fn run(args: &AboutArgs, output: &Output) -> Result<(), Failure> {
    let (mut sessions, mut entries) = (Vec::new(), SessionMetadata::default());
    for word in &args.words {
        // A folder may have '=' in its name.
        match split_pair(word) {
            Ok((name, value)) if !Path::new(word).exists() => {
                entries.set(name, value).map_err(Failure::usage)?;
            }
            _ => sessions.push(PathBuf::from(word)),
        }
    }
    if sessions.is_empty() {
        return Err(Failure::usage(
            "give sessions and entries, as in 'palpate about demo animal.name=pig-3 --reason \"from the notebook\"'",
        ));
    }
    let library = library_folder().ok();
    let has_study = library.as_ref().is_some_and(|library| library.join(STUDY_FILE).exists());
    let reason = match args.reason.trim() {
        "" if !entries.is_empty() => {
            return Err(Failure::usage("entries need a reason; give a few words with --reason"));
        }
        "" if !has_study => {
            return Err(Failure::usage(format!(
                "the library has no {STUDY_FILE}; write one, or give entries such as animal.name=pig-3"
            )));
        }
        "" => STUDY_FILE,
        reason => reason,
    };
    let who = Attribution { by: author(args.by.as_deref()), reason: reason.to_owned() };
    let entered = enter(&sessions, &entries, library.as_deref(), &who).map_err(failure)?;
    let object = serde_json::json!({ "by": who.by, "reason": who.reason, "sessions": entered });
    output.answer("about", &object, || {
        let line = |one: &EnteredSession| match one.entries.is_empty() {
            true => format!("{}: nothing to add", one.session.display()),
            false => format!("{}: {}", one.session.display(), one.entries.pairs()),
        };
        entered.iter().map(line).collect::<Vec<_>>().join("\n")
    });
    Ok(())
}

fn failure(err: SessionEntriesError) -> Failure {
    match err {
        SessionEntriesError::Edit(err) => session_edit_failure(err),
        err => Failure::usage(err),
    }
}
