//! `palpate tag`: adds and removes tags of sessions.

use super::Failure;
use super::output::Output;
use super::review::{edit_failure, read_subjects, session_edit_failure};
use clap::Args;
use palpate_analysis::edits::author;
use palpate_sessions::edits::{EditChange, Edits};
use serde::Serialize;
use std::path::PathBuf;

/// Add or remove tags of sessions
#[derive(Debug, Args)]
pub struct TagArgs {
    /// Session folders, then tags: +TAG adds one, -TAG removes one; options come before
    #[arg(required = true, value_name = "SESSION|+TAG|-TAG", allow_hyphen_values = true)]
    words: Vec<String>,
    /// Author; without it the login name
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
}

/// An option even among the tags.
const JSON: &str = "--json";

#[derive(Serialize)]
struct Tagged {
    session: PathBuf,
    tags: Vec<String>,
}

pub(super) fn run(args: &TagArgs, output: &Output) -> Result<(), Failure> {
    let (mut sessions, mut add, mut remove) = (Vec::new(), Vec::new(), Vec::new());
    for word in args.words.iter().filter(|word| *word != JSON) {
        match word.as_bytes() {
            [b'-', b'-', ..] => {
                return Err(Failure::usage(format!(
                    "the option {word} is among the tags; write options before the sessions, as in 'palpate tag --by Ada demo +good'"
                )));
            }
            [b'+', ..] => add.push(word[1..].to_owned()),
            [b'-', ..] => remove.push(word[1..].to_owned()),
            _ => sessions.push(PathBuf::from(word)),
        }
    }
    if sessions.is_empty() || (add.is_empty() && remove.is_empty()) {
        return Err(Failure::usage(
            "give sessions and tags, as in 'palpate tag demo +good -doubtful'",
        ));
    }
    let by = author(args.by.as_deref());
    let mut tagged = Vec::new();
    for subject in read_subjects(&sessions)? {
        let tags = subject.edits.tags();
        let (remove, absent): (Vec<_>, Vec<_>) = remove
            .iter()
            .cloned()
            .partition(|tag| add.contains(tag) || tags.contains(tag.as_str()));
        let session = subject.folder.clone();
        for tag in absent {
            let name = session.display();
            output.note(&format!("{name} has no tag '{tag}' to remove"));
        }
        if !add.is_empty() || !remove.is_empty() {
            let add = add.clone();
            let edit = subject.add_edit(&by, "", EditChange::Tags { add, remove });
            edit.map_err(session_edit_failure)?;
        }
        let edits = Edits::read(&session, &subject.id).map_err(edit_failure)?;
        let tags = edits.tags().into_iter().map(str::to_owned).collect();
        tagged.push(Tagged { session, tags });
    }
    let object = serde_json::json!({ "by": by, "sessions": tagged });
    output.answer("tag", &object, || {
        let line = |one: &Tagged| match one.tags.as_slice() {
            [] => format!("{}: no tags", one.session.display()),
            tags => format!("{}: {}", one.session.display(), tags.join(", ")),
        };
        tagged.iter().map(line).collect::<Vec<_>>().join("\n")
    });
    Ok(())
}
