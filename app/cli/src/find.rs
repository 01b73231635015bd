//! `palpate find`: sessions of the library by what is known of them.

use super::Failure;
use super::catalog::with_updated;
use super::output::Output;
use chrono::{DateTime, Utc};
use clap::{Args, ValueEnum};
use palpate_analysis::report::catalog as report;
use palpate_sessions::catalog::{
    Condition, Entry, Order, Query, ReviewIs, VerdictIs, beginning, ending,
};
use palpate_sessions::library_folder;
use serde::Serialize;
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Find sessions of the library
#[derive(Debug, Args)]
pub struct FindArgs {
    /// Words, each of which begins some word of the session
    #[arg(value_name = "WORD")]
    words: Vec<String>,
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
    #[arg(long, value_name = "DAY", value_parser = beginning)]
    since: Option<DateTime<Utc>>,
    /// Started on this day or before, UTC, or before a time
    #[arg(long, value_name = "DAY", value_parser = ending)]
    until: Option<DateTime<Utc>>,
    /// A condition on a value of the protocol, on what was told or on a saved fit, as in
    /// depth>=2mm, specimen.thickness_mm<12 or fit.tau_eps>1.5; may be repeated
    #[arg(long = "where", value_name = "CONDITION")]
    conditions: Vec<Condition>,
    /// valid, suspect, rejected or none
    #[arg(long)]
    verdict: Option<VerdictIs>,
    /// A tag; may be repeated
    #[arg(long = "tag", value_name = "TAG")]
    tags: Vec<String>,
    /// accepted, rejected, repeat, outdated or none
    #[arg(long)]
    review: Option<ReviewIs>,
    /// What the sessions are sorted by
    #[arg(long, value_enum, default_value = "started")]
    sort: Sort,
    /// The other way round
    #[arg(long)]
    reverse: bool,
    /// Sessions on a page
    #[arg(long, value_name = "N", default_value = "20")]
    limit: NonZeroUsize,
    /// Which page, from 1
    #[arg(long, value_name = "N", default_value = "1")]
    page: NonZeroUsize,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Sort {
    /// Latest first
    Started,
    /// By specimen
    Specimen,
    /// By operator
    Operator,
    /// By protocol
    Protocol,
    /// Longest first
    Duration,
    /// By verdict, in alphabetical order
    Verdict,
    /// By review, in alphabetical order
    Review,
}

impl From<Sort> for Order {
    fn from(sort: Sort) -> Self {
        match sort {
            Sort::Started => Self::Started,
            Sort::Specimen => Self::Specimen,
            Sort::Operator => Self::Operator,
            Sort::Protocol => Self::Protocol,
            Sort::Duration => Self::Duration,
            Sort::Verdict => Self::Verdict,
            Sort::Review => Self::Review,
        }
    }
}

#[derive(Serialize)]
struct FindReport<'a> {
    library: &'a PathBuf,
    count: usize,
    page: usize,
    pages: usize,
    sessions: &'a [Entry],
}

pub(super) fn run(args: &FindArgs, output: &Output) -> Result<(), Failure> {
    let library = library_folder().map_err(Failure::usage)?;
    let (limit, page) = (args.limit.get(), args.page.get());
    let query = Query {
        words: args.words.join(" "),
        specimen: args.specimen.clone(),
        operator: args.operator.clone(),
        protocol: args.protocol.clone(),
        rig: args.rig.clone(),
        cell: args.cell.clone(),
        since: args.since,
        before: args.until,
        conditions: args.conditions.clone(),
        verdict: args.verdict,
        review: args.review,
        tags: args.tags.clone(),
        order: args.sort.into(),
        is_reversed: args.reverse,
        skip: limit.saturating_mul(page - 1),
        limit: Some(limit),
    };
    let (found, doubts) = with_updated(&library, output, |catalog| {
        let found = catalog.find(&query)?;
        let is_none = found.count == 0;
        let doubts = if is_none { catalog.doubts(&query.conditions)? } else { Vec::new() };
        Ok((found, doubts))
    })?;
    doubts.iter().for_each(|doubt| output.note(doubt));
    let object = FindReport {
        library: &library,
        count: found.count,
        page,
        pages: found.count.div_ceil(limit),
        sessions: &found.entries,
    };
    output.answer("find", &object, || report::list(&found, page, object.pages));
    Ok(())
}
