//! Which groups and which effects the sessions of a study have.

use crate::study_table::{COVARIATES, StudyProblem, StudyRow, StudyTable, WITHIN};
use palpate_model::metadata::plain_value;
use palpate_population::Contrast;
use palpate_sessions::populations::PopulationEffect;
use serde_json::Value;
use std::collections::BTreeSet;
use thiserror::Error;

/// Levels of the nesting, the outermost first, above the session itself.
pub const LEVELS: [&str; 3] = ["animal", "specimen", SITE];
const SITE: &str = "site";
/// The innermost level: what is left between two presses on one place.
const SESSION: &str = "session";
/// The effect that all sessions have.
pub(super) const MEAN: &str = "mean";

/// How the note begins that says of which value of an entry the mean is.
pub(super) const MEAN_AT: &str = "the mean is at ";

#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DesignError {
    #[error("there is no level '{name}'; choose from {}, or an entry such as specimen.storage", LEVELS.join(", "))]
    UnknownLevel { name: String },
    #[error("the levels are {given}; give them from the outermost: {}", LEVELS.join(", "))]
    LevelOrder { given: String },
    #[error("there is no entry '{name}' that may be an effect; choose from {}", entries().collect::<Vec<_>>().join(", "))]
    UnknownEffect { name: String },
    #[error("{0}")]
    Problem(Box<StudyProblem>),
    #[error("{first} has no {entry}, as {lacking} of {of} sessions; add it, or leave {entry} out")]
    Missing { entry: String, lacking: usize, of: usize, first: String },
    #[error("{entry} is '{value}' in all sessions; leave it out of the effects")]
    Constant { entry: String, value: String },
    #[error("{entry} is a number in some sessions and a text in others; correct them")]
    Mixed { entry: String },
}

/// One column of the design.
#[derive(Clone, Debug, PartialEq)]
enum Column {
    Mean,
    /// Whether an entry has a value, against the first of its values.
    Is {
        entry: &'static str,
        value: String,
    },
    /// An entry, from its mean over the sessions.
    From {
        entry: &'static str,
        mean: f64,
    },
}

/// Levels and columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    levels: Vec<&'static str>,
    columns: Vec<Column>,
    /// Values of each entry that is a text, the one that the mean is at first.
    values: Vec<(&'static str, Vec<String>)>,
    /// What was left out and why, and where the mean is.
    pub notes: Vec<String>,
}

impl Design {
    /// Of a study; without names of levels, with those that the sessions can separate.
    pub fn of(
        table: &StudyTable,
        levels: &[String],
        effects: &[String],
    ) -> Result<Self, DesignError> {
        if let Some(problem) = table.problems.iter().find(|one| one.is_contradiction()) {
            return Err(DesignError::Problem(Box::new(problem.clone())));
        }
        let mut design = Self {
            levels: Vec::new(),
            columns: vec![Column::Mean],
            values: Vec::new(),
            notes: Vec::new(),
        };
        design.choose_levels(table, levels)?;
        for name in effects {
            design.add_effect(table, name)?;
        }
        Ok(design)
    }

    fn choose_levels(&mut self, table: &StudyTable, wanted: &[String]) -> Result<(), DesignError> {
        let mut levels = Vec::new();
        for name in wanted {
            let level = LEVELS.into_iter().chain(entries()).find(|level| level == name);
            levels.push(level.ok_or_else(|| DesignError::UnknownLevel { name: name.clone() })?);
        }
        // An entry is a level wherever it is named.
        let place = |level: &&str| LEVELS.iter().position(|one| one == level);
        if !levels.iter().filter_map(place).is_sorted_by(|a, b| a < b) {
            return Err(DesignError::LevelOrder { given: wanted.join(", ") });
        }
        if wanted.is_empty() {
            // A site is a level where a session names one.
            let is_named = |level: &str| table.rows.iter().any(|row| name_of(row, level).is_some());
            levels = LEVELS.into_iter().filter(|level| *level != SITE || is_named(level)).collect();
        }
        for level in &levels {
            let lacking: Vec<&StudyRow> =
                table.rows.iter().filter(|row| name_of(row, level).is_none()).collect();
            if let Some(first) = lacking.first() {
                return Err(DesignError::Missing {
                    entry: entry_of(level).to_owned(),
                    lacking: lacking.len(),
                    of: table.rows.len(),
                    first: first.session.clone(),
                });
            }
        }
        if wanted.is_empty() {
            self.drop_empty(table, &mut levels);
        }
        self.levels = levels;
        Ok(())
    }

    /// Leaves out levels whose groups have one member each.
    fn drop_empty(&mut self, table: &StudyTable, levels: &mut Vec<&'static str>) {
        let mut members = table.rows.len();
        let mut inner = SESSION;
        for index in (0..levels.len()).rev() {
            let path = |row: &StudyRow| -> Vec<Option<String>> {
                levels[..=index].iter().map(|level| name_of(row, level)).collect()
            };
            let groups = table.rows.iter().map(path).collect::<BTreeSet<_>>().len();
            let level = levels[index];
            if groups == members {
                self.notes.push(format!(
                    "each {level} has one {inner}, so differences between {level}s are part of those between {inner}s"
                ));
                levels.remove(index);
            } else {
                (members, inner) = (groups, level);
            }
        }
    }

    fn add_effect(&mut self, table: &StudyTable, name: &str) -> Result<(), DesignError> {
        let entry = entries().find(|entry| *entry == name);
        let entry = entry.ok_or_else(|| DesignError::UnknownEffect { name: name.to_owned() })?;
        let values: Vec<(&StudyRow, &Value)> =
            table.rows.iter().map(|row| (row, &row.covariates[entry])).collect();
        let lacking: Vec<_> = values.iter().filter(|(_, value)| value.is_null()).collect();
        if let Some((first, _)) = lacking.first() {
            return Err(DesignError::Missing {
                entry: entry.to_owned(),
                lacking: lacking.len(),
                of: values.len(),
                first: first.session.clone(),
            });
        }
        let words: BTreeSet<String> = values.iter().map(|(_, value)| plain_value(value)).collect();
        if let (1, Some(value)) = (words.len(), words.first()) {
            return Err(DesignError::Constant { entry: entry.to_owned(), value: value.clone() });
        }
        let numbers: Vec<f64> = values.iter().filter_map(|(_, value)| value.as_f64()).collect();
        if numbers.len() == values.len() {
            let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
            self.notes.push(format!("{MEAN_AT}{entry} = {mean:.4}"));
            self.columns.push(Column::From { entry, mean });
            return Ok(());
        }
        if !numbers.is_empty() {
            return Err(DesignError::Mixed { entry: entry.to_owned() });
        }
        self.values.push((entry, words.iter().cloned().collect()));
        let mut words = words.into_iter();
        if let Some(first) = words.next() {
            self.notes.push(format!("{MEAN_AT}{entry} = {first}"));
        }
        self.columns.extend(words.map(|value| Column::Is { entry, value }));
        Ok(())
    }

    /// Levels, the outermost first, then the session.
    #[must_use]
    pub fn levels(&self) -> Vec<String> {
        self.levels.iter().copied().chain([SESSION]).map(str::to_owned).collect()
    }

    /// Names of the columns.
    #[must_use]
    pub fn effects(&self) -> Vec<String> {
        let name = |column: &Column| match column {
            Column::Mean => MEAN.to_owned(),
            Column::Is { entry, value } => format!("{entry} = {value}"),
            Column::From { entry, .. } => (*entry).to_owned(),
        };
        self.columns.iter().map(name).collect()
    }

    /// What the columns behind the first, which is the mean, stand for.
    #[must_use]
    pub fn described(&self) -> Vec<PopulationEffect> {
        let reference = |entry: &str| {
            let own = self.values.iter().find(|(one, _)| *one == entry);
            own.and_then(|(_, values)| values.first()).cloned().unwrap_or_default()
        };
        let described = |column: &Column| match column {
            Column::Mean => None,
            Column::Is { entry, value } => Some(PopulationEffect::Value {
                entry: (*entry).to_owned(),
                value: value.clone(),
                reference: reference(entry),
            }),
            Column::From { entry, mean } => {
                Some(PopulationEffect::Number { entry: (*entry).to_owned(), mean: *mean })
            }
        };
        self.columns.iter().filter_map(described).collect()
    }

    /// Names of the values of the first entry that is a text, each with its columns where all others are as the mean is; without
    /// such an entry one, named so.
    #[must_use]
    pub fn kinds(&self, name: &str) -> Vec<(String, Vec<f64>)> {
        let columns = |of: &dyn Fn(&Column) -> bool| {
            let value =
                |column: &Column| f64::from(u8::from(*column == Column::Mean || of(column)));
            self.columns.iter().map(value).collect()
        };
        let Some((entry, values)) = self.values.first() else {
            return vec![(name.to_owned(), columns(&|_| false))];
        };
        let kind = |value: &String| {
            let is_own = |column: &Column| matches!(column, Column::Is { entry: own, value: one } if own == entry && one == value);
            (value.clone(), columns(&is_own))
        };
        values.iter().map(kind).collect()
    }

    /// Place of a session among the kinds.
    #[must_use]
    pub fn kind_of(&self, row: &StudyRow) -> usize {
        let place = self.values.first().and_then(|(entry, values)| {
            let own = plain_value(&row.covariates[entry]);
            values.iter().position(|value| *value == own)
        });
        place.unwrap_or(0)
    }

    /// The differences between any two values of a text that has three or more, by their entries.
    #[must_use]
    pub fn comparisons(&self) -> Vec<(&'static str, Vec<Contrast>)> {
        let mut found: Vec<(&'static str, Vec<Contrast>)> = Vec::new();
        for (entry, values) in &self.values {
            if values.len() < 3 {
                continue;
            }
            let weight = |value: &String, column: &Column| match column {
                Column::Is { entry: own, value: one } if own == entry && one == value => 1.0,
                _ => 0.0,
            };
            let pairs = (0..values.len()).flat_map(|a| (a + 1..values.len()).map(move |b| (a, b)));
            let all = pairs.map(|(a, b)| {
                let (a, b) = (&values[a], &values[b]);
                let columns = self.columns.iter();
                let weights = columns.map(|column| weight(b, column) - weight(a, column)).collect();
                Contrast { name: format!("{entry} = {b} / {a}"), weights }
            });
            found.push((entry, all.collect()));
        }
        found
    }

    /// Names of the groups of a session.
    #[must_use]
    pub fn groups(&self, row: &StudyRow) -> Vec<String> {
        self.levels.iter().map(|level| name_of(row, level).unwrap_or_default()).collect()
    }

    /// The value of each column for a session.
    #[must_use]
    pub fn columns(&self, row: &StudyRow) -> Vec<f64> {
        let value = |column: &Column| match column {
            Column::Mean => 1.0,
            Column::Is { entry, value } => {
                f64::from(u8::from(plain_value(&row.covariates[entry]) == *value))
            }
            Column::From { entry, mean } => row.covariates[entry].as_f64().unwrap_or(*mean) - mean,
        };
        self.columns.iter().map(value).collect()
    }
}

/// Entries that may be effects and levels.
fn entries() -> impl Iterator<Item = &'static str> {
    COVARIATES.into_iter().chain(WITHIN)
}

/// What a session that lacks a level is without.
fn entry_of(level: &str) -> &str {
    match level {
        "animal" => "animal.name",
        SITE => "specimen.site",
        level => level,
    }
}

pub(super) fn name_of(row: &StudyRow, level: &str) -> Option<String> {
    match level {
        "animal" => row.animal.clone(),
        "specimen" => row.specimen.clone(),
        SITE => row.site.clone(),
        entry => row.covariates.get(entry).filter(|value| !value.is_null()).map(plain_value),
    }
}
