//! `palpate tag`, `palpate note` and `palpate review`: words by which a session is found, remarks, and that somebody
//! looked at it.

use super::Failure;
use super::output::Output;
use super::verdict::Why;
use clap::Args;
use palpate_analysis::edits::{SayFailure, Subject, author};
use palpate_sessions::edits::{Change, Decision, EditError, Edits};
use serde::Serialize;
use std::path::PathBuf;

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

/// Arguments of `palpate note`.
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
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
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
        EditError::Chain(_) => Failure::failed(err),
        _ => Failure::usage(err),
    }
}

fn say_failure(err: SayFailure) -> Failure {
    match err {
        SayFailure::Read(err) => super::read_failure(err),
        SayFailure::Analyses(err) => super::source_failure(err.into()),
        SayFailure::Edit(err) => edit_failure(err),
    }
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
    let by = author(args.by.as_deref());
    let mut tagged = Vec::new();
    for subject in subjects(&sessions)? {
        let tags = subject.edits.tags();
        let (remove, absent): (Vec<_>, Vec<_>) = remove
            .iter()
            .cloned()
            .partition(|tag| add.contains(tag) || tags.contains(tag.as_str()));
        let session = subject.folder.clone();
        for tag in absent {
            let name = session.display();
            output.note(&format!("{name} has no tag '{tag}' to take away"));
        }
        if !add.is_empty() || !remove.is_empty() {
            let add = add.clone();
            let said = subject.say(&by, "", Change::Tags { add, remove });
            said.map_err(say_failure)?;
        }
        let edits = Edits::read(&session, &subject.id).map_err(edit_failure)?;
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

/// All are looked at before any is changed.
fn subjects(sessions: &[PathBuf]) -> Result<Vec<Subject>, Failure> {
    let read = |path: &PathBuf| Subject::read(path).map_err(say_failure);
    sessions.iter().map(read).collect()
}

pub(super) fn note(args: &NoteArgs, output: &Output) -> Result<(), Failure> {
    let by = author(args.by.as_deref());
    for subject in subjects(&args.sessions)? {
        let said = subject.say(&by, &args.text, Change::Note);
        said.map_err(say_failure)?;
    }
    let text = args.text.trim();
    let object = serde_json::json!({
        "command": "note", "by": by, "note": text, "sessions": args.sessions,
    });
    output.result(&object, || {
        let line = |session: &PathBuf| format!("{}: noted by {by}: {text}", session.display());
        args.sessions
            .iter()
            .map(line)
            .collect::<Vec<_>>()
            .join("\n")
    });
    Ok(())
}

pub(super) fn review(args: &ReviewArgs, output: &Output) -> Result<(), Failure> {
    let subject = Subject::read(&args.session).map_err(say_failure)?;
    let decision = args.decision.decision();
    let change = subject.review(decision).map_err(say_failure)?;
    let (by, reason) = args.why.words();
    let edit = subject.say(&by, reason, change).map_err(say_failure)?;
    let Change::Review { seen, .. } = &edit.change else {
        return Ok(());
    };
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
