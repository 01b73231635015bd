//! The file of a programme.

use super::sound::doubts;
use super::told::Told;
use crate::file::{Problem, Protocol, built_in};
use crate::plans::{OnTimeout, Plan, Prompt, Step};
use palpate_model::rig::HandAction;
use palpate_model::units::Seconds;
use palpate_sessions::Labels;
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;
use thiserror::Error;
use toml::{Spanned, Value};

/// Version of the language that is read.
const LANGUAGE: u32 = 1;

/// Most repeats of a task: more is a mistake of the keyboard.
const REPEATS_MAX: u32 = 1000;

/// How long a person has to clip a specimen in.
const MOUNT_TIMEOUT: Seconds = Seconds(3600.0);

/// What a programme does, in order.
#[derive(Clone, Debug)]
pub struct Programme {
    /// Name, such as `day-in-the-lab`.
    pub name: String,
    /// In a few words.
    pub title: String,
    /// What it is for.
    pub purpose: String,
    /// What holds for every session where nothing else is told.
    pub usual: Labels,
    /// Whether what previews ask to acknowledge is acknowledged; it is recorded in every session.
    pub is_acknowledged: bool,
    /// Settings of the simulated rig that differ from the usual ones.
    pub simulated: BTreeMap<String, String>,
    /// The tasks.
    pub tasks: Vec<Task>,
    pub(super) told: Told,
}

/// One protocol of a programme.
#[derive(Clone, Debug)]
pub struct Task {
    /// Its name; sessions are filed under it.
    pub name: String,
    /// The protocol.
    pub protocol: Protocol,
    /// Values of its parameters.
    pub values: BTreeMap<String, String>,
    /// Number of the specimen that is clipped in first; none keeps the one that is there.
    pub specimen: Option<u64>,
    /// How often.
    pub repeats: u32,
    /// Rest before every repeat but the first.
    pub rest: Seconds,
    /// Whether forces of later tasks follow the calibration it measures.
    pub calibrates: bool,
    /// Which task's model its sessions are compared with.
    pub validates: Option<Validates>,
    /// Line of the file it begins on.
    pub line: u32,
}

/// A prediction to be compared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Validates {
    /// Name of the task whose first session is fitted.
    pub task: String,
}

/// A programme that cannot be carried out, with every reason; prints as a sentence for each.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct ProgrammeError(pub Vec<Problem>);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    #[serde(rename = "palpate-programme")]
    language: u32,
    name: String,
    title: String,
    #[serde(default)]
    purpose: String,
    #[serde(default)]
    operator: String,
    // These two are read with their lines by `Told`.
    #[serde(default, rename = "about")]
    _about: IgnoredAny,
    #[serde(default, rename = "specimen")]
    _specimen: IgnoredAny,
    #[serde(default)]
    acknowledge: bool,
    #[serde(default)]
    simulated: BTreeMap<String, Value>,
    #[serde(default)]
    task: Vec<Spanned<TaskText>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TaskText {
    name: String,
    protocol: String,
    #[serde(default)]
    set: BTreeMap<String, Value>,
    specimen: Option<u64>,
    #[serde(default = "one")]
    repeats: u32,
    #[serde(default)]
    rest_s: f64,
    #[serde(default)]
    calibrates: bool,
    validates: Option<String>,
}

const fn one() -> u32 {
    1
}

impl Programme {
    /// Whether a text is meant as a programme rather than a protocol.
    #[must_use]
    pub fn is_meant(text: &str) -> bool {
        let is_own = |line: &str| {
            let line = line.trim_start();
            line.starts_with("palpate-programme") || line.starts_with("[[task]]")
        };
        text.lines().any(is_own)
    }

    /// Reads a programme. `other` gives the text of a protocol that is not built in, by the name the programme calls
    /// it; every problem is told.
    pub fn read(
        text: &str,
        other: &dyn Fn(&str) -> Result<String, String>,
    ) -> Result<Self, ProgrammeError> {
        let whole: Text = toml::from_str(text).map_err(|err| {
            let line = err.span().map_or(1, |span| line_of(text, span.start));
            let message = in_words(err.message(), key_at(text, line));
            ProgrammeError(vec![Problem::error(line, message)])
        })?;
        let mut problems = Vec::new();
        if whole.language != LANGUAGE {
            problems.push(Problem::error(0, format!(
                "this is written in version {} of the language and this palpate reads {LANGUAGE}; use a newer palpate",
                whole.language
            )));
        }
        if !is_plain(&whole.name) {
            problems.push(Problem::error(0, format!(
                "a programme cannot be called '{}'; use letters, digits and hyphens, since its folder is called so",
                whole.name
            )));
        }
        if whole.task.is_empty() {
            problems.push(Problem::error(0, "a programme needs at least one [[task]]"));
        }
        let mut tasks: Vec<Task> = Vec::new();
        for task in whole.task {
            let line = line_of(text, task.span().start);
            match read_task(task.into_inner(), line, &tasks, other) {
                Ok(task) => tasks.push(task),
                Err(own) => {
                    let own = own.into_iter();
                    problems.extend(own.map(|message| Problem::error(line, message)));
                }
            }
        }
        let told = Told::read(text, &whole.operator, &mut problems);
        // Tasks with mistakes are not there to be counted.
        if problems.is_empty() {
            let is_used = |number| tasks.iter().any(|task| task.specimen == Some(number));
            let unused = told.specimens().filter(|(number, _)| !is_used(*number));
            problems.extend(unused.map(|(number, line)| {
                let message = format!(
                    "[specimen.{number}] tells of a specimen that no task clips in; add specimen = {number} to the task that does, or take it out"
                );
                Problem::error(line, message)
            }));
        }
        problems.sort_by_key(|problem| problem.line);
        if !problems.is_empty() {
            return Err(ProgrammeError(problems));
        }
        Ok(Self {
            name: whole.name,
            title: whole.title,
            purpose: whole.purpose,
            usual: Labels::default(),
            is_acknowledged: whole.acknowledge,
            simulated: texts(whole.simulated),
            tasks,
            told,
        })
    }

    /// The specimen that is clipped in during a task.
    #[must_use]
    pub fn specimen_at(&self, task: usize) -> Option<u64> {
        let so_far = self.tasks.iter().take(task + 1).rev();
        so_far.filter_map(|task| task.specimen).next()
    }

    /// Sessions in all.
    #[must_use]
    pub fn session_count(&self) -> u32 {
        self.tasks.iter().map(|task| task.repeats).sum()
    }
}

impl Task {
    /// The plan of one repeat, counted from 1: the protocol's, behind the rest and the specimen it needs. `remount`
    /// is the specimen that somebody must look after before a programme goes on.
    #[must_use]
    pub fn plan(&self, repeat: u32, remount: Option<u64>) -> Option<Plan> {
        let mut plan = self.protocol.plan(&self.values).ok()?;
        let mut before = Vec::new();
        if repeat > 1 && self.rest.0 > 0.0 {
            before.push(Step::Rest {
                duration: self.rest,
            });
        }
        let fresh = self.specimen.filter(|_| repeat == 1);
        if let Some(specimen) = fresh.or(remount) {
            before.push(Step::Prompt(Prompt {
                message: format!("Clip in specimen {specimen}, with the probe clear of it"),
                timeout: MOUNT_TIMEOUT,
                on_timeout: OnTimeout::Stop,
                hand: Some(HandAction::Mount { specimen }),
            }));
        }
        plan.steps.splice(0..0, before.into_iter().map(Into::into));
        Some(plan)
    }
}

fn read_task(
    text: TaskText,
    line: u32,
    before: &[Task],
    other: &dyn Fn(&str) -> Result<String, String>,
) -> Result<Task, Vec<String>> {
    let name = text.name.trim().to_owned();
    let mut problems = Vec::new();
    if !is_plain(&name) {
        problems.push(format!(
            "a task cannot be called '{name}'; use letters, digits and hyphens, since its folder is called so"
        ));
    }
    if before.iter().any(|task| task.name == name) {
        problems.push(format!(
            "there is a task '{name}' already; call it otherwise"
        ));
    }
    if !(1..=REPEATS_MAX).contains(&text.repeats) {
        problems.push(format!(
            "{} repeats are not possible; give 1 to {REPEATS_MAX}",
            text.repeats
        ));
    }
    if !(0.0..=86_400.0).contains(&text.rest_s) {
        problems.push(format!(
            "a rest of {} s is not possible; give 0 to 86400 s",
            text.rest_s
        ));
    }
    if let Some(model) = &text.validates
        && !before.iter().any(|task| task.name == *model)
    {
        problems.push(format!(
            "there is no task '{model}' before this one whose model it could be compared with"
        ));
    }
    let values = texts(text.set);
    let protocol = match built_in(&text.protocol) {
        Some(found) => found,
        None => match other(&text.protocol) {
            Ok(file) => Protocol::read(&file),
            Err(reason) => {
                problems.push(reason);
                return Err(problems);
            }
        },
    };
    match protocol {
        Ok(protocol) => {
            let wrong = protocol.plan(&values).err().into_iter().flatten();
            problems.extend(wrong.map(|problem| problem.to_string()));
            if !problems.is_empty() {
                return Err(problems);
            }
            let task = Task {
                name,
                protocol,
                values,
                specimen: text.specimen,
                repeats: text.repeats,
                rest: Seconds(text.rest_s),
                calibrates: text.calibrates,
                validates: text.validates.map(|task| Validates { task }),
                line,
            };
            let doubts = doubts(&task, before);
            match doubts.is_empty() {
                true => Ok(task),
                false => Err(doubts),
            }
        }
        Err(wrong) => {
            let named = |problem| format!("protocol '{}': {problem}", text.protocol);
            problems.extend(wrong.iter().map(named));
            Err(problems)
        }
    }
}

/// Whether a name can be that of a folder anywhere.
fn is_plain(name: &str) -> bool {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-';
    !name.is_empty() && name.chars().all(is_plain)
}

/// Values as a protocol's parameters are given: a text, or a number without a unit; a list with commas. Whether
/// that is a value, the protocol says.
fn texts(values: BTreeMap<String, Value>) -> BTreeMap<String, String> {
    values
        .into_iter()
        .map(|(name, value)| (name, as_text(&value)))
        .collect()
}

fn as_text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Integer(number) => number.to_string(),
        Value::Float(number) => number.to_string(),
        Value::Boolean(is_so) => is_so.to_string(),
        Value::Array(items) => items.iter().map(as_text).collect::<Vec<_>>().join(", "),
        Value::Datetime(_) | Value::Table(_) => String::new(),
    }
}

/// The key that a line sets; empty if it sets none.
fn key_at(text: &str, line: u32) -> &str {
    let line = text.lines().nth(line.saturating_sub(1) as usize);
    let pair = line.and_then(|line| line.split_once('='));
    pair.map_or("", |(key, _)| key.trim())
}

/// What the parser says of a value of the wrong kind, as somebody would say it who does not write programs.
fn in_words(message: &str, key: &str) -> String {
    let rest = message
        .strip_prefix("invalid type: ")
        .or_else(|| message.strip_prefix("invalid value: "));
    let told = rest.and_then(|rest| rest.split_once(", expected "));
    let wanted = told.and_then(|(_, wanted)| match wanted.trim() {
        "u32" | "u64" => Some("a whole number without quotes, such as 2"),
        "f64" => Some("a number without quotes, such as 2.5"),
        "a boolean" => Some("true or false, without quotes"),
        "a string" => Some("a text in quotes"),
        "a map" => Some("values in braces, as in { depth = \"20 mm\" }"),
        _ => None,
    });
    let (Some((found, _)), Some(wanted), false) = (told, wanted, key.is_empty()) else {
        return message.replace('\n', ", ");
    };
    // The parser names the kind first and puts numbers in back quotes.
    let kinds = ["string ", "integer ", "floating point ", "boolean "];
    let kind = kinds.iter().find_map(|kind| found.strip_prefix(kind));
    let found = kind.unwrap_or(found).replace('`', "");
    let hint = match key {
        "specimen" => "; what it is called stands in [specimen.2] as name",
        _ => "",
    };
    format!("{key} cannot be {found}; give {wanted}{hint}")
}

fn line_of(text: &str, at: usize) -> u32 {
    let before = text[..at.min(text.len())].matches('\n').count();
    u32::try_from(before + 1).unwrap_or(u32::MAX)
}
