//! `palpate tag` and `palpate review`: words by which a session is found, and that somebody looked at it.

use super::Failure;
use super::output::Output;
use super::verdict::{Why, author};
use clap::Args;
use palpate_protocols::runner::wall_now;
use palpate_sessions::analyses::{Analyses, inputs_of};
use palpate_sessions::edits::{Change, Decision, Edit, EditError, Edits, add_edit};
use palpate_sessions::log::Summary;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Arguments of `palpate tag`.
#[derive(Debug, Args)]
pub struct TagArgs {
    /// Session folders, then tags: +TAG to give one, -TAG to take one away; options come before
    #[arg(
        required = true,
        value_name = "SESSION|+TAG|-TAG",
        allow_hyphen_values = true
    )]
    words: Vec<String>,
    /// Who says so; without it the login name
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// What is taken for an option though it stands among the tags.
const JSON: &str = "--json";

impl TagArgs {
    /// Whether it prints JSON.
    pub fn is_json(&self) -> bool {
        self.json || self.words.iter().any(|word| word == JSON)
    }
}

/// Arguments of `palpate review`.
#[derive(Debug, Args)]
pub struct ReviewArgs {
    /// Session folder
    session: PathBuf,
    #[command(flatten)]
    decision: DecisionArgs,
    #[command(flatten)]
    why: Why,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
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
        EditError::Chain(_) | EditError::Unknown { .. } => Failure::failed(err),
        _ => Failure::usage(err),
    }
}

fn summary(session: &Path) -> Result<Summary, Failure> {
    Summary::read(session).map_err(super::read_failure)
}

#[derive(Serialize)]
struct Tagged {
    session: PathBuf,
    tags: Vec<String>,
}

pub(super) fn tag(args: &TagArgs, output: &Output) -> Result<(), Failure> {
    let (mut sessions, mut add, mut remove) = (Vec::new(), Vec::new(), Vec::new());
    for word in args.words.iter().filter(|word| *word != JSON) {
        match word.as_bytes() {
            [b'-', b'-', ..] => {
                return Err(Failure::usage(format!(
                    "{word} stands among the tags; options come before the sessions, as in 'palpate tag --by Ada demo +good'"
                )));
            }
            [b'+', ..] => add.push(word[1..].to_owned()),
            [b'-', ..] => remove.push(word[1..].to_owned()),
            _ => sessions.push(PathBuf::from(word)),
        }
    }
    if sessions.is_empty() || (add.is_empty() && remove.is_empty()) {
        return Err(Failure::usage(
            "name sessions and tags, as in 'palpate tag demo +good -doubtful'",
        ));
    }
    // All are looked at before any is changed.
    let found: Vec<Summary> = sessions
        .iter()
        .map(|path| summary(path))
        .collect::<Result<_, Failure>>()?;
    let by = author(args.by.as_deref());
    let mut tagged = Vec::new();
    for (session, found) in sessions.into_iter().zip(found) {
        let id = &found.manifest.session_id;
        let before = Edits::read(&session, id).map_err(edit_failure)?;
        let tags = before.tags();
        let (remove, absent): (Vec<_>, Vec<_>) = remove
            .iter()
            .cloned()
            .partition(|tag| add.contains(tag) || tags.contains(tag.as_str()));
        for tag in absent {
            let name = session.display();
            output.note(&format!("{name} has no tag '{tag}' to take away"));
        }
        if !add.is_empty() || !remove.is_empty() {
            let edit = Edit {
                at: wall_now().into(),
                by: by.clone(),
                reason: String::new(),
                change: Change::Tags {
                    add: add.clone(),
                    remove,
                },
            };
            add_edit(&session, id, &edit).map_err(edit_failure)?;
        }
        let edits = Edits::read(&session, id).map_err(edit_failure)?;
        let tags = edits.tags().into_iter().map(str::to_owned).collect();
        tagged.push(Tagged { session, tags });
    }
    let object = serde_json::json!({ "command": "tag", "by": by, "sessions": tagged });
    output.result(&object, || {
        let line = |one: &Tagged| match one.tags.as_slice() {
            [] => format!("{}: no tags", one.session.display()),
            tags => format!("{}: {}", one.session.display(), tags.join(", ")),
        };
        tagged.iter().map(line).collect::<Vec<_>>().join("\n")
    });
    Ok(())
}

pub(super) fn review(args: &ReviewArgs, output: &Output) -> Result<(), Failure> {
    let found = summary(&args.session)?;
    let id = &found.manifest.session_id;
    let failed = |err| super::source_failure(palpate_protocols::analysis::SourceError::from(err));
    let mut seen = inputs_of(&args.session).map_err(failed)?;
    // What was said before is told by the order of the edits; the review itself is among them.
    seen.retain(|one| one.what != palpate_sessions::EDITS_FILE);
    seen.extend(Analyses::read(&args.session, id).map_err(failed)?.input());
    let decision = args.decision.decision();
    let change = Change::Review {
        decision,
        seen: seen.clone(),
    };
    let edit = args.why.edit(change);
    add_edit(&args.session, id, &edit).map_err(edit_failure)?;
    let object = serde_json::json!({
        "command": "review", "session": args.session, "decision": decision, "by": edit.by,
        "reason": edit.reason, "seen": seen,
    });
    output.result(&object, || {
        let files: Vec<String> = seen
            .iter()
            .map(|one| format!("  {} {}", one.sha256, one.what))
            .collect();
        format!(
            "{}: {} by {}: {}\nseen (SHA-256):\n{}",
            args.session.display(),
            decision.word(),
            edit.by,
            edit.reason,
            files.join("\n")
        )
    });
    Ok(())
}
