//! Values with units, as people write them: `0.75 mm/s`, `3 min`, `0.01 N/min`.

use super::problem::suggestion;
use super::tree::{DocumentNode, DocumentValue};
use palpate_model::quantity::{base_unit, in_base_unit, split, units_like};
use serde::Serialize;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum QuantityKind {
    Speed,
    /// Depth, distance or position in mm.
    Length,
    Force,
    Time,
    Mass,
    Frequency,
    /// Force over time in N/s.
    ForceRate,
    Voltage,
    Temperature,
    /// A whole number without a unit.
    Count,
    /// `true` or `false`.
    Flag,
    Text,
}

/// Every kind in the order of its variants: name with its article, the unit numbers are kept in where it has one, and
/// a value as one would write it.
const KINDS: [(QuantityKind, &str, &str, &str); 12] = [
    (QuantityKind::Speed, "a speed", "mm/s", "\"0.75 mm/s\""),
    (QuantityKind::Length, "a length", "mm", "\"20 mm\""),
    (QuantityKind::Force, "a force", "N", "\"1.5 N\""),
    (QuantityKind::Time, "a time", "s", "\"50 s\" or \"3 min\""),
    (QuantityKind::Mass, "a mass", "g", "\"240 g\""),
    (QuantityKind::Frequency, "a frequency", "Hz", "\"0.5 Hz\""),
    (QuantityKind::ForceRate, "a force rate", "N/s", "\"0.01 N/min\""),
    (QuantityKind::Voltage, "a voltage", "V", "\"1.8 V\""),
    (QuantityKind::Temperature, "a temperature", "°C", "\"37 °C\""),
    (QuantityKind::Count, "a whole number", "", "10"),
    (QuantityKind::Flag, "true or false", "", "true"),
    (QuantityKind::Text, "a text", "", "\"words\""),
];

impl QuantityKind {
    pub(super) fn with_units() -> impl Iterator<Item = Self> {
        KINDS.iter().filter(|(_, _, unit, _)| !unit.is_empty()).map(|(kind, ..)| *kind)
    }

    /// The unit numbers of this kind are kept in; empty for a count and for words.
    #[must_use]
    pub fn unit(self) -> &'static str {
        KINDS[self as usize].2
    }

    /// Every unit of this kind.
    #[must_use]
    pub fn units(self) -> Vec<&'static str> {
        units_like(self.unit())
    }

    #[must_use]
    pub fn name(self) -> &'static str {
        KINDS[self as usize].1
    }

    #[must_use]
    pub fn example(self) -> &'static str {
        KINDS[self as usize].3
    }

    /// The kind that a unit belongs to.
    #[must_use]
    pub fn of_unit(unit: &str) -> Option<Self> {
        let base = base_unit(unit)?;
        let found = KINDS.iter().find(|(_, _, own, _)| *own == base);
        found.map(|(kind, ..)| *kind)
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProtocolValue {
    pub text: String,
    #[serde(rename = "what")]
    pub content: ValueContent,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ValueContent {
    /// A number in the unit of its kind; a count has none.
    Number(QuantityKind, f64),
    Flag(bool),
    Text,
    /// `"none"`: no value.
    None,
    List(Vec<ProtocolValue>),
}

impl ProtocolValue {
    fn new(text: &str, what: ValueContent) -> Self {
        Self { text: text.to_owned(), content: what }
    }

    #[must_use]
    pub fn count(count: u32) -> Self {
        Self::new(&count.to_string(), ValueContent::Number(QuantityKind::Count, f64::from(count)))
    }

    /// Recognises a number with a unit, a whole number, true, false and none; everything else is a text.
    #[must_use]
    pub fn of_text(text: &str) -> Self {
        let trimmed = text.trim();
        let what = match trimmed {
            "none" => ValueContent::None,
            "true" => ValueContent::Flag(true),
            "false" => ValueContent::Flag(false),
            _ => match split(trimmed) {
                Some((number, "")) if is_whole(number) => {
                    ValueContent::Number(QuantityKind::Count, number)
                }
                Some((number, unit)) => match QuantityKind::of_unit(unit) {
                    Some(kind) => {
                        ValueContent::Number(kind, in_base_unit(number, unit).unwrap_or(f64::NAN))
                    }
                    None => ValueContent::Text,
                },
                None => ValueContent::Text,
            },
        };
        Self::new(trimmed, what)
    }

    pub(super) fn of_node(node: &DocumentNode) -> Result<Self, String> {
        match &node.value {
            DocumentValue::Text(text) | DocumentValue::Number(text) => Ok(Self::of_text(text)),
            DocumentValue::Flag(flag) => {
                Ok(Self::new(&flag.to_string(), ValueContent::Flag(*flag)))
            }
            DocumentValue::List(items) => {
                let items: Result<Vec<Self>, String> = items.iter().map(Self::of_node).collect();
                Ok(Self::of_list(items?))
            }
            DocumentValue::Table(_) => {
                Err("a table in braces is not a value; write a text with a unit".into())
            }
        }
    }

    #[must_use]
    pub fn of_list(items: Vec<Self>) -> Self {
        let texts: Vec<&str> = items.iter().map(|item| item.text.as_str()).collect();
        Self::new(&texts.join(", "), ValueContent::List(items.clone()))
    }

    /// Its kind; none for "none" and for a list of different kinds.
    pub fn kind(&self) -> Option<QuantityKind> {
        match &self.content {
            ValueContent::Number(kind, _) => Some(*kind),
            ValueContent::Flag(_) => Some(QuantityKind::Flag),
            ValueContent::Text => Some(QuantityKind::Text),
            ValueContent::None => None,
            ValueContent::List(items) => {
                let first = items.first()?.kind()?;
                items.iter().all(|item| item.kind() == Some(first)).then_some(first)
            }
        }
    }

    /// The number of a value of one kind, or what is wrong with it.
    pub(super) fn number(&self, kind: QuantityKind) -> Result<f64, String> {
        match self.content {
            ValueContent::Number(found, number) if found == kind && number.is_finite() => {
                Ok(number)
            }
            _ => Err(self.is_not(kind)),
        }
    }

    pub(super) fn is_not(&self, kind: QuantityKind) -> String {
        let text = &self.text;
        let write = match kind {
            QuantityKind::Flag => "write true or false".to_owned(),
            _ => format!("write {} like {}", kind.name(), kind.example()),
        };
        match &self.content {
            ValueContent::Number(found, number) if *found == kind && !number.is_finite() => {
                format!("\"{text}\" is too large for a number; {write}")
            }
            ValueContent::Number(QuantityKind::Count, _) => format!("{text} has no unit; {write}"),
            ValueContent::Number(found, _) => format!("\"{text}\" is {}; {write}", found.name()),
            ValueContent::Flag(_) | ValueContent::None => {
                format!("{text} is not a value here; {write}")
            }
            ValueContent::List(_) => format!("[{text}] is a list; {write}"),
            ValueContent::Text if is_overflow(text) => {
                format!("\"{text}\" is too large for a number; {write}")
            }
            ValueContent::Text => match split(text) {
                Some((_, "")) if kind == QuantityKind::Count => {
                    format!("{text} is not a whole number; {write}")
                }
                Some((_, "")) => format!("{text} has no unit; {write}"),
                Some((_, rest)) if rest.starts_with(',') => {
                    let example = kind.example();
                    format!(
                        "\"{text}\" is not a number; write a point, not a comma, as in {example}"
                    )
                }
                Some((_, unit)) if !kind.units().is_empty() => {
                    let known = suggestion(unit, &kind.units());
                    let name = kind.name().trim_start_matches("a ");
                    format!("'{unit}' in \"{text}\" is not a unit of {name}; {known}")
                }
                _ => format!("\"{text}\" is not {}; {write}", kind.name()),
            },
        }
    }
}

/// Whether a text begins with digits that make no finite number.
fn is_overflow(text: &str) -> bool {
    let number = text.split_whitespace().next().unwrap_or_default();
    let has_digits =
        number.trim_start_matches(['+', '-']).starts_with(|c: char| c.is_ascii_digit());
    has_digits && number.parse().is_ok_and(f64::is_infinite)
}

fn is_whole(number: f64) -> bool {
    // Beyond 2^53 not every whole number has a double of its own; nothing is counted that far.
    number.fract() == 0.0 && number.abs() < 9e15
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_with_units_are_read_exactly() {
        for (text, kind, number) in [
            ("0.75 mm/s", QuantityKind::Speed, 0.75),
            ("45mm/min", QuantityKind::Speed, 0.75),
            ("30 mN", QuantityKind::Force, 0.03),
            ("3 min", QuantityKind::Time, 180.0),
            ("0.1 h", QuantityKind::Time, 360.0),
            ("0.01 N/min", QuantityKind::ForceRate, 0.01 / 60.0),
            ("-5 mm", QuantityKind::Length, -5.0),
            ("1.04 kg", QuantityKind::Mass, 1040.0),
            ("1e-3 V", QuantityKind::Voltage, 1e-3),
            ("10", QuantityKind::Count, 10.0),
        ] {
            assert_eq!(ProtocolValue::of_text(text).number(kind), Ok(number), "{text}");
        }
    }

    #[test]
    fn wrong_values_get_a_message_with_an_example() {
        for (text, kind, words) in [
            ("0.75", QuantityKind::Speed, "has no unit"),
            ("5", QuantityKind::Length, "has no unit"),
            ("5 N", QuantityKind::Length, "is a force"),
            ("5 mmm", QuantityKind::Length, "did you mean 'mm'"),
            ("0,75 mm/s", QuantityKind::Speed, "a point, not a comma"),
            ("fast", QuantityKind::Speed, "is not a speed"),
            ("2.5", QuantityKind::Count, "not a whole number"),
            ("1e999 N", QuantityKind::Force, "is too large"),
            ("-1e999", QuantityKind::Count, "is too large"),
            ("1e308 h", QuantityKind::Time, "\"1e308 h\""),
            ("inf N", QuantityKind::Force, "is not a force"),
            ("nan", QuantityKind::Time, "is not a time"),
            ("", QuantityKind::Time, "is not a time"),
            ("--1 s", QuantityKind::Time, "is not a time"),
            ("none", QuantityKind::Time, "not a value here"),
            ("2e s", QuantityKind::Time, "of time"),
        ] {
            let message = ProtocolValue::of_text(text).number(kind).unwrap_err();
            assert!(message.contains(words), "{text}: {message}");
        }
    }
}
