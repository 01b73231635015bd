//! What a crate computes: commands that read recordings and write results, and nothing else.

use chrono::{DateTime, Utc};
use std::path::{Component, Path};
use thiserror::Error;

/// Folder of a crate with the results of its steps, one folder each.
pub const RESULTS: &str = "results";

/// Commands that compute from recordings, each with the options by which it would change a session, the library or a
/// folder that others share.
const COMMANDS: [(&str, &[&str]); 12] = [
    ("fit", &["--save", "--shard"]),
    ("analyse", &[]),
    ("select", &[]),
    ("material", &["--save", "--shard"]),
    ("population", &["--save"]),
    ("agreement", &[]),
    ("study", &[]),
    ("report", &["--check"]),
    ("export", &["--lake"]),
    ("quality", &[]),
    ("compliance", &["--save"]),
    ("info", &[]),
];

/// A step of a crate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CrateStep {
    /// Also the name of its folder in `results`.
    pub name: String,
    /// The command and its words, with paths from the crate's folder.
    pub words: Vec<String>,
}

impl CrateStep {
    /// Its folder, from the crate's.
    #[must_use]
    pub fn folder(&self) -> String {
        format!("{RESULTS}/{}", self.name)
    }

    /// The line that a person types in the crate's folder.
    #[must_use]
    pub fn line(&self) -> String {
        let quoted = |word: &String| {
            let is_plain = |letter: char| letter.is_alphanumeric() || "-_./=,:+%".contains(letter);
            match !word.is_empty() && word.chars().all(is_plain) {
                true => word.clone(),
                false => format!("'{}'", word.replace('\'', "'\\''")),
            }
        };
        let words: Vec<String> = self.words.iter().map(quoted).collect();
        format!("palpate {}", words.join(" "))
    }
}

/// Why words cannot be a step.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum StepRefusal {
    #[error("the step has no command; begin it with one of {}", known())]
    NoCommand,
    #[error(
        "'{command}' cannot be a step, because it does not only compute from recordings; choose one of {}",
        known()
    )]
    Command { command: String },
    #[error(
        "'{option}' of '{command}' cannot be in a step, because it changes what other steps read; leave it out"
    )]
    Option { command: String, option: String },
    #[error(
        "'{word}' leads out of the crate; name a path inside the crate, such as sessions/NAME or files/NAME"
    )]
    Path { word: String },
    #[error("{0}")]
    Words(String),
}

fn known() -> String {
    COMMANDS.map(|(name, _)| name).join(", ")
}

/// Refuses words that do anything but compute inside the crate.
pub fn check_words(words: &[String]) -> Result<(), StepRefusal> {
    let (command, options) = words.split_first().ok_or(StepRefusal::NoCommand)?;
    let Some((_, refused)) = COMMANDS.iter().find(|(name, _)| name == command) else {
        return Err(StepRefusal::Command { command: command.clone() });
    };
    for word in options {
        let (name, value) = word.split_once('=').unwrap_or((word, word));
        if let Some(option) = refused.iter().find(|option| **option == name) {
            let (command, option) = (command.clone(), (*option).to_owned());
            return Err(StepRefusal::Option { command, option });
        }
        if [word.as_str(), value].iter().any(|path| leads_out(path)) {
            return Err(StepRefusal::Path { word: word.clone() });
        }
    }
    Ok(())
}

/// Whether a word, taken as a path on any system, may leave the folder that it is relative to.
pub(super) fn leads_out(word: &str) -> bool {
    let mut letters = word.chars();
    let is_drive = letters.next().is_some_and(|letter| letter.is_ascii_alphabetic())
        && letters.next() == Some(':');
    let is_up = |part: &str| part == "..";
    is_drive
        || word.starts_with(['/', '\\'])
        || word.split(['/', '\\']).any(is_up)
        || Path::new(word).components().any(|part| {
            matches!(part, Component::RootDir | Component::Prefix(_) | Component::ParentDir)
        })
}

/// Where a step runs.
#[derive(Clone, Copy, Debug)]
pub struct StepPlace<'a> {
    /// The crate's folder, from which paths count.
    pub folder: &'a Path,
    /// A library for this step alone.
    pub library: &'a Path,
    /// The time that pages of the step are dated with.
    pub made_at: DateTime<Utc>,
}

/// What a command printed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StepOutput {
    /// Whether it did what it was to do.
    pub is_done: bool,
    /// On standard output.
    pub output: Vec<u8>,
    /// On standard error.
    pub remarks: Vec<u8>,
}

/// Carries out commands, as a front end does.
pub trait StepRunner {
    /// Refuses words that are no command line.
    fn check(&self, words: &[String]) -> Result<(), String>;

    /// Runs them in a place. An error says why they could not be run at all.
    fn run(&self, words: &[String], place: &StepPlace<'_>) -> Result<StepOutput, String>;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(line: &str) -> Vec<String> {
        line.split(' ').map(str::to_owned).collect()
    }

    #[test]
    fn only_what_computes_inside_the_crate_is_a_step() {
        for line in [
            "fit sessions/a --json",
            "population sessions --by animal,specimen --out results/p/tables",
            "material sessions/a --poisson 0.5±0.1 --indenter sphere",
            "export sessions/a --format csv --to results/t",
        ] {
            assert_eq!(check_words(&words(line)), Ok(()), "{line}");
        }
        for line in ["run ramp-hold", "queue run", "mask sessions/a", "tag sessions/a x", "doctor"]
        {
            let refusal = check_words(&words(line)).unwrap_err();
            assert!(matches!(refusal, StepRefusal::Command { .. }), "{line}: {refusal}");
        }
        for line in ["fit sessions/a --save x", "population sessions --save=x", "export a --lake l"]
        {
            let refusal = check_words(&words(line)).unwrap_err();
            assert!(matches!(refusal, StepRefusal::Option { .. }), "{line}: {refusal}");
        }
        for line in [
            "fit /home/me/a",
            "fit ../a",
            "fit sessions/../../a",
            "report a --html=/tmp/x.html",
            "report a --html C:\\x.html",
            "fit \\\\server\\a",
            "fit a\\..\\..\\b",
        ] {
            let refusal = check_words(&words(line)).unwrap_err();
            assert!(matches!(refusal, StepRefusal::Path { .. }), "{line}: {refusal}");
        }
        assert_eq!(check_words(&[]), Err(StepRefusal::NoCommand));
    }

    #[test]
    fn line_of_a_step_is_quoted_for_a_shell() {
        let words = vec!["fit".to_owned(), "sessions/liver 1".to_owned(), "--json".to_owned()];
        let step = CrateStep { name: "f".to_owned(), words };
        assert_eq!(step.line(), "palpate fit 'sessions/liver 1' --json");
    }
}
