//! Tables of results: a row for each number that a session or a study gave, and the whole result as an object.
//!
//! A computation is named by the SHA-256 of everything that determines it, and is in its table once, whoever computed it and
//! however often a worker was killed and began again.

use crate::error::StoreError;
use crate::files::object_path;
use crate::location::{REQUESTS, Store};
use crate::mirror::Hear;
use crate::part::{OTHER_BYTES, Part, columns_of, is_named, part_of, read_frame, unwritable};
use crate::push::TRIES_MAX;
use crate::table::{Shape, Table};
use bytes::Bytes;
use chrono::{DateTime, SecondsFormat, Utc};
use futures_util::stream::{self, StreamExt, TryStreamExt};
use object_store::path::Path;
use palpate_sessions::text::sha256;
use polars_core::prelude::DataFrame;
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

palpate_model::named! {
    /// A table of results.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum ResultTable {
        /// Force models, one fit for each session.
        Fits = "fits",
        /// Contact laws, one modulus for each session.
        Moduli = "moduli",
        /// Populations of many sessions.
        Populations = "populations",
    }
}

/// Results in one change of a table. One has some ten rows.
const BATCH: usize = 2_000;

/// One number of a result.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ResultNumber {
    /// What the number is of the parameter: its value, or a term of a population.
    pub term: String,
    pub parameter: String,
    /// Of value, errors and intervals; empty where they have none.
    pub unit: String,
    pub value: f64,
    /// Standard error; of a modulus the standard uncertainty of all sources.
    pub std_error: Option<f64>,
    /// Ends of the 95 % interval.
    pub ci95: [Option<f64>; 2],
    /// Standard uncertainty that the calibration adds.
    pub systematic_error: Option<f64>,
    /// Ends of the 95 % interval of everything that is known to be uncertain.
    pub total95: [Option<f64>; 2],
    /// Whether it was kept at a given value.
    pub is_fixed: bool,
}

/// What was computed from a session or a study.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyResult {
    /// None of a population.
    pub session_id: Option<String>,
    /// Key of the model or of the law.
    pub model: String,
    pub software_version: String,
    /// Everything except the data that determines the result.
    pub settings: Value,
    /// What identifies the data.
    pub data: Value,
    /// The whole result.
    pub text: String,
    pub numbers: Vec<ResultNumber>,
}

/// What became of results that were to be added.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ResultsOutcome {
    pub added: usize,
    /// Results of computations that the table has.
    pub known: usize,
}

impl ResultTable {
    pub(crate) const fn shape(self) -> &'static Shape {
        match self {
            Self::Fits => &Shape { name: "fits", columns, key: KEY },
            Self::Moduli => &Shape { name: "moduli", columns, key: KEY },
            Self::Populations => &Shape { name: "populations", columns, key: KEY },
        }
    }
}

const KEY: &str = "computation_sha256";

type Word = fn(&Row<'_>) -> Option<String>;
type Number = fn(&Row<'_>) -> Option<f64>;

const WORDS: [(&str, Word); 11] = [
    (KEY, |row| Some(row.computation.clone())),
    ("result_sha256", |row| Some(row.content.clone())),
    ("added_at", |row| Some(row.added_at.to_owned())),
    ("session_id", |row| row.result.session_id.clone()),
    ("model", |row| Some(row.result.model.clone())),
    ("term", |row| Some(row.number.term.clone())),
    ("parameter", |row| Some(row.number.parameter.clone())),
    ("unit", |row| Some(row.number.unit.clone())),
    ("software_version", |row| Some(row.result.software_version.clone())),
    ("settings", |row| Some(row.result.settings.to_string())),
    ("data", |row| Some(row.result.data.to_string())),
];

const NUMBERS: [(&str, Number); 7] = [
    ("value", |row| Some(row.number.value)),
    ("std_error", |row| row.number.std_error),
    ("ci95_low", |row| row.number.ci95[0]),
    ("ci95_high", |row| row.number.ci95[1]),
    ("systematic_error", |row| row.number.systematic_error),
    ("total95_low", |row| row.number.total95[0]),
    ("total95_high", |row| row.number.total95[1]),
];

const IS_FIXED: &str = "is_fixed";

fn columns() -> Vec<(&'static str, &'static str)> {
    let words = WORDS.iter().map(|(name, _)| (*name, "string"));
    let numbers = NUMBERS.iter().map(|(name, _)| (*name, "double"));
    words.chain(numbers).chain([(IS_FIXED, "boolean")]).collect()
}

/// A result with the names of its computation and of its object.
struct NamedResult<'a> {
    computation: String,
    content: String,
    result: &'a StudyResult,
}

struct Row<'a> {
    computation: &'a String,
    content: &'a String,
    added_at: &'a str,
    result: &'a StudyResult,
    number: &'a ResultNumber,
}

impl<'a> NamedResult<'a> {
    fn of(table: ResultTable, result: &'a StudyResult) -> Self {
        let determined_by = json!({
            "table": table.name(), "session_id": result.session_id, "model": result.model,
            "software_version": result.software_version, "settings": result.settings, "data": result.data,
        });
        Self {
            computation: sha256(determined_by.to_string().as_bytes()),
            content: sha256(result.text.as_bytes()),
            result,
        }
    }
}

impl Store {
    /// Adds results to a table, which is made with the first of them; those whose computation is there are passed over.
    pub fn add_results(
        &self,
        table: ResultTable,
        results: &[StudyResult],
        now: fn() -> DateTime<Utc>,
        hear: Hear<'_>,
    ) -> Result<ResultsOutcome, StoreError> {
        let mut outcome = ResultsOutcome::default();
        if results.is_empty() {
            return Ok(outcome);
        }
        self.wait(async {
            self.probe(now()).await?;
            let of_store = Table { store: self, shape: table.shape() };
            of_store.ensure(now()).await?;
            let mut known = KnownResults::default();
            for (batch, first) in results.chunks(BATCH).zip((0..).step_by(BATCH)) {
                if hear(first, results.len()).is_break() {
                    return Err(StoreError::Ended);
                }
                let named = batch.iter().map(|one| NamedResult::of(table, one)).collect();
                let added = of_store.add_results(named, &mut known, now).await?;
                outcome.added += added;
                outcome.known += batch.len() - added;
            }
            let _ = hear(results.len(), results.len());
            Ok(outcome)
        })
    }
}

/// What was read of a table: another writer may add files of rows, and a compaction joins them.
#[derive(Default)]
struct KnownResults {
    parts: BTreeSet<String>,
    computations: BTreeSet<String>,
}

impl Table<'_> {
    /// Number of results that were added.
    async fn add_results(
        self,
        results: Vec<NamedResult<'_>>,
        known: &mut KnownResults,
        now: fn() -> DateTime<Utc>,
    ) -> Result<usize, StoreError> {
        let mut new: BTreeMap<String, NamedResult<'_>> =
            results.into_iter().map(|one| (one.computation.clone(), one)).collect();
        let mut are_stored = false;
        for _ in 0..TRIES_MAX {
            let snapshot = self.snapshot().await?.ok_or_else(|| self.gone())?;
            let unseen = snapshot.parts.keys().filter(|part| !known.parts.contains(*part));
            let read = stream::iter(unseen).map(|part| self.computations(self.path(part)));
            let read: Vec<_> = read.buffered(REQUESTS).try_collect().await?;
            known.computations.extend(read.into_iter().flatten());
            known.parts.extend(snapshot.parts.into_keys());
            new.retain(|computation, _| !known.computations.contains(computation));
            if new.is_empty() {
                return Ok(0);
            }
            if !are_stored {
                // Before the rows, so that every row has its object.
                let objects = new.values().map(|one| {
                    let bytes = Bytes::from(one.result.text.clone());
                    async { self.store.put_new(&object_path(&one.content), bytes).await }
                });
                let _: Vec<bool> = stream::iter(objects).buffered(REQUESTS).try_collect().await?;
                are_stored = true;
            }
            let at = now();
            let metadata = snapshot.metadata.as_ref().ok_or_else(|| self.gone())?;
            let part = self.rows(new.values(), at)?;
            if self.append(snapshot.version + 1, &metadata.schema_string, part, at).await? {
                return Ok(new.len());
            }
        }
        Err(StoreError::Crowded { tries: TRIES_MAX })
    }

    fn rows<'a>(
        self,
        results: impl Iterator<Item = &'a NamedResult<'a>>,
        now: DateTime<Utc>,
    ) -> Result<Part, StoreError> {
        let added_at = now.to_rfc3339_opts(SecondsFormat::Millis, true);
        let rows = results.flat_map(|NamedResult { computation, content, result }| {
            let added_at = added_at.as_str();
            result.numbers.iter().map(move |number| Row {
                computation,
                content,
                added_at,
                result,
                number,
            })
        });
        let rows: Vec<Row<'_>> = rows.collect();
        let fixed = [(IS_FIXED, |row: &Row<'_>| row.number.is_fixed)];
        let columns =
            [columns_of(&rows, &WORDS), columns_of(&rows, &NUMBERS), columns_of(&rows, &fixed)];
        let frame = DataFrame::new(rows.len(), columns.concat());
        part_of(self.shape, frame.map_err(unwritable(self.shape))?, true, now)
    }

    /// The computations of a file of rows.
    async fn computations(self, path: Path) -> Result<BTreeSet<String>, StoreError> {
        let numbers = self.result_rows(&path, &[KEY]).await?;
        Ok(numbers.into_iter().map(|[computation]| computation).collect())
    }

    /// Some columns of texts of a file of rows.
    async fn result_rows<const N: usize>(
        self,
        path: &Path,
        names: &[&str; N],
    ) -> Result<Vec<[String; N]>, StoreError> {
        let failed = |reason: &dyn ToString| StoreError::bad(path, reason.to_string());
        let bytes = self.store.read(path).await?.ok_or_else(|| failed(&"it is missing"))?;
        if !is_named(path, &bytes) {
            return Err(failed(&OTHER_BYTES));
        }
        let wanted = names.map(str::to_owned).to_vec();
        let frame = read_frame(&bytes, Some(wanted)).map_err(|err| failed(&err))?;
        let mut rows = vec![[const { String::new() }; N]; frame.height()];
        for (k, name) in names.iter().enumerate() {
            let column = frame.column(name).and_then(|one| one.str().cloned());
            let column = column.map_err(|err| failed(&err))?;
            for (row, text) in rows.iter_mut().zip(column.iter()) {
                text.unwrap_or_default().clone_into(&mut row[k]);
            }
        }
        Ok(rows)
    }

    /// Objects of results by their computations and numbers, and what is wrong with the rows.
    pub(crate) async fn verify_results(self) -> Result<VerifiedResults, StoreError> {
        let mut found = VerifiedResults::default();
        let Some(snapshot) = self.snapshot().await? else { return Ok(found) };
        let mut numbers = BTreeSet::new();
        for part in snapshot.parts.keys() {
            let path = self.path(part);
            let rows = self.result_rows(&path, &[KEY, "result_sha256", "term", "parameter"]).await;
            let rows = match rows {
                Ok(rows) => rows,
                Err(err) => {
                    found.faults.push((path.to_string(), err.to_string()));
                    continue;
                }
            };
            for [computation, content, term, parameter] in rows {
                if !numbers.insert((computation.clone(), term, parameter.clone())) {
                    let place = format!("{parameter} of the computation {computation}");
                    found.faults.push((place, "it is in the table twice".into()));
                }
                found.objects.insert(computation, content);
            }
        }
        Ok(found)
    }
}

/// What a table of results names.
#[derive(Default)]
pub(crate) struct VerifiedResults {
    /// SHA-256 of the whole result by the computation.
    pub objects: BTreeMap<String, String>,
    /// Places and sentences.
    pub faults: Vec<(String, String)>,
}
