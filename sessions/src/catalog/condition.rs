//! Conditions on named values, as people write them: `depth>=2mm`, `ramp.speed=3`, `about.series.id=pilot`.

use super::entry::{Entry, Named, Source};
use palpate_model::quantity::{base_unit, in_base_unit, split};
use rusqlite::types::Value as Sql;
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// How a value is compared. What is no number is only equal or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Relation {
    Equal,
    Unequal,
    Below,
    AtMost,
    Above,
    AtLeast,
}

/// The longer signs come first.
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
    source: Option<Source>,
    relation: Relation,
    /// What is compared with, and under which names.
    ways: Vec<Way>,
}

/// One way to read a condition: `depth_mm>2` may be a value called so, or one called `depth` in mm.
#[derive(Clone, Debug, PartialEq)]
struct Way {
    name: String,
    /// Base unit that a value must have if it states one; `None` where any will do.
    unit: Option<&'static str>,
    with: With,
}

#[derive(Clone, Debug, PartialEq)]
enum With {
    Number(f64),
    Text(String),
}

/// Something is no condition.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ConditionError {
    /// No sign of comparison in it, or no name or value beside it.
    #[error(
        "'{text}' is no condition; write a name, one of = != < <= > >= and a value, as in depth>=2mm"
    )]
    Form {
        /// What was given.
        text: String,
    },
    /// Words are not larger or smaller.
    #[error("'{value}' in '{text}' is no number, so it can only be = or !=")]
    Words {
        /// What was given.
        text: String,
        /// The value in it.
        value: String,
    },
    /// A unit of something else.
    #[error("'{text}' gives two units, {name} and {value}; give one")]
    Units {
        /// What was given.
        text: String,
        /// The unit at the end of the name.
        name: String,
        /// The unit of the value.
        value: String,
    },
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
        let of = |source: Source| {
            let rest = name.strip_prefix(source.name())?.strip_prefix('.')?;
            Some((source, rest))
        };
        let (source, name) = match Source::ALL.into_iter().find_map(of) {
            Some((source, rest)) => (Some(source), rest),
            None => (None, name),
        };
        if name.is_empty() || value.is_empty() {
            return Err(form());
        }
        let is_order = !matches!(relation, Relation::Equal | Relation::Unequal);
        let ways = ways(text, name, value)?;
        let is_words = |way: &Way| matches!(way.with, With::Text(_));
        if is_order && ways.iter().all(is_words) {
            return Err(ConditionError::Words { text: text.to_owned(), value: value.to_owned() });
        }
        Ok(Self { source, relation, ways })
    }
}

fn ways(text: &str, name: &str, value: &str) -> Result<Vec<Way>, ConditionError> {
    let way = |name: &str, unit, with| Way { name: name.to_owned(), unit, with };
    let ending = name.rsplit_once('_').filter(|(stem, _)| !stem.is_empty());
    let ending = ending.and_then(|(stem, unit)| Some((stem, unit, base_unit(unit)?)));
    let of_value = split(value).filter(|(_, unit)| unit.is_empty() || base_unit(unit).is_some());
    let Some((number, unit)) = of_value else {
        return Ok(vec![way(name, None, With::Text(value.to_owned()))]);
    };
    let converted = |unit| With::Number(in_base_unit(number, unit).unwrap_or(number));
    match ending {
        None if unit.is_empty() => Ok(vec![way(name, None, With::Number(number))]),
        None => Ok(vec![way(name, base_unit(unit), converted(unit))]),
        Some((_, own, _)) if !unit.is_empty() && unit != own => Err(ConditionError::Units {
            text: text.to_owned(),
            name: own.to_owned(),
            value: unit.to_owned(),
        }),
        Some((stem, own, base)) => {
            Ok(vec![way(name, None, With::Number(number)), way(stem, Some(base), converted(own))])
        }
    }
}

impl Condition {
    /// Whether a session meets it. The catalog finds the same sessions with [`Condition::sql`].
    pub fn is_met(&self, entry: &Entry) -> bool {
        let is_way = |one: &Named, way: &Way| {
            let is_unit = way.unit.is_none_or(|unit| one.unit.is_empty() || one.unit == unit);
            let holds = match (&way.with, one.number) {
                (With::Number(right), Some(left)) => self.relation.holds(left, *right),
                (With::Text(right), _) => {
                    (one.text == *right) == (self.relation == Relation::Equal)
                }
                (With::Number(_), None) => false,
            };
            one.name == way.name && is_unit && holds
        };
        entry.named.iter().any(|one| {
            self.source.is_none_or(|source| one.source == source)
                && self.ways.iter().any(|way| is_way(one, way))
        })
    }

    /// The same as a condition on the table of sessions, and its values in order.
    pub(super) fn sql(&self, values: &mut Vec<Sql>) -> String {
        let mut ways = Vec::new();
        for way in &self.ways {
            values.push(way.name.clone().into());
            let mut text = "name = ?".to_owned();
            if let Some(unit) = way.unit {
                values.push(unit.to_owned().into());
                text += " AND unit IN ('', ?)";
            }
            let sign = self.relation.sign();
            text += &match &way.with {
                With::Number(number) => {
                    values.push((*number).into());
                    format!(" AND number {sign} ?")
                }
                With::Text(words) => {
                    values.push(words.clone().into());
                    format!(" AND text {sign} ?")
                }
            };
            ways.push(format!("({text})"));
        }
        let mut sql = format!("({})", ways.join(" OR "));
        if let Some(source) = self.source {
            values.push(source.name().to_owned().into());
            sql += " AND source = ?";
        }
        format!("id IN (SELECT session FROM named WHERE {sql})")
    }

    /// Whether values of these names are known at all, whatever they are and in whatever unit, as a condition on the table
    /// of named values.
    pub(super) fn sql_of_names(&self, values: &mut Vec<Sql>) -> String {
        values.extend(self.ways.iter().map(|way| Sql::from(way.name.clone())));
        let mut sql = vec!["?"; self.ways.len()].join(", ");
        sql = format!("name IN ({sql})");
        if let Some(source) = self.source {
            values.push(source.name().to_owned().into());
            sql += " AND source = ?";
        }
        sql
    }

    /// What is compared, as it was named.
    pub(super) fn name(&self) -> &str {
        &self.ways[0].name
    }

    /// The units that a value may be in; empty where any will do.
    pub(super) fn units(&self) -> Vec<&'static str> {
        if self.ways.iter().any(|way| way.unit.is_none()) {
            return Vec::new();
        }
        self.ways.iter().filter_map(|way| way.unit).collect()
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let way = &self.ways[0];
        match &way.with {
            With::Number(number) => write!(f, "{} {} {number}", way.name, self.relation.sign()),
            With::Text(words) => write!(f, "{} {} {words}", way.name, self.relation.sign()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(named: &[(&str, Option<f64>, &str, &str)]) -> Entry {
        let named = named.iter().map(|(name, number, unit, text)| Named {
            source: Source::Plan,
            name: (*name).to_owned(),
            number: *number,
            unit: (*unit).to_owned(),
            text: (*text).to_owned(),
        });
        Entry { named: named.collect(), ..Entry::default() }
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
    fn what_is_no_condition_is_told() {
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
