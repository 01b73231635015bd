//! Protocols as files: text in, a [`Protocol`] or every problem with its line out. Nothing here opens a file.
//!
//! The language is described in `docs/protocols.md`; the words of a step are in its file in `steps`. A protocol is read
//! once and written out to a [`Plan`] for the values a technician chose.

mod args;
mod builtin;
mod check;
mod document;
mod keys;
mod monitors;
mod order;
mod parameter;
pub mod problem;
mod procedure;
mod quantity;
mod reference;
mod scope;
pub mod tree;

pub(crate) use args::Args;
pub use builtin::{BUILT_IN, built_in, is_built_in, nearest_built_in};
pub use check::{ProtocolCheck, check};
pub(crate) use keys::Key;
pub use parameter::ProtocolParameter;
pub use problem::{ProblemSeverity, ProtocolProblem};
pub use quantity::{ProtocolValue, QuantityKind, ValueContent};
pub use reference::reference;

use crate::plans::{Plan, PlanSource};
use palpate_model::metadata::SessionLabels;
use palpate_model::metadata::{self, METADATA_KEYS};
use problem::{Problems, suggestion};
use scope::Scope;
use std::collections::BTreeMap;
use tree::{DocumentNode, DocumentValue};

/// Version of the protocol language that this program reads.
pub const LANGUAGE: u32 = 1;

/// A protocol as it was read: its head, and steps that wait for values.
#[derive(Clone, Debug, PartialEq)]
pub struct Protocol {
    /// Name, such as `ramp-hold`.
    pub name: String,
    /// Version of this protocol, raised with every change.
    pub version: u32,
    pub title: String,
    pub about: String,
    pub source: String,
    /// Labels that must be set before the start: keys of [`METADATA_KEYS`].
    pub ask: Vec<String>,
    pub parameters: Vec<ProtocolParameter>,
    /// CRC-32 of the text, eight hexadecimal digits.
    pub crc32: String,
    limits: Option<DocumentNode>,
    monitors: Option<DocumentNode>,
    procedure: DocumentNode,
}

#[derive(Clone, Debug, PartialEq)]
pub struct ExpandedProtocol {
    pub plan: Plan,
    pub lines: Vec<u32>,
    /// What to look at before the start; nothing that forbids it.
    pub warnings: Vec<ProtocolProblem>,
}

impl Protocol {
    /// Reads a protocol and writes it out once with the usual values; every problem found, in order of lines.
    pub fn read(text: &str) -> Result<Self, Vec<ProtocolProblem>> {
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
    pub fn plan(&self, values: &BTreeMap<String, String>) -> Result<Plan, Vec<ProtocolProblem>> {
        self.write_out(values).map(|written| written.plan)
    }

    /// The same with the lines of the steps, for messages, and with warnings.
    pub fn write_out(
        &self,
        values: &BTreeMap<String, String>,
    ) -> Result<ExpandedProtocol, Vec<ProtocolProblem>> {
        let mut problems = Problems::default();
        let (plan, lines) = self.written_out(values, &mut problems);
        if problems.has_errors() {
            return Err(problems.into_list());
        }
        let warnings = problems.into_list();
        Ok(ExpandedProtocol { plan, lines, warnings })
    }

    fn written_out(
        &self,
        values: &BTreeMap<String, String>,
        problems: &mut Problems,
    ) -> (Plan, Vec<u32>) {
        let known: Vec<&str> =
            self.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
        for name in values.keys().filter(|name| !known.contains(&name.as_str())) {
            let hint = suggestion(name, &known);
            problems.error(0, format!("protocol {} has no parameter '{name}'; {hint}", self.name));
        }
        let mut scope = Scope::default();
        let mut chosen = BTreeMap::new();
        for parameter in &self.parameters {
            let given = values
                .get(&parameter.name)
                .map_or(Ok(parameter.default.clone()), |text| parameter.read(text));
            let given = given.map_err(|reason| format!("parameter '{}': {reason}", parameter.name));
            // After a wrong value the usual one stands in, so that the rest is checked too.
            let given = problems.take(0, given).unwrap_or_else(|| parameter.default.clone());
            chosen.insert(parameter.name.clone(), given.text.clone());
            scope.push(&parameter.name, given);
        }
        let limits = monitors::read_limits(self.limits.as_ref(), &scope, problems);
        let monitors = monitors::read_monitors(self.monitors.as_ref(), &scope, problems);
        let before = problems.count();
        let steps = procedure::write_out(&self.procedure, &mut scope, problems);
        // A step that could not be read would be missed by those behind it.
        if problems.count() == before {
            order::check(&steps, problems);
        }
        // A file without any step is reported by `document`.
        let is_nothing =
            matches!(&self.procedure.value, DocumentValue::List(items) if items.is_empty());
        if steps.is_empty() && !is_nothing && problems.count() == before {
            problems.error(
                self.procedure.line,
                "with these values the protocol has no steps to run; choose other values",
            );
        }
        let (steps, lines) = steps.into_iter().map(|placed| (placed.planned, placed.line)).unzip();
        let plan = Plan {
            name: self.name.clone(),
            version: self.version,
            steps,
            monitors,
            limits,
            source: Some(PlanSource { crc32: self.crc32.clone(), values: chosen }),
        };
        (plan, lines)
    }

    /// The line where its limits begin; 0 without any.
    fn limits_line(&self) -> u32 {
        self.limits.as_ref().map_or(0, |node| node.line)
    }

    /// Labels it asks for that are not set, in the order of [`METADATA_KEYS`].
    pub fn open_questions(&self, labels: &SessionLabels) -> Vec<&'static metadata::MetadataKey> {
        let is_open = |key: &&metadata::MetadataKey| {
            self.ask.iter().any(|name| name == key.name) && !labels.is_set(key.name)
        };
        METADATA_KEYS.iter().filter(is_open).collect()
    }

    /// The error lists the labels that are missing.
    pub fn check_labels(&self, labels: &SessionLabels) -> Result<(), String> {
        let open = self.open_questions(labels);
        let open: Vec<String> =
            open.iter().map(|key| format!("{} ({})", key.name, key.meaning)).collect();
        if open.is_empty() {
            return Ok(());
        }
        Err(format!(
            "protocol {} needs these labels before the start: {}",
            self.name,
            open.join(", ")
        ))
    }
}
