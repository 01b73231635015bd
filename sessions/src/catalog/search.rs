//! Search of the catalog: the query, its order, and the page that it finds.

use super::condition::Condition;
use super::entry::CatalogEntry;
use super::field::FieldWords;
use super::schema::collect_rows;
use super::update::entry_of;
use super::{Catalog, CatalogError};
use crate::edits::{DataQuality, Review, ReviewDecision};
use chrono::{DateTime, Utc};
use rusqlite::types::Value as Sql;
use rusqlite::{OptionalExtension, params_from_iter};
use std::str::FromStr;

/// Sessions that meet every given criterion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CatalogQuery {
    /// Every word must begin a word of the session.
    pub words: String,
    /// Every word must begin a word of its field.
    pub fields: Vec<FieldWords>,
    /// Compared exactly, as are the next four.
    pub specimen: Option<String>,
    pub operator: Option<String>,
    /// The protocol's name.
    pub protocol: Option<String>,
    /// The rig's name.
    pub rig: Option<String>,
    /// The load cell's serial number.
    pub cell: Option<String>,
    /// Start of the session, inclusive.
    pub since: Option<DateTime<Utc>>,
    /// Start of the session, exclusive.
    pub before: Option<DateTime<Utc>>,
    pub conditions: Vec<Condition>,
    pub verdict: Option<QualityFilter>,
    pub review: Option<ReviewFilter>,
    /// The session must have all of them.
    pub tags: Vec<String>,
    pub order: CatalogOrder,
    pub is_reversed: bool,
    /// Number of sessions before the page.
    pub skip: usize,
    /// Largest number of sessions on the page; `None` for all.
    pub limit: Option<usize>,
}

/// Criterion on the data quality.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QualityFilter {
    Given(DataQuality),
    None,
}

impl FromStr for QualityFilter {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "none" => Ok(Self::None),
            text => text.parse().map(Self::Given).map_err(|err: String| format!("{err}, or none")),
        }
    }
}

/// Criterion on the review.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReviewFilter {
    /// The review is up to date and made this decision.
    Given(ReviewDecision),
    /// What the reviewer saw has changed since.
    Outdated,
    None,
}

impl ReviewFilter {
    const ALL: [Self; 5] = [
        Self::Given(ReviewDecision::Accepted),
        Self::Given(ReviewDecision::Rejected),
        Self::Given(ReviewDecision::Repeat),
        Self::Outdated,
        Self::None,
    ];

    #[must_use]
    pub fn of(review: Option<&Review>) -> Self {
        match review {
            None => Self::None,
            Some(review) if !review.changed.is_empty() => Self::Outdated,
            Some(review) => Self::Given(review.decision),
        }
    }

    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Given(ReviewDecision::Accepted) => "accepted",
            Self::Given(ReviewDecision::Rejected) => "rejected",
            Self::Given(ReviewDecision::Repeat) => "repeat",
            Self::Outdated => "outdated",
            Self::None => "none",
        }
    }
}

impl FromStr for ReviewFilter {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|one| one.word() == text);
        found.ok_or_else(|| {
            format!(
                "'{text}' is not a review state; give accepted, rejected, repeat, outdated or none"
            )
        })
    }
}

/// Sort key; sessions with the same key are sorted by folder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CatalogOrder {
    /// Latest first.
    #[default]
    Started,
    Specimen,
    Operator,
    Protocol,
    /// Longest first.
    Duration,
    /// Alphabetical by the word.
    Verdict,
    /// Alphabetical by the word.
    Review,
}

impl CatalogOrder {
    fn sql(self, is_reversed: bool) -> String {
        let (column, is_descending) = match self {
            Self::Started => ("started_ms", true),
            Self::Specimen => ("specimen", false),
            Self::Operator => ("operator", false),
            Self::Protocol => ("protocol", false),
            Self::Duration => ("duration_s", true),
            Self::Verdict => ("verdict", false),
            Self::Review => ("review", false),
        };
        let word = |is_descending| if is_descending { "DESC" } else { "ASC" };
        format!("{column} {}, folder {}", word(is_descending != is_reversed), word(is_reversed))
    }
}

/// One page of the sessions that meet a query.
#[derive(Clone, Debug, PartialEq)]
pub struct CatalogPage {
    /// Sessions on all pages.
    pub count: usize,
    pub entries: Vec<CatalogEntry>,
}

/// Values that a form offers for the criteria of a query.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CatalogChoices {
    pub specimens: Vec<String>,
    pub operators: Vec<String>,
    pub protocols: Vec<String>,
    pub tags: Vec<String>,
}

/// The words of a text. All but letters and digits separates them, so nothing in a word is syntax to SQLite.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|letter: char| !letter.is_alphanumeric()).filter(|word| !word.is_empty())
}

/// The query of the full-text index for words of which each begins a word of this column; `None` without words.
fn fts(column: &str, text: &str) -> Option<String> {
    let quoted: Vec<String> = words(text).map(|word| format!("\"{word}\"*")).collect();
    (!quoted.is_empty()).then(|| format!("{column} : ({})", quoted.join(" ")))
}

impl CatalogQuery {
    /// Selects `column` of the sessions that meet the query, in its order; and the values of the statement.
    fn sql(&self, column: &str) -> (String, Vec<Sql>) {
        let (mut parts, mut values) = (vec!["TRUE".to_owned()], Vec::new());
        let mut add = |part: String, value: Sql| {
            parts.push(part);
            values.push(value);
        };
        for (column, value) in [
            ("specimen", &self.specimen),
            ("operator", &self.operator),
            ("protocol", &self.protocol),
            ("rig", &self.rig),
            ("cell", &self.cell),
        ] {
            if let Some(value) = value {
                add(format!("{column} = ?"), value.clone().into());
            }
        }
        for (sign, value) in [(">=", self.since), ("<", self.before)] {
            if let Some(value) = value {
                // A session that cannot be read has start 0.
                let part = format!("started_ms {sign} ? AND started_ms <> 0");
                add(part, value.timestamp_millis().into());
            }
        }
        if let Some(verdict) = self.verdict {
            let word = match verdict {
                QualityFilter::Given(verdict) => verdict.name(),
                QualityFilter::None => "",
            };
            add("verdict = ?".to_owned(), word.to_owned().into());
        }
        if let Some(review) = self.review {
            add("review = ?".to_owned(), review.word().to_owned().into());
        }
        for tag in &self.tags {
            let part = "id IN (SELECT session FROM tag WHERE tag = ?)";
            add(part.to_owned(), tag.clone().into());
        }
        let of_field = self.fields.iter().map(|one| (one.field.name(), &one.words));
        let matches = [("text", &self.words)].into_iter().chain(of_field);
        let matches: Vec<String> = matches.filter_map(|(column, text)| fts(column, text)).collect();
        if !matches.is_empty() {
            let part = "id IN (SELECT rowid FROM words WHERE words MATCH ?)";
            add(part.to_owned(), matches.join(" AND ").into());
        }
        for condition in &self.conditions {
            parts.push(condition.sql(&mut values));
        }
        let order = self.order.sql(self.is_reversed);
        let criteria = parts.join(" AND ");
        (format!("SELECT {column} FROM session WHERE {criteria} ORDER BY {order}"), values)
    }
}

impl Catalog {
    /// Finds sessions as of the last [`Catalog::update`].
    pub fn find(&self, query: &CatalogQuery) -> Result<CatalogPage, CatalogError> {
        let find = || -> rusqlite::Result<CatalogPage> {
            // One transaction, so that no other process changes the catalog between the two statements.
            let state = self.db.unchecked_transaction()?;
            let (sql, values) = query.sql("id");
            let ids: Vec<i64> =
                collect_rows(&state, &sql, params_from_iter(&values), |row| row.get(0))?;
            let sql = "SELECT entry, checksum FROM session WHERE id = ?";
            let mut statement = state.prepare_cached(sql)?;
            let page = ids.iter().skip(query.skip).take(query.limit.unwrap_or(usize::MAX));
            let entries = page.map(|id| statement.query_row([id], entry_of));
            Ok(CatalogPage { count: ids.len(), entries: entries.collect::<rusqlite::Result<_>>()? })
        };
        find().map_err(self.failed())
    }

    /// The folders of all sessions that meet the query, in its order, whatever its page: a list needs them to scroll.
    pub fn folders(&self, query: &CatalogQuery) -> Result<Vec<String>, CatalogError> {
        let (sql, values) = query.sql("folder");
        self.names(&sql, &values)
    }

    fn names(&self, sql: &str, values: &[Sql]) -> Result<Vec<String>, CatalogError> {
        collect_rows(&self.db, sql, params_from_iter(values), |row| row.get(0))
            .map_err(self.failed())
    }

    /// The entries of these folders; unknown folders are left out.
    pub fn entries(&self, folders: &[String]) -> Result<Vec<CatalogEntry>, CatalogError> {
        let read = || -> rusqlite::Result<Vec<CatalogEntry>> {
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

    /// Each list is in alphabetical order.
    pub fn choices(&self) -> Result<CatalogChoices, CatalogError> {
        let of = |table: &str, column: &str| {
            let sql = format!(
                "SELECT DISTINCT {column} FROM {table} WHERE {column} <> '' ORDER BY {column}"
            );
            self.names(&sql, &[])
        };
        Ok(CatalogChoices {
            specimens: of("session", "specimen")?,
            operators: of("session", "operator")?,
            protocols: of("session", "protocol")?,
            tags: of("tag", "tag")?,
        })
    }

    /// One sentence for each condition that no session can meet, because none has the value, or none in such a unit.
    pub fn condition_warnings(
        &self,
        conditions: &[Condition],
    ) -> Result<Vec<String>, CatalogError> {
        let mut doubts = Vec::new();
        for condition in conditions {
            let name = condition.name();
            let mut values = Vec::new();
            let sql = condition.sql_of_names(&mut values);
            let sql = format!("SELECT DISTINCT unit FROM named WHERE {sql} ORDER BY unit");
            let present = self.names(&sql, &values)?;
            let units = condition.units();
            let is_fit = |unit: &String| {
                unit.is_empty() || units.is_empty() || units.contains(&unit.as_str())
            };
            if present.is_empty() {
                doubts.push(format!(
                    "no session has a value named {name}; give the name of a parameter, a fact about the specimen, or a fitted parameter"
                ));
            } else if !present.iter().any(is_fit) {
                doubts.push(format!(
                    "no session has {name} in {}; the sessions have {name} in {}",
                    units.join(" or "),
                    present.join(" or ")
                ));
            }
        }
        Ok(doubts)
    }
}
