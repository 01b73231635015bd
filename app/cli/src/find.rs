//! `palpate find`: searches the sessions of the library.

use super::arguments::{Choice, choice};
use super::catalog::use_updated_catalog;
use super::output::Output;
use super::{Command, Failure, library};
use chrono::{DateTime, Utc};
use clap::Args;
use palpate_analysis::catalog_search::find;
use palpate_analysis::report::catalog as report;
use palpate_analysis::shared_library::SharedLibrary;
use palpate_sessions::catalog::{
    CatalogOrder, CatalogPage, CatalogQuery, Condition, QualityFilter, ReviewFilter, parse_end,
    parse_query_line, parse_start,
};
use palpate_sessions::library_folder;
use std::num::NonZeroUsize;

/// Find sessions of the library
#[derive(Debug, Args)]
pub struct FindArgs {
    /// Words to search for, each the beginning of a word in the session; specimen:WORD, operator:, protocol:, rig:, cell:
    /// and tag: look in one field, and depth>=2mm is a condition
    #[arg(value_name = "WORD")]
    words: Vec<String>,
    /// Search a store instead of this computer's library, as in s3://bucket/folder or file:///folder
    #[arg(long, value_name = "STORE")]
    store: Option<String>,
    /// The specimen, exactly
    #[arg(long, value_name = "NAME")]
    specimen: Option<String>,
    /// The operator, exactly
    #[arg(long, value_name = "NAME")]
    operator: Option<String>,
    /// The protocol's name, exactly
    #[arg(long, value_name = "NAME")]
    protocol: Option<String>,
    /// The rig's name, exactly
    #[arg(long, value_name = "NAME")]
    rig: Option<String>,
    /// Serial number of the load cell, exactly
    #[arg(long, value_name = "NUMBER")]
    cell: Option<String>,
    /// Started on this day or later, UTC, or at a time such as 2026-03-05T14:00:00Z
    #[arg(long, value_name = "DAY", value_parser = parse_start)]
    since: Option<DateTime<Utc>>,
    /// Started on this day or before, UTC, or before a time
    #[arg(long, value_name = "DAY", value_parser = parse_end)]
    until: Option<DateTime<Utc>>,
    /// A condition on a value of the protocol, on details of the session or on a saved fit, as in
    /// depth>=2mm, specimen.thickness_mm<12 or fit.tau_eps>1.5; may be repeated
    #[arg(long = "where", value_name = "CONDITION")]
    conditions: Vec<Condition>,
    /// valid, suspect, rejected or none
    #[arg(long)]
    verdict: Option<QualityFilter>,
    /// A tag; may be repeated
    #[arg(long = "tag", value_name = "TAG")]
    tags: Vec<String>,
    /// accepted, rejected, repeat, outdated or none
    #[arg(long)]
    review: Option<ReviewFilter>,
    /// Sort order
    #[arg(long, value_parser = choice(&SORTS), default_value = "started")]
    sort: CatalogOrder,
    /// Reverse the order
    #[arg(long)]
    reverse: bool,
    /// Sessions on a page
    #[arg(long, value_name = "N", default_value = "20")]
    limit: NonZeroUsize,
    /// Which page, from 1
    #[arg(long, value_name = "N", default_value = "1")]
    page: NonZeroUsize,
}

const SORTS: [Choice<CatalogOrder>; 7] = [
    ("started", CatalogOrder::Started, "Latest first"),
    ("specimen", CatalogOrder::Specimen, "By specimen"),
    ("operator", CatalogOrder::Operator, "By operator"),
    ("protocol", CatalogOrder::Protocol, "By protocol"),
    ("duration", CatalogOrder::Duration, "Longest first"),
    ("verdict", CatalogOrder::Verdict, "By verdict, in alphabetical order"),
    ("review", CatalogOrder::Review, "By review, in alphabetical order"),
];

impl FindArgs {
    /// The query of the options and of a typed line: the words of the command line, and `more`.
    fn query(&self, more: &str) -> Result<CatalogQuery, Failure> {
        let limit = self.limit.get();
        let line = format!("{more} {}", self.words.join(" "));
        let mut line = parse_query_line(&line).map_err(Failure::usage)?;
        line.conditions.extend(self.conditions.iter().cloned());
        Ok(CatalogQuery {
            words: line.words,
            fields: line.fields,
            specimen: self.specimen.clone(),
            operator: self.operator.clone(),
            protocol: self.protocol.clone(),
            rig: self.rig.clone(),
            cell: self.cell.clone(),
            since: self.since,
            before: self.until,
            conditions: line.conditions,
            verdict: self.verdict,
            review: self.review,
            tags: self.tags.clone(),
            order: self.sort,
            is_reversed: self.reverse,
            skip: limit.saturating_mul(self.page.get() - 1),
            limit: Some(limit),
        })
    }
}

/// The query of a typed line and of options of `palpate find`, for a front end in the same process.
pub fn find_query(line: &str, options: &[String]) -> Result<CatalogQuery, Failure> {
    match super::parse_options("find", options)? {
        Command::Find(args) => args.query(line),
        _ => Err(Failure::usage("these are not options of 'palpate find'")),
    }
}

pub(super) fn run(args: &FindArgs, output: &Output) -> Result<(), Failure> {
    let (limit, page) = (args.limit.get(), args.page.get());
    let query = args.query("")?;
    let (library, (found, doubts)) = match &args.store {
        Some(store) => find_in_store(store, &query, output)?,
        None => {
            let library = library_folder().map_err(Failure::usage)?;
            let found = use_updated_catalog(&library, output, |catalog| find(catalog, &query))?;
            (library.display().to_string(), found)
        }
    };
    doubts.iter().for_each(|doubt| output.note(doubt));
    let pages = found.count.div_ceil(limit);
    let object = serde_json::json!({
        "library": library, "count": found.count, "has_more": found.has_more, "page": page, "pages": pages,
        "sessions": found.entries,
    });
    output.answer("find", &object, || report::list(&found, page, pages));
    Ok(())
}

/// Finds a page of a store's sessions. A store that does not answer is searched as it was last seen.
fn find_in_store(
    store: &str,
    query: &CatalogQuery,
    output: &Output,
) -> Result<(String, (CatalogPage, Vec<String>)), Failure> {
    let bar = output.count_bar(0);
    let (mirror, unreachable) = SharedLibrary::last_seen(store, &bar).map_err(library::failure)?;
    drop(bar);
    if let Some(reason) = unreachable {
        output.note(&format!("the search is of what was last seen of the store: {reason}"));
    }
    let found = find(mirror.catalog(), query).map_err(Failure::failed)?;
    Ok((store.to_owned(), found))
}
