//! Protocols as files: text in, a [`Protocol`] or every problem with its line out. Nothing here opens a file.
//!
//! The language is described in `docs/protocols.md`; its words are the table in `words.rs`. A protocol is read
//! once and written out to a [`Plan`] for the values a technician chose.

mod args;
mod builtin;
mod document;
mod order;
mod problem;
mod procedure;
mod quantity;
mod reference;
mod scope;
mod tree;
mod words;

pub use builtin::{BUILT_IN, built_in};
pub use problem::{Problem, Severity};
pub use quantity::{Given, Kind, What};
pub use reference::reference;

use crate::plans::{Plan, PlanSource};
use problem::{Problems, suggestion};
use scope::Scope;
use serde::Serialize;
use std::collections::BTreeMap;
use tree::{Node, Value};

/// Version of the protocol language that this program reads.
pub const LANGUAGE: u32 = 1;

/// What a protocol can ask for before it starts: the key, and what it means.
pub const ASKABLE: [(&str, &str); 14] = [
    ("operator", "who runs it"),
    ("specimen", "name of the specimen"),
    ("specimen.source", "animal or person, organ, place"),
    ("specimen.time-since-death", "hours since death or excision"),
    ("specimen.storage", "how it was kept"),
    ("specimen.temperature", "temperature during the test"),
    ("specimen.hydration", "how it is kept wet"),
    ("specimen.thickness", "in mm, and how it was measured"),
    ("specimen.mounting", "how it is clipped or supported"),
    ("indenter", "the probe in words"),
    ("indenter.diameter", "in mm"),
    (
        "indenter.tip",
        "flat, spherical with its radius, conical with its angle",
    ),
    ("indenter.material", "of the tip"),
    ("signal.filter", "any filter between cell and converter"),
];

/// Something a technician may change at the start.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Its name, as in `--set name=value`.
    pub name: String,
    /// What kind of value it takes.
    pub kind: Kind,
    /// Whether it takes several values, separated by commas.
    pub is_list: bool,
    /// The usual value.
    pub default: Given,
    /// Smallest value, in the unit of its kind.
    pub min: Option<f64>,
    /// Largest value, in the unit of its kind.
    pub max: Option<f64>,
    /// What it is.
    pub about: String,
    /// Where the default comes from; may be empty.
    pub source: String,
    /// Its line in the file.
    pub line: u32,
}

impl Parameter {
    /// Reads a value that was typed, or says what is wrong with it.
    pub fn read(&self, text: &str) -> Result<Given, String> {
        let given = if self.is_list {
            Given::of_list(text.split(',').map(Given::of_text).collect())
        } else {
            Given::of_text(text)
        };
        self.check(&given).map(|()| given)
    }

    /// Whether a value is of the right kind and within the range.
    fn check(&self, given: &Given) -> Result<(), String> {
        match &given.what {
            What::List(items) if self.is_list => {
                items.iter().try_for_each(|item| self.check_one(item))
            }
            _ => self.check_one(given),
        }
    }

    fn check_one(&self, given: &Given) -> Result<(), String> {
        match self.kind {
            // "none" is a value only of what can be left out.
            _ if given.what == What::None && self.default.what == What::None => Ok(()),
            Kind::Text if !given.text.is_empty() => Ok(()),
            Kind::Flag if matches!(given.what, What::Flag(_)) => Ok(()),
            Kind::Text | Kind::Flag => Err(given.is_not(self.kind)),
            kind => {
                let number = given.number(kind)?;
                let unit = kind.unit();
                match (self.min, self.max) {
                    (Some(min), _) if number < min => Err(format!(
                        "{} is too small; give {min} {unit} or more",
                        given.text
                    )),
                    (_, Some(max)) if number > max => Err(format!(
                        "{} is too large; give {max} {unit} or less",
                        given.text
                    )),
                    _ => Ok(()),
                }
            }
        }
    }
}

/// A protocol as it was read: its head, and steps that wait for values.
#[derive(Clone, Debug, PartialEq)]
pub struct Protocol {
    /// Name, such as `ramp-hold`.
    pub name: String,
    /// Version of this protocol, raised with every change.
    pub version: u32,
    /// What is done, in a few words.
    pub title: String,
    /// What it is for, in a paragraph.
    pub about: String,
    /// Where it comes from.
    pub source: String,
    /// What must be told before the start: keys of [`ASKABLE`].
    pub ask: Vec<String>,
    /// What may be changed at the start.
    pub parameters: Vec<Parameter>,
    /// CRC-32 of the text, eight hexadecimal digits.
    pub crc32: String,
    limits: Option<Node>,
    monitors: Option<Node>,
    procedure: Node,
}

/// A protocol written out for chosen values.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The plan.
    pub plan: Plan,
    /// The line of the file each step came from.
    pub lines: Vec<u32>,
    /// What to look at before the start; nothing that forbids it.
    pub warnings: Vec<Problem>,
}

impl Protocol {
    /// Reads a protocol and writes it out once with the usual values; every problem found, in order of lines.
    pub fn read(text: &str) -> Result<Self, Vec<Problem>> {
        let mut problems = Problems::default();
        let protocol = document::read(text, &mut problems);
        if let Some(protocol) = &protocol {
            // Values of parameters that are wrong themselves would only repeat the problem.
            protocol.written_out(&BTreeMap::new(), &mut problems);
        }
        match protocol {
            Some(protocol) if !problems.has_errors() => Ok(protocol),
            _ => Err(problems.into_list()),
        }
    }

    /// The plan for chosen values, by name of the parameter; the usual value for every other.
    pub fn plan(&self, values: &BTreeMap<String, String>) -> Result<Plan, Vec<Problem>> {
        self.write_out(values).map(|written| written.plan)
    }

    /// The same with the lines of the steps, for messages, and with warnings.
    pub fn write_out(&self, values: &BTreeMap<String, String>) -> Result<Written, Vec<Problem>> {
        let mut problems = Problems::default();
        let (plan, lines) = self.written_out(values, &mut problems);
        if problems.has_errors() {
            return Err(problems.into_list());
        }
        let warnings = problems.into_list();
        Ok(Written {
            plan,
            lines,
            warnings,
        })
    }

    fn written_out(
        &self,
        values: &BTreeMap<String, String>,
        problems: &mut Problems,
    ) -> (Plan, Vec<u32>) {
        let known: Vec<&str> = self
            .parameters
            .iter()
            .map(|parameter| parameter.name.as_str())
            .collect();
        for name in values.keys().filter(|name| !known.contains(&name.as_str())) {
            let hint = suggestion(name, &known);
            problems.error(
                0,
                format!("protocol {} has no parameter '{name}'; {hint}", self.name),
            );
        }
        let mut scope = Scope::default();
        let mut chosen = BTreeMap::new();
        for parameter in &self.parameters {
            let given = values
                .get(&parameter.name)
                .map_or(Ok(parameter.default.clone()), |text| parameter.read(text));
            let given = given.map_err(|why| format!("parameter '{}': {why}", parameter.name));
            // After a wrong value the usual one stands in, so that the rest is checked too.
            let given = problems
                .take(0, given)
                .unwrap_or_else(|| parameter.default.clone());
            chosen.insert(parameter.name.clone(), given.text.clone());
            scope.push(&parameter.name, given);
        }
        let limits = document::limits(self.limits.as_ref(), &scope, problems);
        let monitors = document::monitors(self.monitors.as_ref(), &scope, problems);
        let before = problems.count();
        let steps = procedure::write_out(&self.procedure, &mut scope, problems);
        // A step that could not be read would be missed by those behind it.
        if problems.count() == before {
            order::check(&steps, problems);
        }
        // Nothing at all in the file was told by its reader.
        let is_nothing = matches!(&self.procedure.value, Value::List(items) if items.is_empty());
        if steps.is_empty() && !is_nothing && problems.count() == before {
            problems.error(
                self.procedure.line,
                "with these values no step is left; choose others",
            );
        }
        let (steps, lines) = steps
            .into_iter()
            .map(|placed| (placed.planned, placed.line))
            .unzip();
        let plan = Plan {
            name: self.name.clone(),
            version: self.version,
            steps,
            monitors,
            limits,
            source: Some(PlanSource {
                crc32: self.crc32.clone(),
                values: chosen,
            }),
        };
        (plan, lines)
    }

    /// Which of the things it asks for have no answer yet, with what they mean.
    #[must_use]
    pub fn unanswered(
        &self,
        answers: &BTreeMap<String, String>,
    ) -> Vec<(&'static str, &'static str)> {
        let has_answer = |key: &str| {
            answers
                .get(key)
                .is_some_and(|answer| !answer.trim().is_empty())
        };
        let asked = ASKABLE
            .iter()
            .filter(|(key, _)| self.ask.iter().any(|asked| asked == key));
        asked.filter(|(key, _)| !has_answer(key)).copied().collect()
    }
}
