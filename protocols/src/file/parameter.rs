//! What a technician may change at the start.

use super::args::STEPS_HINT;
use super::problem::{Problems, suggestion};
use super::quantity::{ProtocolValue, QuantityKind, ValueContent};
use super::tree::{DocumentEntry, DocumentTable, DocumentValue};
use palpate_model::typed_number::plain_text;
use serde::Serialize;
use std::borrow::Cow;

/// Something a technician may change at the start.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProtocolParameter {
    /// Its name, as in `--set name=value`.
    pub name: String,
    pub kind: QuantityKind,
    /// Whether it takes several values, separated by commas.
    pub is_list: bool,
    pub default: ProtocolValue,
    /// Smallest value, in the unit of its kind.
    pub min: Option<f64>,
    /// Largest value, in the unit of its kind.
    pub max: Option<f64>,
    pub about: String,
    /// Where the default comes from; may be empty.
    pub source: String,
    pub line: u32,
}

impl ProtocolParameter {
    /// Reads a value that was typed, or says what is wrong with it.
    pub fn read(&self, text: &str) -> Result<ProtocolValue, String> {
        let text = match self.kind {
            QuantityKind::Text | QuantityKind::Flag => Cow::Borrowed(text),
            _ => plain_text(text).map_err(|err| err.to_string())?,
        };
        let given = if self.is_list {
            ProtocolValue::of_list(text.split([',', ';']).map(ProtocolValue::of_text).collect())
        } else {
            ProtocolValue::of_text(&text)
        };
        self.check(&given).map(|()| given)
    }

    /// Whether a value is of the right kind and within the range.
    fn check(&self, given: &ProtocolValue) -> Result<(), String> {
        match &given.content {
            ValueContent::List(items) if self.is_list => {
                items.iter().try_for_each(|item| self.check_one(item))
            }
            _ => self.check_one(given),
        }
    }

    fn check_one(&self, given: &ProtocolValue) -> Result<(), String> {
        match self.kind {
            // "none" is a value only of what can be left out.
            _ if given.content == ValueContent::None
                && self.default.content == ValueContent::None =>
            {
                Ok(())
            }
            QuantityKind::Text if !given.text.is_empty() => Ok(()),
            QuantityKind::Flag if matches!(given.content, ValueContent::Flag(_)) => Ok(()),
            QuantityKind::Text | QuantityKind::Flag => Err(given.is_not(self.kind)),
            kind => {
                let number = given.number(kind)?;
                // A count has no unit.
                let amount = |bound: f64| format!("{bound} {}", kind.unit()).trim_end().to_owned();
                match (self.min, self.max) {
                    (Some(min), _) if number < min => {
                        Err(format!("{} is too small; give {} or more", given.text, amount(min)))
                    }
                    (_, Some(max)) if number > max => {
                        Err(format!("{} is too large; give {} or less", given.text, amount(max)))
                    }
                    _ => Ok(()),
                }
            }
        }
    }
}

pub(super) fn read_parameters(
    root: &DocumentTable,
    problems: &mut Problems,
) -> Vec<ProtocolParameter> {
    let Some(node) = root.get("parameters") else {
        return Vec::new();
    };
    let DocumentValue::Table(table) = &node.value else {
        let message = "'parameters' must be a table; write [parameters] on a line of its own";
        problems.error(node.line, message);
        return Vec::new();
    };
    let read = |entry: &DocumentEntry| {
        let DocumentValue::Table(keys) = &entry.node.value else {
            let name = &entry.key;
            if name == "steps" {
                problems
                    .error(entry.line, format!("[parameters] has no key 'steps'; {STEPS_HINT}"));
                return None;
            }
            problems.error(
                entry.line,
                format!("parameter '{name}' must be a table in braces; write {name} = {{ default = \"20 mm\", about = \"...\", source = \"...\" }}"),
            );
            return None;
        };
        read_parameter(&entry.key, keys, problems)
    };
    table.entries.iter().filter_map(read).collect()
}

const PARAMETER_KEYS: [&str; 6] = ["default", "unit", "min", "max", "about", "source"];

fn read_parameter(
    name: &str,
    keys: &DocumentTable,
    problems: &mut Problems,
) -> Option<ProtocolParameter> {
    let line = keys.line;
    for entry in &keys.entries {
        if !PARAMETER_KEYS.contains(&entry.key.as_str()) {
            let hint = suggestion(&entry.key, &PARAMETER_KEYS);
            let message = format!("parameter '{name}' has no key '{}'; {hint}", entry.key);
            problems.error(entry.line, message);
        }
    }
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || letter == '_' || letter == '-';
    if name.is_empty() || !name.chars().all(is_plain) {
        problems.error(
            line,
            format!("a parameter cannot be called '{name}'; use letters, digits, '_' and '-'"),
        );
        return None;
    }
    let text_of = |key: &str| match keys.get(key).map(|node| &node.value) {
        Some(DocumentValue::Text(text)) => text.trim().to_owned(),
        _ => String::new(),
    };
    let (about, source) = (text_of("about"), text_of("source"));
    if about.is_empty() {
        let message = format!("parameter '{name}' has no description; write about = \"...\"");
        problems.error(line, message);
    }
    let Some(default) = keys.get("default") else {
        problems.error(
            line,
            format!(
                "parameter '{name}' has no default; write its usual value, such as default = \"20 mm\""
            ),
        );
        return None;
    };
    let default = problems.take(default.line, ProtocolValue::of_node(default))?;
    let kind = problems.take(line, kind_of(name, &default, &text_of("unit")))?;
    let mut bound = |key: &str| {
        let node = keys.get(key)?;
        let number = ProtocolValue::of_node(node).and_then(|given| given.number(kind));
        problems.take(
            node.line,
            number.map_err(|reason| format!("'{key}' of parameter '{name}': {reason}")),
        )
    };
    let parameter = ProtocolParameter {
        name: name.to_owned(),
        kind,
        is_list: matches!(default.content, ValueContent::List(_)),
        min: bound("min"),
        max: bound("max"),
        default,
        about,
        source,
        line,
    };
    if let Err(reason) = parameter.check(&parameter.default) {
        problems.error(line, format!("the default of parameter '{name}' is not valid: {reason}"));
    }
    Some(parameter)
}

/// What kind of value a parameter takes, from its default and the unit that is written beside it.
fn kind_of(name: &str, default: &ProtocolValue, unit: &str) -> Result<QuantityKind, String> {
    match (default.kind(), unit) {
        (Some(kind), "") => Ok(kind),
        (None, "") => Err(format!(
            "the default of parameter '{name}' has no unit; add the unit, such as unit = \"mm\""
        )),
        (found, unit) => {
            match QuantityKind::of_unit(unit).or((unit == "text").then_some(QuantityKind::Text)) {
                Some(kind) if found.is_none_or(|found| found == kind) => Ok(kind),
                Some(kind) => Err(format!(
                    "the default of parameter '{name}' does not fit its unit: {}",
                    default.is_not(kind)
                )),
                None => Err(format!(
                    "unit '{unit}' of parameter '{name}' is not known; write mm, mm/s, N, s, g, Hz, N/min, V or text"
                )),
            }
        }
    }
}
