//! What a record says about a session apart from its samples: animal, specimen, probe, place in a series.
//!
//! [`METADATA_KEYS`] is the one list of possible entries. The command line, protocol files that ask before a start
//! and the manifest all use it.
//!
//! The entries nest as sessions of a study do: `animal.name`, then `specimen`, `specimen.site` and `series.repeat`. Every
//! `animal.` entry is the same in all sessions of an animal; any other may differ from session to session.

use crate::typed_number::plain_text;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use thiserror::Error;

/// Type and range of a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MetadataKind {
    Text,
    /// A number of the unit, above the limit or, if `is_limit_allowed`, at it.
    Number {
        /// Unit, as it ends the key.
        unit: &'static str,
        above: f64,
        /// Whether the limit itself is possible.
        is_limit_allowed: bool,
    },
    /// A whole number from 1.
    Count,
    /// One of these words, because sessions are grouped by it: `f` and `female` would be two groups.
    Choice(&'static [&'static str]),
}

/// One possible entry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetadataKey {
    /// Its name, the unit at its end.
    pub name: &'static str,
    /// Explanation for the person who is asked.
    pub meaning: &'static str,
    /// Type and range of a value.
    pub kind: MetadataKind,
}

const fn text(name: &'static str, meaning: &'static str) -> MetadataKey {
    MetadataKey { name, meaning, kind: MetadataKind::Text }
}

const fn count(name: &'static str, meaning: &'static str) -> MetadataKey {
    MetadataKey { name, meaning, kind: MetadataKind::Count }
}

const fn length(name: &'static str, meaning: &'static str) -> MetadataKey {
    MetadataKey {
        name,
        meaning,
        kind: MetadataKind::Number { unit: "mm", above: 0.0, is_limit_allowed: false },
    }
}

/// The entries that are fields of their own in the manifest.
pub const MANIFEST_FIELDS: [&str; 3] = ["operator", SPECIMEN, "indenter"];

/// Every possible entry, in the order it is shown.
pub const METADATA_KEYS: &[MetadataKey] = &[
    text("operator", "who runs the test"),
    text("specimen", "name of the specimen that is indented"),
    text("indenter", "description of the probe"),
    text("animal.name", "name of the animal, donor or batch that the specimen comes from"),
    text("animal.species", "species, and breed or strain where they matter"),
    MetadataKey {
        name: "animal.age_days",
        meaning: "age in days at death, or at the first test of a living animal",
        kind: MetadataKind::Number { unit: "days", above: 0.0, is_limit_allowed: true },
    },
    MetadataKey {
        name: "animal.sex",
        meaning: "female, male, or mixed for a batch of several animals; without an entry unknown",
        kind: MetadataKind::Choice(&["female", "male", "mixed"]),
    },
    text("animal.treatment", "treatment or group of the animal, such as control"),
    text("specimen.source", "animal or material, organ and supplier"),
    text("specimen.site", "place on the specimen that is indented, such as left lobe"),
    MetadataKey {
        name: "specimen.time_since_death_h",
        meaning: "hours from death to the test",
        kind: MetadataKind::Number { unit: "h", above: 0.0, is_limit_allowed: true },
    },
    text("specimen.storage", "how and how long the specimen was stored"),
    MetadataKey {
        name: "specimen.temperature_c",
        meaning: "temperature of the specimen in the test, in degrees Celsius",
        kind: MetadataKind::Number {
            unit: "degrees Celsius",
            // Absolute zero: what is below was not measured.
            above: -273.15,
            is_limit_allowed: false,
        },
    },
    text("specimen.hydration", "how the specimen was kept moist"),
    length("specimen.thickness_mm", "thickness of the specimen under the probe"),
    text("specimen.mounting", "how the specimen was held, and on which base"),
    length("indenter.diameter_mm", "diameter of the probe"),
    text("indenter.tip", "shape of the tip of the probe: flat, spherical or conical"),
    text("indenter.material", "material of the probe"),
    text("signal.filter", "filter between load cell and converter"),
    text("series.id", "name of the series the session belongs to"),
    count("series.specimen", "number of the specimen in the series"),
    count("series.repeat", "number of the repeat on this specimen, from 1"),
    count("series.repeats", "number of repeats that are planned"),
    count("series.order", "number of the test in the order of testing, from 1"),
];

/// The entry that names the animal, and the beginning of all that describe it.
pub const ANIMAL: &str = "animal.name";
pub const ANIMAL_PREFIX: &str = "animal.";
/// The entry that names the specimen, and the beginning of all that describe it.
pub const SPECIMEN: &str = "specimen";
pub const SPECIMEN_PREFIX: &str = "specimen.";

/// An entry is not possible.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum MetadataError {
    #[error("'{key}' is not a metadata entry; choose from {}", names())]
    UnknownKey { key: String },
    /// Not `KEY=VALUE`.
    #[error("'{text}' is not KEY=VALUE; write an entry such as specimen.thickness_mm=12")]
    NotAPair { text: String },
    /// The value cannot be.
    #[error("{key} cannot be '{value}'; give {expected}")]
    Value { key: &'static str, value: String, expected: String },
    /// A repeat beyond the last.
    #[error(
        "repeat {repeat} of {repeats} is not possible; correct series.repeat or series.repeats"
    )]
    Repeat { repeat: u64, repeats: u64 },
}

fn names() -> String {
    let names: Vec<&str> = METADATA_KEYS.iter().map(|key| key.name).collect();
    names.join(", ")
}

/// The key of a name.
pub fn find_key(name: &str) -> Result<&'static MetadataKey, MetadataError> {
    METADATA_KEYS
        .iter()
        .find(|key| key.name == name)
        .ok_or_else(|| MetadataError::UnknownKey { key: name.to_owned() })
}

/// Key and value of a `KEY=VALUE`, not yet checked.
pub fn split_pair(pair: &str) -> Result<(&str, &str), MetadataError> {
    pair.split_once('=').ok_or_else(|| MetadataError::NotAPair { text: pair.to_owned() })
}

impl MetadataKey {
    /// Whether it describes the specimen, its animal or its place in a series: another specimen has another value, and a
    /// blinded operator must not see it.
    #[must_use]
    pub fn describes_specimen(&self) -> bool {
        let prefixes = [ANIMAL_PREFIX, SPECIMEN_PREFIX, "series."];
        prefixes.iter().any(|prefix| self.name.starts_with(prefix))
    }

    /// The value of a text, or what is wrong with it.
    pub fn parse(&self, value: &str) -> Result<Value, MetadataError> {
        let value = value.trim();
        let refused = |expected: String| MetadataError::Value {
            key: self.name,
            value: value.to_owned(),
            expected,
        };
        match self.kind {
            MetadataKind::Text if value.is_empty() => Err(refused("some words".into())),
            MetadataKind::Text => Ok(value.into()),
            MetadataKind::Count => match value.parse::<u64>() {
                Ok(count) if count > 0 => Ok(count.into()),
                _ => Err(refused("a whole number from 1".into())),
            },
            MetadataKind::Choice(words) => match words.iter().find(|word| **word == value) {
                Some(word) => Ok((*word).into()),
                None => Err(refused(words.join(", "))),
            },
            MetadataKind::Number { unit, above, is_limit_allowed } => {
                let plain = plain_text(value).map_err(|err| refused(err.to_string()))?;
                match plain.parse::<f64>() {
                    Ok(number)
                        if number.is_finite()
                            && (number > above || is_limit_allowed && number >= above) =>
                    {
                        Ok(number.into())
                    }
                    _ => {
                        let from = if is_limit_allowed { "from" } else { "above" };
                        Err(refused(format!("a number of {unit} {from} {above}")))
                    }
                }
            }
        }
    }
}

/// Entries by key. Keys of later versions are kept as they are read.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SessionMetadata {
    values: BTreeMap<String, Value>,
}

impl SessionMetadata {
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    pub fn get(&self, key: &str) -> Option<&Value> {
        self.values.get(key)
    }

    pub fn iter(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.values.iter().map(|(name, value)| (name.as_str(), value))
    }

    /// Sets one entry; an earlier value is replaced.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), MetadataError> {
        let key = find_key(name.trim())?;
        self.put(key.name, key.parse(value)?);
        Ok(())
    }

    /// Sets an entry that was checked before. Null, which only edits have, says that the session lacks the entry.
    pub fn put(&mut self, name: &str, value: Value) {
        self.values.insert(name.to_owned(), value);
    }

    /// All entries in the order of [`METADATA_KEYS`], then those that this version does not know. Text without quotes.
    pub fn lines(&self) -> Vec<(&str, String)> {
        let place = |name: &str| METADATA_KEYS.iter().position(|key| key.name == name);
        let mut entries: Vec<(&str, &Value)> =
            self.values.iter().map(|(k, v)| (k.as_str(), v)).collect();
        entries.sort_by_key(|(name, _)| (place(name).unwrap_or(METADATA_KEYS.len()), *name));
        entries.into_iter().map(|(name, value)| (name, plain_value(value))).collect()
    }

    /// All entries as `KEY=VALUE`, in the order of [`lines`](Self::lines), with commas between them.
    pub fn pairs(&self) -> String {
        let pair = |(name, value): (&str, String)| match self.get(name) {
            Some(Value::Null) => format!("no {name}"),
            _ => format!("{name}={value}"),
        };
        self.lines().into_iter().map(pair).collect::<Vec<_>>().join(", ")
    }
}

/// A value as text without quotes.
#[must_use]
pub fn plain_value(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// Operator, specimen and other labels of a session.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SessionLabels {
    pub operator: String,
    pub specimen: String,
    pub indenter: String,
    #[serde(default, skip_serializing_if = "SessionMetadata::is_empty")]
    pub about: SessionMetadata,
}

impl SessionLabels {
    /// Sets one entry; an earlier value is replaced.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), MetadataError> {
        let key = find_key(name.trim())?;
        self.put(key.name, key.parse(value)?);
        Ok(())
    }

    fn put(&mut self, name: &str, value: Value) {
        let words = || value.as_str().unwrap_or_default().to_owned();
        match name {
            "operator" => self.operator = words(),
            SPECIMEN => self.specimen = words(),
            "indenter" => self.indenter = words(),
            name if value.is_null() => drop(self.about.values.remove(name)),
            name => self.about.put(name, value),
        }
    }

    /// Takes over entries that were checked before; operator, specimen and indenter may be among them. Null removes one.
    pub fn take(&mut self, entries: &SessionMetadata) {
        entries.iter().for_each(|(name, value)| self.put(name, value.clone()));
    }

    /// The value of an entry of [`METADATA_KEYS`].
    pub fn value(&self, name: &str) -> Option<Value> {
        let words = |text: &str| (!text.trim().is_empty()).then(|| text.into());
        match name {
            "operator" => words(&self.operator),
            SPECIMEN => words(&self.specimen),
            "indenter" => words(&self.indenter),
            name => self.about.get(name).cloned(),
        }
    }

    /// Sets the entry of a `KEY=VALUE`.
    pub fn set_pair(&mut self, pair: &str) -> Result<(), MetadataError> {
        let (name, value) = split_pair(pair)?;
        self.set(name, value)
    }

    /// Whether an entry of [`METADATA_KEYS`] has a value.
    pub fn is_set(&self, name: &str) -> bool {
        self.value(name).is_some()
    }

    /// Refuses entries that contradict each other.
    pub fn check(&self) -> Result<(), MetadataError> {
        let count = |name| self.about.get(name).and_then(Value::as_u64);
        match (count("series.repeat"), count("series.repeats")) {
            (Some(repeat), Some(repeats)) if repeat > repeats => {
                Err(MetadataError::Repeat { repeat, repeats })
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_come_back_in_the_order_of_the_list() {
        let mut labels = SessionLabels::default();
        for pair in [
            "series.repeat=2",
            "indenter.diameter_mm=12",
            "specimen.source=pig stomach = fundus",
            "operator=Ada",
            "specimen.temperature_c=-4.5",
            "specimen.time_since_death_h=0",
            "animal.sex=female",
            "animal.age_days=180",
        ] {
            labels.set_pair(pair).unwrap();
        }
        assert_eq!(labels.operator, "Ada");
        assert!(labels.is_set("operator") && !labels.is_set("specimen"));
        let lines = labels.about.lines();
        let expected = [
            ("animal.age_days", "180.0"),
            ("animal.sex", "female"),
            ("specimen.source", "pig stomach = fundus"),
            ("specimen.time_since_death_h", "0.0"),
            ("specimen.temperature_c", "-4.5"),
            ("indenter.diameter_mm", "12.0"),
            ("series.repeat", "2"),
        ];
        let lines: Vec<(&str, &str)> = lines.iter().map(|(k, v)| (*k, v.as_str())).collect();
        assert_eq!(lines, expected);
        let text = serde_json::to_string(&labels).unwrap();
        assert_eq!(serde_json::from_str::<SessionLabels>(&text).unwrap(), labels);
    }

    #[test]
    fn impossible_entries_are_refused_with_what_is_possible() {
        for (pair, expected) in [
            ("specimen.colour=red", "specimen.thickness_mm"),
            ("specimen", "KEY=VALUE"),
            ("specimen.thickness_mm=0", "above 0"),
            ("specimen.thickness_mm=NaN", "above 0"),
            ("specimen.time_since_death_h=-1", "a number of h from 0"),
            ("specimen.temperature_c=-300", "above -273.15"),
            ("series.repeat=0", "a whole number from 1"),
            ("series.repeat=1.5", "a whole number from 1"),
            ("operator= ", "some words"),
            ("animal.sex=f", "give female, male, mixed"),
            ("animal.age_days=-1", "a number of days from 0"),
        ] {
            let mut labels = SessionLabels::default();
            let refusal = labels.set_pair(pair).unwrap_err().to_string();
            assert!(refusal.contains(expected), "{pair}: {refusal}");
            assert_eq!(labels, SessionLabels::default());
        }
        let mut labels = SessionLabels::default();
        labels.set_pair("series.repeat=4").unwrap();
        labels.check().unwrap();
        labels.set_pair("series.repeats=3").unwrap();
        let refusal = labels.check().unwrap_err().to_string();
        assert!(refusal.contains("repeat 4 of 3"), "{refusal}");
    }
}
