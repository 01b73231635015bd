//! `palpate history`: what is known of a specimen, a rig or a load cell over time.

use super::Failure;
use super::catalog::with_updated;
use super::output::Output;
use clap::{Args, ValueEnum};
use palpate_analysis::report::catalog as report;
use palpate_sessions::catalog::{Event, Subject};
use palpate_sessions::library_folder;
use serde::Serialize;

/// Tell what is known of a specimen, a rig or a load cell over time
#[derive(Debug, Args)]
pub struct HistoryArgs {
    /// Of what
    #[arg(value_enum)]
    subject: Kind,
    /// Its name; a load cell's serial number
    name: String,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Kind {
    /// What was indented
    Specimen,
    /// A rig
    Rig,
    /// A load cell
    Cell,
}

impl From<Kind> for Subject {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::Specimen => Self::Specimen,
            Kind::Rig => Self::Rig,
            Kind::Cell => Self::Cell,
        }
    }
}

#[derive(Serialize)]
struct HistoryReport<'a> {
    subject: Subject,
    name: &'a str,
    events: &'a [Event],
    /// What cannot be read and may be missing.
    remarks: &'a [String],
}

pub(super) fn run(args: &HistoryArgs, output: &Output) -> Result<(), Failure> {
    let library = library_folder().map_err(Failure::usage)?;
    let subject = Subject::from(args.subject);
    let found = with_updated(&library, output, |catalog| catalog.history(subject, &args.name));
    let (events, remarks) = found?;
    remarks.iter().for_each(|remark| output.note(remark));
    if events.is_empty() {
        return Err(Failure::usage(format!(
            "nothing is known of '{}'; the name must be written exactly as in 'palpate find'",
            args.name
        )));
    }
    let object = HistoryReport { subject, name: &args.name, events: &events, remarks: &remarks };
    output.answer("history", &object, || report::history(&events));
    Ok(())
}
