//! What is looked for, and what is found.

use super::condition::Condition;
use super::entry::Entry;
use super::update::entry_of;
use super::{Catalog, CatalogError};
use crate::edits::{Decision, Review, Verdict};
use chrono::{DateTime, Utc};
use rusqlite::types::Value as Sql;
use rusqlite::{OptionalExtension, params_from_iter};
use std::str::FromStr;

/// Which sessions are looked for: those that meet all of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Query {
    /// Every word of it must begin a word of the session.
    pub words: String,
    /// The specimen, exactly.
    pub specimen: Option<String>,
    /// The operator, exactly.
    pub operator: Option<String>,
    /// The protocol's name, exactly.
    pub protocol: Option<String>,
    /// The rig's name, exactly.
    pub rig: Option<String>,
    /// The load cell's serial number, exactly.
    pub cell: Option<String>,
    /// Started then or later.
    pub since: Option<DateTime<Utc>>,
    /// Started before then.
    pub before: Option<DateTime<Utc>>,
    /// Conditions on named values.
    pub conditions: Vec<Condition>,
    /// What they are worth.
    pub verdict: Option<VerdictIs>,
    /// What a review came to.
    pub review: Option<ReviewIs>,
    /// Tags they all have.
    pub tags: Vec<String>,
    /// In which order they come.
    pub order: Order,
    /// The other way round.
    pub is_reversed: bool,
    /// So many of the first are left out.
    pub skip: usize,
    /// So many are told at most; `None` for all.
    pub limit: Option<usize>,
}

/// A verdict, or that there is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VerdictIs {
    /// That one.
    Given(Verdict),
    /// None was given.
    None,
}

impl FromStr for VerdictIs {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "none" => Ok(Self::None),
            text => text.parse().map(Self::Given).map_err(|err: String| format!("{err}, or none")),
        }
    }
}

/// What a review came to, or that there is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReviewIs {
    /// It stands, and decided so.
    Given(Decision),
    /// What was seen has changed since.
    Outdated,
    /// Nobody has looked.
    None,
}

impl ReviewIs {
    const ALL: [Self; 5] = [
        Self::Given(Decision::Accepted),
        Self::Given(Decision::Rejected),
        Self::Given(Decision::Repeat),
        Self::Outdated,
        Self::None,
    ];

    /// That of a session.
    #[must_use]
    pub fn of(review: Option<&Review>) -> Self {
        match review {
            None => Self::None,
            Some(review) if !review.changed.is_empty() => Self::Outdated,
            Some(review) => Self::Given(review.decision),
        }
    }

    /// The word for it.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Given(Decision::Accepted) => "accepted",
            Self::Given(Decision::Rejected) => "rejected",
            Self::Given(Decision::Repeat) => "repeat",
            Self::Outdated => "outdated",
            Self::None => "none",
        }
    }
}

impl FromStr for ReviewIs {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|one| one.word() == text);
        found.ok_or_else(|| {
            format!("'{text}' is no review; give accepted, rejected, repeat, outdated or none")
        })
    }
}

/// What sessions are sorted by; of equals, by folder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// The start, latest first.
    #[default]
    Started,
    /// The specimen.
    Specimen,
    /// The operator.
    Operator,
    /// The protocol.
    Protocol,
    /// The duration, longest first.
    Duration,
    /// The verdict, as a word.
    Verdict,
    /// The review, as a word.
    Review,
}

impl Order {
    fn sql(self, is_reversed: bool) -> &'static str {
        match (self, is_reversed) {
            (Self::Started, false) => "started_ms DESC, folder",
            (Self::Started, true) => "started_ms, folder DESC",
            (Self::Specimen, false) => "specimen, folder",
            (Self::Specimen, true) => "specimen DESC, folder DESC",
            (Self::Operator, false) => "operator, folder",
            (Self::Operator, true) => "operator DESC, folder DESC",
            (Self::Protocol, false) => "protocol, folder",
            (Self::Protocol, true) => "protocol DESC, folder DESC",
            (Self::Duration, false) => "duration_s DESC, folder",
            (Self::Duration, true) => "duration_s, folder DESC",
            (Self::Verdict, false) => "verdict, folder",
            (Self::Verdict, true) => "verdict DESC, folder DESC",
            (Self::Review, false) => "review, folder",
            (Self::Review, true) => "review DESC, folder DESC",
        }
    }
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Sessions that meet the query.
    pub count: usize,
    /// Those of the page that was asked for.
    pub entries: Vec<Entry>,
}

/// Names that sessions can be chosen by.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Choices {
    /// What was indented.
    pub specimens: Vec<String>,
    /// Who measured.
    pub operators: Vec<String>,
    /// Protocols by name.
    pub protocols: Vec<String>,
    /// Tags that some session has.
    pub tags: Vec<String>,
}

/// The words of a text. Anything but letters and digits parts them, so nothing in it is a sign to SQLite.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|letter: char| !letter.is_alphanumeric()).filter(|word| !word.is_empty())
}

impl Query {
    fn sql(&self) -> (String, Vec<Sql>) {
        let (mut parts, mut values) = (vec!["TRUE".to_owned()], Vec::new());
        for (column, wanted) in [
            ("specimen", &self.specimen),
            ("operator", &self.operator),
            ("protocol", &self.protocol),
            ("rig", &self.rig),
            ("cell", &self.cell),
        ] {
            if let Some(wanted) = wanted {
                parts.push(format!("{column} = ?"));
                values.push(wanted.clone().into());
            }
        }
        for (sign, wanted) in [(">=", self.since), ("<", self.before)] {
            if let Some(wanted) = wanted {
                // What cannot be read has no start.
                parts.push(format!("started_ms {sign} ? AND started_ms <> 0"));
                values.push(wanted.timestamp_millis().into());
            }
        }
        if let Some(verdict) = self.verdict {
            let word = match verdict {
                VerdictIs::Given(verdict) => verdict.name(),
                VerdictIs::None => "",
            };
            parts.push("verdict = ?".to_owned());
            values.push(word.to_owned().into());
        }
        if let Some(review) = self.review {
            parts.push("review = ?".to_owned());
            values.push(review.word().to_owned().into());
        }
        for tag in &self.tags {
            parts.push("id IN (SELECT session FROM tag WHERE tag = ?)".to_owned());
            values.push(tag.clone().into());
        }
        for condition in &self.conditions {
            parts.push(condition.sql(&mut values));
        }
        let quoted: Vec<String> = words(&self.words).map(|word| format!("\"{word}\"*")).collect();
        if !quoted.is_empty() {
            let sql = "id IN (SELECT rowid FROM words WHERE words MATCH ?)";
            parts.push(sql.to_owned());
            values.push(quoted.join(" ").into());
        }
        (parts.join(" AND "), values)
    }
}

impl Catalog {
    /// Finds sessions. What the catalog does not know yet is not found: see [`Catalog::update`].
    pub fn find(&self, query: &Query) -> Result<Found, CatalogError> {
        let find = || -> rusqlite::Result<Found> {
            // One state of the catalog for both steps, whoever writes meanwhile.
            let state = self.db.unchecked_transaction()?;
            let (meets, values) = query.sql();
            let order = query.order.sql(query.is_reversed);
            let sql = format!("SELECT id FROM session WHERE {meets} ORDER BY {order}");
            let mut statement = state.prepare_cached(&sql)?;
            let ids = statement.query_map(params_from_iter(&values), |row| row.get(0))?;
            let ids: Vec<i64> = ids.collect::<rusqlite::Result<_>>()?;
            let sql = "SELECT entry, checksum FROM session WHERE id = ?";
            let mut statement = state.prepare_cached(sql)?;
            let page = ids.iter().skip(query.skip);
            let page = page.take(query.limit.unwrap_or(usize::MAX));
            let entries = page.map(|id| statement.query_row([id], entry_of));
            Ok(Found { count: ids.len(), entries: entries.collect::<rusqlite::Result<_>>()? })
        };
        find().map_err(self.failed())
    }

    /// The folders of all sessions that meet the query, in its order: what a list needs before any of it is in sight.
    /// Pages do not count.
    pub fn folders(&self, query: &Query) -> Result<Vec<String>, CatalogError> {
        let find = || -> rusqlite::Result<Vec<String>> {
            let (meets, values) = query.sql();
            let order = query.order.sql(query.is_reversed);
            let sql = format!("SELECT folder FROM session WHERE {meets} ORDER BY {order}");
            let mut statement = self.db.prepare_cached(&sql)?;
            let folders = statement.query_map(params_from_iter(&values), |row| row.get(0))?;
            folders.collect()
        };
        find().map_err(self.failed())
    }

    /// What is known of the sessions in these folders; of one that the catalog does not know, nothing.
    pub fn entries(&self, folders: &[String]) -> Result<Vec<Entry>, CatalogError> {
        let read = || -> rusqlite::Result<Vec<Entry>> {
            let state = self.db.unchecked_transaction()?;
            let sql = "SELECT entry, checksum FROM session WHERE folder = ?";
            let mut statement = state.prepare_cached(sql)?;
            let mut entries = Vec::with_capacity(folders.len());
            for folder in folders {
                entries.extend(statement.query_row([folder], entry_of).optional()?);
            }
            Ok(entries)
        };
        read().map_err(self.failed())
    }

    /// The names that sessions can be chosen by, each in alphabetical order.
    pub fn choices(&self) -> Result<Choices, CatalogError> {
        let names = |sql: &str| -> rusqlite::Result<Vec<String>> {
            let mut statement = self.db.prepare_cached(sql)?;
            let names = statement.query_map([], |row| row.get(0))?;
            names.collect()
        };
        let of = |column: &str| {
            names(&format!(
                "SELECT DISTINCT {column} FROM session WHERE {column} <> '' ORDER BY {column}"
            ))
        };
        let all = || -> rusqlite::Result<Choices> {
            Ok(Choices {
                specimens: of("specimen")?,
                operators: of("operator")?,
                protocols: of("protocol")?,
                tags: names("SELECT DISTINCT tag FROM tag ORDER BY tag")?,
            })
        };
        all().map_err(self.failed())
    }

    /// What cannot be found because it is never so: a sentence for each condition on a value that no session has, or has in
    /// units of something else.
    pub fn doubts(&self, conditions: &[Condition]) -> Result<Vec<String>, CatalogError> {
        let units = |condition: &Condition| -> rusqlite::Result<Vec<String>> {
            let mut values = Vec::new();
            let sql = condition.sql_of_names(&mut values);
            let sql = format!("SELECT DISTINCT unit FROM named WHERE {sql} ORDER BY unit");
            let mut statement = self.db.prepare_cached(&sql)?;
            let units = statement.query_map(params_from_iter(&values), |row| row.get(0))?;
            units.collect()
        };
        let mut doubts = Vec::new();
        for condition in conditions {
            let name = condition.name();
            let there = units(condition).map_err(self.failed())?;
            let wanted = condition.units();
            let is_fit = |unit: &String| {
                unit.is_empty() || wanted.is_empty() || wanted.contains(&unit.as_str())
            };
            if there.is_empty() {
                doubts.push(format!(
                    "no session has a value called {name}; names are those of parameters, of what is told of sessions and of fits"
                ));
            } else if !there.iter().any(is_fit) {
                doubts.push(format!(
                    "no session has {name} in {}; it is in {} where it is",
                    wanted.join(" or "),
                    there.join(" or ")
                ));
            }
        }
        Ok(doubts)
    }
}
