//! What may be asked from outside: a remote queue, a file written by a person at the rig. It names one protocol and says
//! which of its parameters may be chosen, and between which values.

use super::RemoteRefusal;
use palpate_analysis::protocol_sources::find_protocol;
use palpate_model::metadata::{SessionLabels, SessionMetadata};
use palpate_protocols::file::{
    Protocol, ProtocolParameter, ProtocolProblem, QuantityKind, ValueContent,
};
use palpate_protocols::plans::Plan;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;
use thiserror::Error;

/// First word of the key `format`.
const FORMAT: &str = "palpate-remote-queue 1";

/// A file of more is none of ours.
const BYTES_MAX: u64 = 64 * 1024;

/// Runs of one arming. Whoever wants more arms again, and looks at the specimen before.
const RUNS_MAX: u32 = 1000;

/// Parameters that may be chosen: a plan is made for every combination of their ends.
const CHOSEN_MAX: usize = 6;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    format: String,
    name: String,
    protocol: String,
    runs: u32,
    #[serde(default)]
    labels: BTreeMap<String, String>,
    #[serde(default)]
    set: BTreeMap<String, String>,
    #[serde(default)]
    choose: BTreeMap<String, RangeDocument>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RangeDocument {
    from: String,
    to: String,
}

#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("remote queue {file}: {reason}")]
pub struct RemoteQueueError {
    pub file: String,
    pub reason: String,
}

/// Values of a parameter that may be chosen, both ends included, in the unit of its kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AllowedRange {
    pub kind: QuantityKind,
    pub from: f64,
    pub to: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub struct RemoteQueue {
    pub name: String,
    pub protocol: Protocol,
    /// How many runs there may be for one arming.
    pub runs_max: u32,
    pub labels: SessionLabels,
    /// Values that cannot be chosen.
    fixed: BTreeMap<String, String>,
    pub allowed: BTreeMap<String, AllowedRange>,
    /// The texts of both ends, as they were written.
    ends: BTreeMap<String, [String; 2]>,
}

impl RemoteQueue {
    /// Reads a file and checks that every combination of the ends of its ranges makes a plan.
    pub fn read(file: &Path, library: Option<&Path>) -> Result<Self, RemoteQueueError> {
        let error = |reason: String| RemoteQueueError { file: file.display().to_string(), reason };
        let size = file
            .metadata()
            .map_err(|err| error(format!("the file cannot be read ({err}); check its path")))?;
        if size.len() > BYTES_MAX {
            return Err(error(format!(
                "the file has more than {BYTES_MAX} bytes, so it is no remote queue; check its path"
            )));
        }
        let text = std::fs::read_to_string(file)
            .map_err(|err| error(format!("the file cannot be read ({err}); give a text file")))?;
        Self::parse(&text, library).map_err(error)
    }

    fn parse(text: &str, library: Option<&Path>) -> Result<Self, String> {
        let document: Document = toml::from_str(text).map_err(|err| {
            let line = err
                .span()
                .map_or(0, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
            format!("line {line}: {}", err.message())
        })?;
        if document.format != FORMAT {
            return Err(format!(
                "format: \"{}\" is not read by this palpate; write format = \"{FORMAT}\"",
                document.format
            ));
        }
        if document.name.trim().is_empty() || document.name.chars().any(char::is_control) {
            return Err("name: give the queue a name, as in name = \"speeds of gel 7\"".into());
        }
        if !(1..=RUNS_MAX).contains(&document.runs) {
            return Err(format!("runs: give the most runs for one arming, from 1 to {RUNS_MAX}"));
        }
        let source = find_protocol(&document.protocol, library)?.ok_or_else(|| {
            format!(
                "protocol: there is no protocol '{}'; 'palpate protocol list' lists the names",
                document.protocol
            )
        })?;
        let protocol = Protocol::read(&source.text).map_err(|list| first(&list))?;
        let mut labels =
            SessionLabels { about: SessionMetadata::default(), ..SessionLabels::default() };
        for (name, value) in &document.labels {
            labels.set(name, value).map_err(|err| format!("labels.{name}: {err}"))?;
        }
        protocol.check_labels(&labels).map_err(|reason| format!("labels: {reason}"))?;
        let mut fixed = source.locked.clone().unwrap_or_default();
        for (name, value) in &document.set {
            parameter(&protocol, "set", name)?
                .read(value)
                .map_err(|reason| format!("set.{name}: {reason}"))?;
            fixed.insert(name.clone(), value.clone());
        }
        if source.locked.is_some() && !(document.set.is_empty() && document.choose.is_empty()) {
            return Err(format!(
                "the protocol '{}' is locked, so its values cannot be changed; leave out set and choose",
                document.protocol
            ));
        }
        let mut queue = Self {
            name: document.name,
            protocol,
            runs_max: document.runs,
            labels,
            fixed,
            allowed: BTreeMap::new(),
            ends: BTreeMap::new(),
        };
        for (name, range) in document.choose {
            queue.allow(&name, range)?;
        }
        if queue.allowed.len() > CHOSEN_MAX {
            return Err(format!("choose: let at most {CHOSEN_MAX} parameters be chosen"));
        }
        for chosen in queue.corners() {
            queue.plan(&chosen)?;
        }
        Ok(queue)
    }

    /// Whether the rig can run every combination of the ends of the ranges: at the rig is someone who can mend the file.
    pub(crate) fn check(
        &self,
        check: impl Fn(&Plan) -> Result<(), String>,
    ) -> Result<(), RemoteRefusal> {
        for chosen in self.corners() {
            self.plan(&chosen).and_then(|plan| check(&plan)).map_err(|reason| {
                let values: Vec<String> =
                    chosen.iter().map(|(name, value)| format!("{name} = {value}")).collect();
                let values =
                    if values.is_empty() { "its protocol".into() } else { values.join(", ") };
                RemoteRefusal::Corner { queue: self.name.clone(), values, reason }
            })?;
        }
        Ok(())
    }

    fn corners(&self) -> impl Iterator<Item = BTreeMap<String, String>> {
        (0..1_usize << self.ends.len()).map(|corner| {
            let ends = self.ends.iter().enumerate();
            ends.map(|(index, (name, ends))| (name.clone(), ends[corner >> index & 1].clone()))
                .collect()
        })
    }

    fn allow(&mut self, name: &str, range: RangeDocument) -> Result<(), String> {
        if self.fixed.contains_key(name) {
            return Err(format!(
                "choose.{name}: this parameter is under set too; keep one of them"
            ));
        }
        let own = parameter(&self.protocol, "choose", name)?;
        if own.is_list {
            return Err(format!(
                "choose.{name}: this parameter takes a list, which cannot be chosen; write it under set"
            ));
        }
        let end = |key: &str, text: &str| match own.read(text).map(|value| value.content) {
            Ok(ValueContent::Number(kind, value)) => Ok((kind, value)),
            Ok(_) => Err(format!("choose.{name}.{key}: \"{text}\" is not a number with a unit")),
            Err(reason) => Err(format!("choose.{name}.{key}: {reason}")),
        };
        let ((kind, from), (_, to)) = (end("from", &range.from)?, end("to", &range.to)?);
        if from > to {
            return Err(format!("choose.{name}: from is above to; exchange them"));
        }
        self.allowed.insert(name.to_owned(), AllowedRange { kind, from, to });
        self.ends.insert(name.to_owned(), [range.from, range.to]);
        Ok(())
    }

    /// The plan for chosen values: one for every parameter that may be chosen, within its range. Where one is left out the
    /// protocol's own would count, which no one at the rig has allowed.
    pub fn plan(&self, chosen: &BTreeMap<String, String>) -> Result<Plan, String> {
        if let Some(name) = self.allowed.keys().find(|name| !chosen.contains_key(*name)) {
            return Err(format!(
                "'{name}' has no value; give one for every parameter that the queue '{}' lets you choose",
                self.name
            ));
        }
        let mut values = self.fixed.clone();
        for (name, text) in chosen {
            let range = self.allowed.get(name).ok_or_else(|| {
                let names: Vec<&str> = self.allowed.keys().map(String::as_str).collect();
                format!(
                    "the queue '{}' does not allow a choice of '{name}'; choose among: {}",
                    self.name,
                    names.join(", ")
                )
            })?;
            let read = parameter(&self.protocol, "values", name)?.read(text);
            let value = match read.map_err(|reason| format!("{name}: {reason}"))?.content {
                ValueContent::Number(_, value) => value,
                _ => return Err(format!("{name}: \"{text}\" is not a number with a unit")),
            };
            // Written so that a value that is not a number is outside.
            if !(value >= range.from && value <= range.to) {
                let unit = range.kind.unit();
                return Err(format!(
                    "{name}: {text} is outside what the queue '{}' allows, {} to {} {unit}",
                    self.name, range.from, range.to
                ));
            }
            values.insert(name.clone(), text.clone());
        }
        self.protocol.plan(&values).map_err(|list| first(&list))
    }
}

fn parameter<'a>(
    protocol: &'a Protocol,
    table: &str,
    name: &str,
) -> Result<&'a ProtocolParameter, String> {
    let found = protocol.parameters.iter().find(|one| one.name == name);
    found.ok_or_else(|| {
        let names: Vec<&str> = protocol.parameters.iter().map(|one| one.name.as_str()).collect();
        format!(
            "{table}.{name}: the protocol '{}' has no parameter of this name; it has {}",
            protocol.name,
            names.join(", ")
        )
    })
}

fn first(problems: &[ProtocolProblem]) -> String {
    problems.first().map_or_else(String::new, ToString::to_string)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "format = \"palpate-remote-queue 1\"\nname = \"speeds\"\nprotocol = \"ramp-hold\"\nruns = 5\n\
        [labels]\nspecimen = \"gel 7\"\n[set]\ndepth = \"6 mm\"\n[choose.speed]\nfrom = \"0.5 mm/s\"\nto = \"8 mm/s\"\n";

    fn speeds(text: &str) -> BTreeMap<String, String> {
        BTreeMap::from([("speed".to_owned(), text.to_owned())])
    }

    #[test]
    fn only_what_is_allowed_can_be_chosen() {
        let queue = RemoteQueue::parse(GOOD, None).unwrap();
        assert_eq!((queue.runs_max, queue.labels.specimen.as_str()), (5, "gel 7"));
        for speed in ["0.5 mm/s", "8 mm/s", "3 mm/s"] {
            assert!(queue.plan(&speeds(speed)).is_ok(), "{speed}");
        }
        for (speed, words) in [
            ("0.49 mm/s", "outside what the queue"),
            ("8.001 mm/s", "outside what the queue"),
            ("-3 mm/s", ""),
            ("nan mm/s", ""),
            ("3 N", ""),
            ("none", ""),
        ] {
            let refusal = queue.plan(&speeds(speed)).unwrap_err();
            assert!(refusal.contains(words), "{speed}: {refusal}");
        }
        let refusal = queue.plan(&BTreeMap::new()).unwrap_err();
        assert!(refusal.contains("'speed' has no value"), "{refusal}");
        let mut other = speeds("3 mm/s");
        other.insert("depth".into(), "2 mm".into());
        let refusal = queue.plan(&other).unwrap_err();
        assert!(refusal.contains("choose among: speed"), "{refusal}");
    }

    #[test]
    fn a_wrong_file_gets_a_sentence() {
        for (old, new, words) in [
            ("queue 1", "queue 2", "write format"),
            ("runs = 5", "runs = 0", "from 1 to 1000"),
            ("runs = 5", "runs = 5\nspeed = 3", "line 5"),
            ("\"ramp-hold\"", "\"ramp\"", "there is no protocol"),
            ("depth =", "deep =", "no parameter of this name"),
            ("depth = \"6 mm\"", "speed = \"3 mm/s\"", "under set too"),
            ("\"6 mm\"", "\"6 N\"", "set.depth"),
            ("\"0.5 mm/s\"", "\"9 mm/s\"", "from is above to"),
            ("\"0.5 mm/s\"", "\"slow\"", "choose.speed.from"),
            ("specimen =", "specimn =", "labels.specimn"),
            ("\"speeds\"", "\" \"", "give the queue a name"),
        ] {
            let text = GOOD.replacen(old, new, 1);
            assert_ne!(text, GOOD);
            let refusal = RemoteQueue::parse(&text, None).unwrap_err();
            assert!(refusal.contains(words), "{new}: {refusal}");
        }
    }
}
