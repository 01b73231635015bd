//! The keys of one step or monitor, read by their table: kinds, ranges, what is unknown and what is missing.

use super::keys::{Key, KeyNeed, Range};
use super::problem::{Problems, nearest, suggestion};
use super::quantity::{ProtocolValue, QuantityKind, ValueContent};
use super::scope::Scope;
use super::tree::DocumentTable;
use palpate_model::units::{MmPerS, Seconds};

/// Longest time, in s: a day is longer than any specimen lasts.
const TIME_MAX: f64 = 86_400.0;
/// Largest number of the other kinds, in their unit: longer than any slider, stronger than any cell here.
const SIZE_MAX: f64 = 1000.0;
/// Largest mass, in g: as much weight as [`SIZE_MAX`] newtons.
const MASS_MAX: f64 = 100_000.0;
pub(super) const COUNT_MAX: f64 = 10_000.0;

/// What to do about steps below another [table]: everything belongs to the last one above it.
pub(super) const STEPS_HINT: &str = "write [procedure] on a line above the steps";

pub(crate) struct Args(Vec<(&'static str, ProtocolValue)>);

impl Args {
    /// Reads the keys of a table. `what` names it in sentences, `other_keys` are keys that are read elsewhere.
    pub(super) fn read(
        table: &DocumentTable,
        what: &str,
        keys: &[&'static [Key]],
        other_keys: &[&'static str],
        scope: &Scope,
        problems: &mut Problems,
    ) -> Self {
        let all = || keys.iter().copied().flatten();
        let mut args = Vec::new();
        // A misspelt key is reported as unknown, not as missing too.
        let mut near_misses = Vec::new();
        for entry in &table.entries {
            if other_keys.contains(&entry.key.as_str()) {
                continue;
            }
            let Some(key) = all().find(|key| key.name == entry.key) else {
                let known: Vec<&str> =
                    other_keys.iter().copied().chain(all().map(|key| key.name)).collect();
                near_misses.extend(nearest(&entry.key, known.iter().copied()));
                let hint = match entry.key.as_str() {
                    "steps" => STEPS_HINT.into(),
                    key => suggestion(key, &known),
                };
                problems.error(entry.line, format!("{what} has no key '{}'; {hint}", entry.key));
                continue;
            };
            let value = scope
                .value(&entry.node, key.kind)
                .and_then(|given| checked(key, given))
                .map_err(|reason| format!("'{}' of {what}: {reason}", key.name));
            match problems.take(entry.line, value) {
                // "none" counts as a missing key where the key is optional.
                Some(given)
                    if given.content == ValueContent::None && key.kind != QuantityKind::Flag =>
                {
                    match key.need {
                        KeyNeed::Required
                            if !table.entries.iter().any(|entry| entry.key == "only_if") =>
                        {
                            problems.error(
                                entry.line,
                                format!(
                                    "'{}' of {what} is \"none\" but needs a value, such as {}",
                                    key.name,
                                    key.kind.example()
                                ),
                            );
                        }
                        _ => {}
                    }
                }
                Some(given) => args.push((key.name, given)),
                None => {}
            }
        }
        let mut args = Self(args);
        for key in all() {
            match key.need {
                KeyNeed::Required if table.get(key.name).is_some() => {}
                KeyNeed::Required if near_misses.contains(&key.name) => {}
                KeyNeed::Required => problems.error(table.line, describe_missing(what, key)),
                KeyNeed::Usual(text) if !args.has(key.name) => {
                    args.0.push((key.name, ProtocolValue::of_text(text)));
                }
                KeyNeed::Usual(_) | KeyNeed::Optional => {}
            }
        }
        args
    }

    fn get(&self, key: &str) -> Option<&ProtocolValue> {
        let found = self.0.iter().find(|(name, _)| *name == key);
        found.map(|(_, given)| given)
    }

    pub fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    pub fn maybe(&self, key: &str) -> Option<f64> {
        match self.get(key)?.content {
            ValueContent::Number(_, number) => Some(number),
            _ => None,
        }
    }

    pub fn number(&self, key: &str) -> Result<f64, String> {
        self.maybe(key).ok_or_else(|| format!("'{key}' has no value"))
    }

    pub fn speed(&self, key: &str) -> Result<MmPerS, String> {
        self.number(key).map(MmPerS)
    }

    pub fn seconds(&self, key: &str) -> Result<Seconds, String> {
        self.number(key).map(Seconds)
    }

    pub fn count(&self, key: &str) -> Result<u32, String> {
        // Counts were checked to be whole and small.
        self.number(key).map(|number| number as u32)
    }

    pub fn maybe_text(&self, key: &str) -> Option<&str> {
        self.get(key).map(|given| given.text.as_str())
    }

    pub fn text(&self, key: &str) -> Result<&str, String> {
        self.maybe_text(key).ok_or_else(|| format!("'{key}' has no value"))
    }

    pub fn is_true(&self, key: &str) -> bool {
        self.get(key).is_some_and(|given| given.content == ValueContent::Flag(true))
    }

    pub fn is_no(&self, key: &str) -> bool {
        self.get(key).is_some_and(|given| {
            matches!(given.content, ValueContent::Flag(false) | ValueContent::None)
        })
    }
}

/// A value of the right kind and within the range of its key.
fn checked(key: &Key, given: ProtocolValue) -> Result<ProtocolValue, String> {
    match key.kind {
        _ if given.content == ValueContent::None => Ok(given),
        // Every value but false counts as true.
        QuantityKind::Flag if key.name == "only_if" => Ok(given),
        QuantityKind::Flag => match given.content {
            ValueContent::Flag(_) => Ok(given),
            _ => Err(given.is_not(QuantityKind::Flag)),
        },
        QuantityKind::Text => match key.range {
            Range::OneOf(words) if !words.contains(&given.text.as_str()) => {
                Err(format!("'{}' is not allowed; {}", given.text, suggestion(&given.text, words)))
            }
            _ if given.text.trim().is_empty() => {
                Err("the text is empty; write at least one word".into())
            }
            _ => Ok(given),
        },
        kind => {
            let number = given.number(kind)?;
            check_range(kind, key.range, number)
                .map_err(|reason| format!("{} is out of range; {reason}", given.text))?;
            Ok(given)
        }
    }
}

/// Whether a number of a kind is within a range, or what to give.
pub(super) fn check_range(kind: QuantityKind, range: Range, number: f64) -> Result<(), String> {
    let most = match kind {
        QuantityKind::Time => TIME_MAX,
        QuantityKind::Count => COUNT_MAX,
        QuantityKind::Mass => MASS_MAX,
        _ => SIZE_MAX,
    };
    let (is_within, least) = match range {
        Range::Above0 => (number > 0.0, "more than 0 and at most".to_owned()),
        Range::From0 => (number >= 0.0, "0 to".to_owned()),
        Range::Any | Range::OneOf(_) => (number >= -most, format!("-{most} to")),
    };
    if is_within && number <= most {
        return Ok(());
    }
    // A count has no unit.
    Err(format!("give {least} {most} {}", kind.unit()).trim_end().to_owned())
}

fn describe_missing(what: &str, key: &Key) -> String {
    let name = key.name;
    let example = match key.range {
        Range::OneOf([first, ..]) => format!("\"{first}\""),
        _ => key.kind.example().to_owned(),
    };
    format!("{what} needs '{name}' ({}); write {name} = {example}", key.about)
}
