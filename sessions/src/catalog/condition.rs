//! Conditions on named values, as typed: `depth>=2mm`, `ramp.speed=3`, `about.series.id=pilot`.

use super::entry::{CatalogEntry, NamedValue, NamedValueSource};
use palpate_model::quantity::{base_unit, in_base_unit, split};
use rusqlite::types::Value as Sql;
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// How a value is compared. A text can only be equal or unequal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Relation {
    Equal,
    Unequal,
    Below,
    AtMost,
    Above,
    AtLeast,
}

/// Longer signs come first, because they begin like the shorter ones.
const SIGNS: [(&str, Relation); 6] = [
    ("<=", Relation::AtMost),
    (">=", Relation::AtLeast),
    ("!=", Relation::Unequal),
    ("<", Relation::Below),
    (">", Relation::Above),
    ("=", Relation::Equal),
];

/// Whether a letter begins or ends a sign of comparison.
pub(super) fn is_sign(letter: char) -> bool {
    matches!(letter, '<' | '>' | '=')
}

impl Relation {
    fn sign(self) -> &'static str {
        let found = SIGNS.iter().find(|(_, relation)| *relation == self);
        found.map_or("=", |(sign, _)| *sign)
    }

    fn holds(self, left: f64, right: f64) -> bool {
        match self {
            Self::Equal => left == right,
            Self::Unequal => left != right,
            Self::Below => left < right,
            Self::AtMost => left <= right,
            Self::Above => left > right,
            Self::AtLeast => left >= right,
        }
    }
}

/// A condition on a named value. A session with several values of the name meets it if one of them does.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition {
    source: Option<NamedValueSource>,
    relation: Relation,
    /// Several where the text is ambiguous; one suffices.
    alternatives: Vec<Comparison>,
}

/// One reading of a condition: `depth_mm>2` may mean a value of that name, or a value `depth` in mm.
#[derive(Clone, Debug, PartialEq)]
struct Comparison {
    name: String,
    /// Base unit that a value must have if it states one; `None` allows any.
    unit: Option<&'static str>,
    /// A real number or a text.
    value: Sql,
}

#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ConditionError {
    #[error(
        "'{text}' is not a condition; write a name, a comparison sign (= != < <= > >=) and a value, as in depth>=2mm"
    )]
    Form { text: String },
    #[error("'{value}' in '{text}' is not a number; compare a text with = or !=")]
    Words { text: String, value: String },
    #[error(
        "'{text}' has the unit {name} in its name and {value} in its value; give only one unit"
    )]
    Units { text: String, name: String, value: String },
    #[error(
        "'{name}' in '{text}' is not a field; the fields are {known}; write a space for the colon to search for words"
    )]
    Field { text: String, name: String, known: String },
    #[error("'{text}' has no word after the colon; write one, as in specimen:pig")]
    NoWords { text: String },
}

impl FromStr for Condition {
    type Err = ConditionError;

    fn from_str(text: &str) -> Result<Self, ConditionError> {
        let form = || ConditionError::Form { text: text.to_owned() };
        let at = text.find(['<', '>', '=', '!']).ok_or_else(form)?;
        let (name, rest) = text.split_at(at);
        let sign = SIGNS.iter().find(|(sign, _)| rest.starts_with(sign));
        let (sign, relation) = *sign.ok_or_else(form)?;
        let (name, value) = (name.trim(), rest[sign.len()..].trim());
        let of = |source: NamedValueSource| {
            let rest = name.strip_prefix(source.name())?.strip_prefix('.')?;
            Some((source, rest))
        };
        let (source, name) = match NamedValueSource::ALL.into_iter().find_map(of) {
            Some((source, rest)) => (Some(source), rest),
            None => (None, name),
        };
        if name.is_empty() || value.is_empty() {
            return Err(form());
        }
        let is_order = !matches!(relation, Relation::Equal | Relation::Unequal);
        let alternatives = alternatives(text, name, value)?;
        let is_text = |one: &Comparison| matches!(one.value, Sql::Text(_));
        if is_order && alternatives.iter().all(is_text) {
            return Err(ConditionError::Words { text: text.to_owned(), value: value.to_owned() });
        }
        Ok(Self { source, relation, alternatives })
    }
}

fn alternatives(text: &str, name: &str, value: &str) -> Result<Vec<Comparison>, ConditionError> {
    let comparison = |name: &str, unit, value| Comparison { name: name.to_owned(), unit, value };
    let ending = name.rsplit_once('_').filter(|(stem, _)| !stem.is_empty());
    let ending = ending.and_then(|(stem, unit)| Some((stem, unit, base_unit(unit)?)));
    let of_value = split(value).filter(|(_, unit)| unit.is_empty() || base_unit(unit).is_some());
    let Some((number, unit)) = of_value else {
        return Ok(vec![comparison(name, None, Sql::Text(value.to_owned()))]);
    };
    let converted = |unit| Sql::Real(in_base_unit(number, unit).unwrap_or(number));
    match ending {
        None if unit.is_empty() => Ok(vec![comparison(name, None, Sql::Real(number))]),
        None => Ok(vec![comparison(name, base_unit(unit), converted(unit))]),
        Some((_, own, _)) if !unit.is_empty() && unit != own => Err(ConditionError::Units {
            text: text.to_owned(),
            name: own.to_owned(),
            value: unit.to_owned(),
        }),
        Some((stem, own, base)) => Ok(vec![
            comparison(name, None, Sql::Real(number)),
            comparison(stem, Some(base), converted(own)),
        ]),
    }
}

impl Condition {
    /// Evaluates the condition in memory; [`Condition::sql`] is the same for the database.
    pub fn is_met(&self, entry: &CatalogEntry) -> bool {
        let is_met_by = |one: &NamedValue, comparison: &Comparison| {
            let is_unit =
                comparison.unit.is_none_or(|unit| one.unit.is_empty() || one.unit == unit);
            let holds = match (&comparison.value, one.number) {
                (Sql::Real(right), Some(left)) => self.relation.holds(left, *right),
                (Sql::Text(right), _) => (one.text == *right) == (self.relation == Relation::Equal),
                _ => false,
            };
            one.name == comparison.name && is_unit && holds
        };
        entry.named.iter().any(|one| {
            self.source.is_none_or(|source| one.source == source)
                && self.alternatives.iter().any(|comparison| is_met_by(one, comparison))
        })
    }

    /// The condition as SQL on the table of named values, and its values.
    pub(super) fn sql(&self) -> (String, Vec<Sql>) {
        let (mut alternatives, mut values) = (Vec::new(), Vec::new());
        for comparison in &self.alternatives {
            values.push(comparison.name.clone().into());
            let mut text = "name = ?".to_owned();
            if let Some(unit) = comparison.unit {
                values.push(unit.to_owned().into());
                text += " AND unit IN ('', ?)";
            }
            let column = if matches!(comparison.value, Sql::Text(_)) { "text" } else { "number" };
            values.push(comparison.value.clone());
            alternatives.push(format!("({text} AND {column} {} ?)", self.relation.sign()));
        }
        let mut sql = format!("({})", alternatives.join(" OR "));
        if let Some(source) = self.source {
            values.push(source.name().to_owned().into());
            sql += " AND source = ?";
        }
        (sql, values)
    }

    /// SQL on the table of named values that selects the names of this condition, whatever their values and units.
    pub(super) fn sql_of_names(&self, values: &mut Vec<Sql>) -> String {
        values.extend(self.alternatives.iter().map(|one| Sql::from(one.name.clone())));
        let mut sql = vec!["?"; self.alternatives.len()].join(", ");
        sql = format!("name IN ({sql})");
        if let Some(source) = self.source {
            values.push(source.name().to_owned().into());
            sql += " AND source = ?";
        }
        sql
    }

    /// The compared value's name, as typed.
    pub(super) fn name(&self) -> &str {
        &self.alternatives[0].name
    }

    /// The units that a value may have; empty if any.
    pub(super) fn units(&self) -> Vec<&'static str> {
        let units: Option<Vec<_>> = self.alternatives.iter().map(|one| one.unit).collect();
        units.unwrap_or_default()
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Comparison { name, value, .. } = &self.alternatives[0];
        write!(f, "{name} {} ", self.relation.sign())?;
        match value {
            Sql::Real(number) => write!(f, "{number}"),
            Sql::Text(words) => f.write_str(words),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(named: &[(&str, Option<f64>, &str, &str)]) -> CatalogEntry {
        let named = named.iter().map(|(name, number, unit, text)| NamedValue {
            source: NamedValueSource::Plan,
            name: (*name).to_owned(),
            number: *number,
            unit: (*unit).to_owned(),
            text: (*text).to_owned(),
        });
        CatalogEntry { named: named.collect(), ..CatalogEntry::default() }
    }

    #[test]
    fn units_are_converted_and_must_fit() {
        let one = entry(&[
            ("depth", Some(20.0), "mm", "2 cm"),
            ("ramp.speed", Some(3.0), "", "3.0"),
            ("specimen.thickness_mm", Some(12.0), "", "12.0"),
            ("mode", None, "", "slow"),
        ]);
        for (text, is_met) in [
            ("depth=20", true),
            ("depth = 2cm", true),
            ("depth_mm>19.9", true),
            ("depth_cm<=2", true),
            ("depth_um<20000", false),
            ("depth=20 s", false),
            ("depth_s=20", false),
            ("plan.depth>=20mm", true),
            ("about.depth>=20mm", false),
            ("ramp.speed=3 mm/s", true),
            ("ramp.speed!=3", false),
            ("specimen.thickness_mm>11", true),
            ("mode=slow", true),
            ("mode!=slow", false),
            ("mode=fast", false),
            ("nothing=1", false),
        ] {
            let condition: Condition = text.parse().unwrap();
            assert_eq!(condition.is_met(&one), is_met, "{text}");
        }
    }

    #[test]
    fn malformed_conditions_are_refused() {
        for text in ["", "depth", "=3", "depth=", "depth~3", "!depth", "plan.=3"] {
            assert!(
                matches!(text.parse::<Condition>(), Err(ConditionError::Form { .. })),
                "{text}"
            );
        }
        let words = "mode<slow".parse::<Condition>();
        assert!(matches!(words, Err(ConditionError::Words { value, .. }) if value == "slow"));
        let units = "depth_mm>2cm".parse::<Condition>();
        assert!(matches!(
            units,
            Err(ConditionError::Units { name, value, .. }) if (name.as_str(), value.as_str()) == ("mm", "cm")
        ));
    }
}
