//! The keys of a file with their lines, taken one after the other; a key that is not taken is a mistake too. A key of a
//! table is called `table.key`.

use palpate_model::rig::RigDescription;
use palpate_model::units::{MmPerS, MmPerS2, Position};
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Tables within tables: `[sensors.room]` has one.
const TABLES_MAX: usize = 2;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mistake {
    /// Its line, from 1; 0 for the file as a whole.
    pub line: usize,
    /// What is wrong and what is right, in words.
    pub message: String,
}

/// All mistakes of a file in one sentence each; `file` is what it is called.
#[must_use]
pub fn format_mistakes(file: &str, mistakes: &[Mistake]) -> String {
    let one = |mistake: &Mistake| match mistake.line {
        0 => format!("{file}: {}", mistake.message),
        line => format!("{file}, line {line}: {}", mistake.message),
    };
    mistakes.iter().map(one).collect::<Vec<_>>().join("; ")
}

#[derive(Clone, Debug)]
enum Value {
    Text(String),
    Number(f64),
    Flag(bool),
    Texts(Vec<String>),
    Numbers(Vec<f64>),
    Other,
}

struct Field {
    key: String,
    line: usize,
    value: Value,
    is_taken: bool,
}

pub(super) struct SlideLimits {
    /// End of the travel from home.
    pub travel: Position,
    pub speed_max: MmPerS,
    pub acceleration: MmPerS2,
    /// Longest way of the probe without a sample.
    pub unseen: Position,
}

/// Words for where positive positions of a drive lead: from home into the tissue, or the other way.
pub(super) const DIRECTIONS: [(&str, bool); 2] = [("forward", false), ("reverse", true)];

pub struct Fields {
    all: Vec<Field>,
    mistakes: Vec<Mistake>,
    /// Folder of the file: paths in it count from there.
    folder: PathBuf,
}

fn line_of(text: &str, span: &Range<usize>) -> usize {
    let before = text.as_bytes().iter().take(span.start);
    1 + before.filter(|byte| **byte == b'\n').count()
}

impl Fields {
    /// Reads a text; if it is not TOML, that is the only mistake.
    pub fn read(text: &str) -> Result<Self, Mistake> {
        let document = DeTable::parse(text).map_err(|err| Mistake {
            line: err.span().map_or(0, |span| line_of(text, &span)),
            message: format!(
                "this is not TOML ({}); look for a missing quote or '='",
                err.message().trim().replace('\n', ", ")
            ),
        })?;
        let field = |key: String, span: Range<usize>, value: &DeValue<'_>| Field {
            key,
            line: line_of(text, &span),
            value: value_of(value),
            is_taken: false,
        };
        let mut all = Vec::new();
        let mut tables = vec![(String::new(), document.get_ref(), 0)];
        while let Some((before, table, depth)) = tables.pop() {
            for (key, value) in table.iter() {
                let name = format!("{before}{}", key.get_ref());
                match value.get_ref() {
                    // A table within a table that is empty is a key without meaning.
                    DeValue::Table(inner)
                        if depth == 0 || depth < TABLES_MAX && !inner.is_empty() =>
                    {
                        tables.push((name + ".", inner, depth + 1));
                    }
                    other => all.push(field(name, key.span(), other)),
                }
            }
        }
        all.sort_by_key(|field| field.line);
        Ok(Self { all, mistakes: Vec::new(), folder: PathBuf::from(".") })
    }

    /// The same of a file in a folder.
    #[must_use]
    pub(super) fn in_folder(self, folder: PathBuf) -> Self {
        Self { folder, ..self }
    }

    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Names of the tables within a table, in the order of their lines.
    pub(super) fn tables_in(&self, table: &str) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for field in &self.all {
            let rest = field.key.strip_prefix(table).and_then(|rest| rest.strip_prefix('.'));
            let Some((name, _)) = rest.and_then(|rest| rest.split_once('.')) else {
                continue;
            };
            if !names.iter().any(|known| known == name) {
                names.push(name.to_owned());
            }
        }
        names
    }

    /// Adds a mistake at a key, or at the file where the key is missing.
    pub fn mistake(&mut self, key: &str, message: &str) {
        let line = self.all.iter().find(|field| field.key == key).map_or(0, |field| field.line);
        self.mistakes.push(Mistake { line, message: format!("{key}: {message}") });
    }

    /// Whether a key is there.
    pub fn is_given(&self, key: &str) -> bool {
        self.all.iter().any(|field| field.key == key)
    }

    fn take(&mut self, key: &str) -> Option<Value> {
        let field = self.all.iter_mut().find(|field| field.key == key)?;
        field.is_taken = true;
        Some(field.value.clone())
    }

    /// Reads a value, if the key is there; one that does not fit is a mistake.
    fn read_value<T>(
        &mut self,
        key: &str,
        hint: &str,
        convert: impl Fn(Value) -> Option<T>,
    ) -> Option<T> {
        let value = convert(self.take(key)?);
        if value.is_none() {
            self.mistake(key, hint);
        }
        value
    }

    pub fn text(&mut self, key: &str) -> Option<String> {
        self.read_value(key, "give a text in quotes", |value| match value {
            Value::Text(text) if !text.trim().is_empty() => Some(text),
            _ => None,
        })
    }

    /// A list of texts, if it is there.
    pub fn texts(&mut self, key: &str) -> Option<Vec<String>> {
        let hint = "give a list of texts, such as [\"python3\", \"my_stage.py\"]";
        self.read_value(key, hint, |value| match value {
            Value::Texts(texts) if !texts.is_empty() => Some(texts),
            _ => None,
        })
    }

    pub fn flag(&mut self, key: &str) -> Option<bool> {
        self.read_value(key, "give true or false, without quotes", |value| match value {
            Value::Flag(flag) => Some(flag),
            _ => None,
        })
    }

    pub fn number(&mut self, key: &str, least: f64, most: f64) -> Option<f64> {
        let hint = format!("give a number from {least} to {most}, without quotes");
        self.read_value(key, &hint, |value| match value {
            Value::Number(number) => Some(number).filter(|n| (least..=most).contains(n)),
            _ => None,
        })
    }

    /// As many numbers within bounds, if they are there.
    pub fn numbers<const N: usize>(
        &mut self,
        key: &str,
        least: f64,
        most: f64,
    ) -> Option<[f64; N]> {
        let hint = format!("give {N} numbers from {least} to {most}, between [ and ]");
        self.read_value(key, &hint, |value| match value {
            Value::Numbers(numbers) => {
                let all: [f64; N] = numbers.try_into().ok()?;
                Some(all).filter(|all| all.iter().all(|one| (least..=most).contains(one)))
            }
            _ => None,
        })
    }

    /// A whole number within bounds, if it is there.
    pub fn whole_number(&mut self, key: &str, least: u64, most: u64) -> Option<u64> {
        let (least, most) = (least as f64, most as f64);
        let hint = format!("give a whole number from {least} to {most}, without quotes");
        self.read_value(key, &hint, |value| match value {
            Value::Number(number) if (least..=most).contains(&number) && number.fract() == 0.0 => {
                Some(number as u64)
            }
            _ => None,
        })
    }

    /// Limits of the slide, for any controller.
    pub(super) fn limits(&mut self) -> Option<SlideLimits> {
        let travel = self.required_number("travel_mm", 1.0, 10_000.0);
        let speed_max = self.required_number("speed_max_mm_s", 1e-3, 1000.0);
        let acceleration = self.required_number("acceleration_mm_s2", 1e-3, 1e6);
        // Less is below what a desktop computer's pauses leave at any speed; more is too deep for a force that is not
        // measured.
        let unseen = self.number("unseen_mm", 0.02, 0.5);
        Some(SlideLimits {
            travel: Position(travel?),
            speed_max: MmPerS(speed_max?),
            acceleration: MmPerS2(acceleration?),
            unseen: unseen.map_or(RigDescription::UNSEEN_USUAL, Position),
        })
    }

    pub fn required_number(&mut self, key: &str, least: f64, most: f64) -> Option<f64> {
        if !self.is_given(key) {
            self.mistake(key, "this key is missing; add it to the file");
            return None;
        }
        self.number(key, least, most)
    }

    /// One of some words; must be there where there is no usual one.
    pub fn choice<T: Copy>(
        &mut self,
        key: &str,
        words: &[(&str, T)],
        usual: Option<T>,
    ) -> Option<T> {
        let given = match self.take(key) {
            None if usual.is_some() => return usual,
            Some(Value::Text(text)) => text,
            _ => String::new(),
        };
        let found = words.iter().find(|(word, _)| *word == given);
        if found.is_none() {
            let all: Vec<String> = words.iter().map(|(word, _)| format!("\"{word}\"")).collect();
            self.mistake(key, &format!("give {}", all.join(" or ")));
        }
        found.map(|(_, value)| *value)
    }

    /// The mistakes in what was read.
    pub(super) fn into_mistakes(self) -> Vec<Mistake> {
        self.mistakes
    }

    /// All mistakes, keys that mean nothing among them, in the order of their lines.
    pub fn finish(mut self) -> Vec<Mistake> {
        for field in self.all.iter().filter(|field| !field.is_taken) {
            self.mistakes.push(Mistake {
                line: field.line,
                message: format!(
                    "'{}' is not a key of this file; remove it or correct its spelling",
                    field.key
                ),
            });
        }
        self.mistakes.sort_by_key(|mistake| mistake.line);
        self.mistakes
    }
}

fn value_of(value: &DeValue<'_>) -> Value {
    match value {
        DeValue::String(text) => Value::Text(text.to_string()),
        DeValue::Integer(_) | DeValue::Float(_) => {
            number_of(value).map_or(Value::Other, Value::Number)
        }
        DeValue::Boolean(flag) => Value::Flag(*flag),
        DeValue::Array(items) => {
            let text = |item: &Spanned<DeValue<'_>>| match item.get_ref() {
                DeValue::String(text) => Some(text.to_string()),
                _ => None,
            };
            let texts = items.iter().map(text).collect::<Option<_>>().map(Value::Texts);
            let number = |item: &Spanned<DeValue<'_>>| number_of(item.get_ref());
            let numbers = || items.iter().map(number).collect::<Option<_>>().map(Value::Numbers);
            texts.or_else(numbers).unwrap_or(Value::Other)
        }
        _ => Value::Other,
    }
}

fn number_of(value: &DeValue<'_>) -> Option<f64> {
    let text = match value {
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.to_string(),
        _ => return None,
    };
    // "inf" and "nan" are TOML, but nothing that a rig has.
    text.parse().ok().filter(|number: &f64| number.is_finite())
}
