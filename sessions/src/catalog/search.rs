//! Search of the catalog: the query, its order, and the page that it finds.

use super::condition::Condition;
use super::entry::CatalogEntry;
use super::field::FieldWords;
use super::schema::{IDS, collect_rows};
use super::update::entry_of;
use super::{Catalog, CatalogError};
use crate::edits::{DataQuality, Review, ReviewDecision};
use chrono::{DateTime, Utc};
use rusqlite::types::{FromSql, Value as Sql};
use rusqlite::{Connection, OptionalExtension, params_from_iter};
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

/// Sort key; sessions with the same key are sorted by folder, and those of one start as they became known.
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
        let word = |is_descending| if is_descending { "DESC" } else { "ASC" };
        let (column, is_descending) = match self {
            Self::Started => return format!("session.id {}", word(!is_reversed)),
            Self::Specimen => ("specimen", false),
            Self::Operator => ("operator", false),
            Self::Protocol => ("protocol", false),
            Self::Duration => ("duration_s", true),
            Self::Verdict => ("verdict", false),
            Self::Review => ("review", false),
        };
        format!("{column} {}, folder {}", word(is_descending != is_reversed), word(is_reversed))
    }
}

/// One page of the sessions that meet a query.
#[derive(Clone, Debug, PartialEq)]
pub struct CatalogPage {
    /// Sessions on all pages.
    pub count: usize,
    /// Whether there are more than `count`: too many to count them all.
    pub has_more: bool,
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

/// A criterion of a query in SQL.
struct Criterion {
    /// Selects the identifiers of all sessions that meet it; none where that would read every session.
    set: Option<(String, Vec<Sql>)>,
    /// Is true for a row of `session` that meets it.
    test: (String, Vec<Sql>),
    /// Whether it is one on words, whose index yields the latest sessions first.
    is_words: bool,
}

impl Criterion {
    /// A criterion of one value.
    fn of_value(set: Option<&str>, test: &str, value: &str) -> Self {
        let with_value = |sql: &str| (sql.to_owned(), vec![Sql::from(value.to_owned())]);
        Self { set: set.map(with_value), test: with_value(test), is_words: false }
    }

    /// A criterion on a column, which has an index or none.
    fn column(name: &str, value: &str, has_index: bool) -> Self {
        let set = format!("SELECT id FROM session WHERE {name} = ?");
        // The sign keeps SQLite from the index.
        Self::of_value(has_index.then_some(&set), &format!("+session.{name} = ?"), value)
    }

    /// A bound of the start, inclusive from below and exclusive from above.
    fn start(sign: &str, at: DateTime<Utc>) -> Self {
        let ms = at.timestamp_millis();
        // The identifier bounds the search alone: it is not that of the start for sessions before 1970.
        let id = (ms.max(0) + i64::from(sign == "<")).saturating_mul(IDS);
        // A session that cannot be read has start 0.
        let test = format!(
            "session.id {sign} ? AND session.started_ms {sign} ? AND session.started_ms <> 0"
        );
        Self { set: None, test: (test, vec![id.into(), ms.into()]), is_words: false }
    }

    fn tag(tag: &str) -> Self {
        let test = "EXISTS (SELECT 1 FROM tag WHERE tag.session = session.id AND tag.tag = ?)";
        Self::of_value(Some("SELECT session AS id FROM tag WHERE tag = ?"), test, tag)
    }

    fn words(matches: &str) -> Self {
        let set = "SELECT rowid AS id FROM words WHERE words MATCH ?";
        let test = "EXISTS (SELECT 1 FROM words WHERE words MATCH ? AND words.rowid = session.id)";
        Self { is_words: true, ..Self::of_value(Some(set), test, matches) }
    }

    fn condition(condition: &Condition) -> Self {
        let (sql, values) = condition.sql();
        let set = format!(
            "SELECT owner AS id FROM named WHERE {sql} AND owner > 0 UNION ALL
             SELECT id FROM session WHERE plan IN (SELECT -owner FROM named WHERE {sql} AND owner < 0)"
        );
        let test = format!(
            "EXISTS (SELECT 1 FROM named INDEXED BY {OWNER_INDEX} WHERE owner IN (session.id, -session.plan) AND {sql})"
        );
        let both = [values.clone(), values.clone()].concat();
        Self { set: Some((set, both)), test: (test, values), is_words: false }
    }
}

/// The index by which a session's own values are looked up; SQLite would take the one by names, in which those of all sessions are.
const OWNER_INDEX: &str = "named_owner";

/// A statement and its values.
#[derive(Default)]
struct Statement {
    sql: String,
    values: Vec<Sql>,
}

impl Statement {
    fn new(sql: impl Into<String>) -> Self {
        Self { sql: sql.into(), values: Vec::new() }
    }

    fn add(&mut self, (sql, values): &(String, Vec<Sql>)) {
        self.sql += sql;
        self.values.extend_from_slice(values);
    }

    /// Criteria that a row of `session` must meet.
    fn add_tests<'a>(&mut self, criteria: impl IntoIterator<Item = &'a Criterion>) {
        for criterion in criteria {
            self.sql += " AND ";
            self.add(&criterion.test);
        }
    }

    fn read<T: FromSql>(&self, db: &Connection) -> rusqlite::Result<Vec<T>> {
        collect_rows(db, &self.sql, params_from_iter(&self.values), |row| row.get(0))
    }
}

impl CatalogQuery {
    fn criteria(&self) -> Vec<Criterion> {
        let mut criteria = Vec::new();
        for (name, value, has_index) in [
            ("specimen", &self.specimen, true),
            ("operator", &self.operator, true),
            ("protocol", &self.protocol, true),
            ("rig", &self.rig, false),
            ("cell", &self.cell, false),
        ] {
            criteria.extend(value.as_ref().map(|value| Criterion::column(name, value, has_index)));
        }
        criteria.extend(self.since.map(|at| Criterion::start(">=", at)));
        criteria.extend(self.before.map(|at| Criterion::start("<", at)));
        let verdict = self.verdict.map(|verdict| match verdict {
            QualityFilter::Given(verdict) => verdict.name(),
            QualityFilter::None => "",
        });
        criteria.extend(verdict.map(|word| Criterion::column("verdict", word, false)));
        let review = self.review.map(ReviewFilter::word);
        criteria.extend(review.map(|word| Criterion::column("review", word, false)));
        criteria.extend(self.tags.iter().map(|tag| Criterion::tag(tag)));
        let of_field = self.fields.iter().map(|one| (one.field.name(), &one.words));
        let matches = [("text", &self.words)].into_iter().chain(of_field);
        let matches: Vec<String> = matches.filter_map(|(column, text)| fts(column, text)).collect();
        if !matches.is_empty() {
            criteria.push(Criterion::words(&matches.join(" AND ")));
        }
        criteria.extend(self.conditions.iter().map(Criterion::condition));
        criteria
    }

    /// Selects `column` of all sessions that meet the query, in its order.
    fn all(&self, column: &str) -> Statement {
        let mut statement = Statement::new(format!("SELECT {column} FROM session WHERE TRUE"));
        for criterion in &self.criteria() {
            match &criterion.set {
                Some(set) => {
                    statement.sql += " AND session.id IN (";
                    statement.add(set);
                    statement.sql += ")";
                }
                None => statement.add_tests([criterion]),
            }
        }
        statement.sql += &format!(" ORDER BY {}", self.order.sql(self.is_reversed));
        statement
    }

    /// Identifiers of the first sessions in the order of their start: all that meet the query where they are at most `most`,
    /// else one more. The cost grows with `most` and not with the number of sessions, unless criteria that many sessions
    /// meet are met by few at once.
    fn first(&self, db: &Connection, most: usize) -> rusqlite::Result<Vec<i64>> {
        let criteria = self.criteria();
        let mut fewest = (most + 1, None);
        for (at, criterion) in criteria.iter().enumerate() {
            let Some(set) = &criterion.set else { continue };
            let mut counted = Statement::new("SELECT count(*) FROM (SELECT 1 FROM (");
            counted.add(set);
            counted.sql += &format!(") LIMIT {})", fewest.0);
            let count = counted.read::<i64>(db)?.first().map_or(0, |count| count.unsigned_abs());
            let count = usize::try_from(count).unwrap_or(usize::MAX);
            if count < fewest.0 {
                fewest = (count, Some(at));
            }
        }
        let from_words = || criteria.iter().position(|one| one.is_words);
        let first = fewest.1.or_else(from_words);
        let mut statement = Statement::default();
        let mut order = self.order.sql(self.is_reversed);
        match (fewest.1, first.and_then(|at| criteria[at].set.as_ref())) {
            (Some(_), Some(set)) => {
                statement.sql += "SELECT session.id FROM (SELECT DISTINCT id FROM (";
                statement.add(set);
                statement.sql += ")) AS few CROSS JOIN session ON session.id = few.id WHERE TRUE";
            }
            (None, Some((_, values))) => {
                statement.sql += "SELECT session.id FROM words CROSS JOIN session ON session.id = words.rowid WHERE words MATCH ?";
                statement.values.extend_from_slice(values);
                order = order.replace("session.id", "words.rowid");
            }
            _ => statement.sql += "SELECT session.id FROM session WHERE TRUE",
        }
        let rest = criteria.iter().enumerate().filter(|(at, _)| Some(*at) != first);
        statement.add_tests(rest.map(|(_, criterion)| criterion));
        statement.sql += &format!(" ORDER BY {order} LIMIT {}", most + 1);
        statement.read(db)
    }
}

/// Sessions that the pages of a search reach: more than any catalog has, and a number that SQLite can count to.
const PAGED: usize = u32::MAX as usize;

/// Sessions that a search counts; where more meet the query, the page says so.
const COUNTED: usize = 10_000;

impl Catalog {
    /// Finds sessions as of the last [`Catalog::update`].
    pub fn find(&self, query: &CatalogQuery) -> Result<CatalogPage, CatalogError> {
        self.find_counting(query, COUNTED)
    }

    /// As [`find`](Self::find), but of a page in the order of the starts, whose sessions are counted up to so many.
    pub fn find_counting(
        &self,
        query: &CatalogQuery,
        counted: usize,
    ) -> Result<CatalogPage, CatalogError> {
        let find = || -> rusqlite::Result<CatalogPage> {
            // One transaction, so that no other process changes the catalog between the two statements.
            let state = self.db.unchecked_transaction()?;
            let (mut ids, most) = match query.limit {
                Some(limit) if query.order == CatalogOrder::Started => {
                    let page_end = query.skip.saturating_add(limit);
                    let most = counted.max(page_end).min(PAGED);
                    (query.first(&state, most)?, most)
                }
                _ => (query.all("session.id").read(&state)?, usize::MAX),
            };
            let mut has_more = ids.len() > most;
            ids.truncate(most);
            let mut count = ids.len();
            if has_more && query.criteria().is_empty() {
                let all = Statement::new("SELECT count(*) FROM session").read::<i64>(&state)?;
                count = all.first().and_then(|&all| usize::try_from(all).ok()).unwrap_or(count);
                has_more = false;
            }
            let sql = "SELECT entry, checksum FROM entry WHERE id = ?";
            let mut statement = state.prepare_cached(sql)?;
            let page = ids.iter().skip(query.skip).take(query.limit.unwrap_or(usize::MAX));
            let entries = page.map(|id| statement.query_row([id], entry_of));
            let entries = entries.collect::<rusqlite::Result<_>>()?;
            Ok(CatalogPage { count, has_more, entries })
        };
        find().map_err(self.failed())
    }

    /// The folders of all sessions that meet the query, in its order, whatever its page: a list needs them to scroll.
    pub fn folders(&self, query: &CatalogQuery) -> Result<Vec<String>, CatalogError> {
        query.all("folder").read(&self.db).map_err(self.failed())
    }

    fn names(&self, sql: &str, values: &[Sql]) -> Result<Vec<String>, CatalogError> {
        collect_rows(&self.db, sql, params_from_iter(values), |row| row.get(0))
            .map_err(self.failed())
    }

    /// The entries of these folders; unknown folders are left out.
    pub fn entries(&self, folders: &[String]) -> Result<Vec<CatalogEntry>, CatalogError> {
        let read = || -> rusqlite::Result<Vec<CatalogEntry>> {
            let state = self.db.unchecked_transaction()?;
            let sql = "SELECT entry, checksum FROM session JOIN entry USING (id) WHERE folder = ?";
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
            // Plans whose sessions were all deleted are still there.
            let sql = format!(
                "SELECT DISTINCT unit FROM named WHERE {sql}
                 AND (owner > 0 OR -owner IN (SELECT plan FROM session)) ORDER BY unit"
            );
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
