//! `palpate history`: events of a specimen, a rig or a load cell.

use super::Failure;
use super::arguments::{Choice, choice};
use super::catalog::use_updated_catalog;
use super::output::Output;
use clap::Args;
use palpate_analysis::report::catalog as report;
use palpate_sessions::catalog::HistorySubject;
use palpate_sessions::library_folder;

/// Show the history of a specimen, a rig or a load cell
#[derive(Debug, Args)]
pub struct HistoryArgs {
    /// Kind of subject
    #[arg(value_parser = choice(&SUBJECTS))]
    subject: HistorySubject,
    /// Its name; a load cell's serial number
    name: String,
}

const SUBJECTS: [Choice<HistorySubject>; 3] = [
    ("specimen", HistorySubject::Specimen, "What was indented"),
    ("rig", HistorySubject::Rig, "A rig"),
    ("cell", HistorySubject::Cell, "A load cell"),
];

pub(super) fn run(args: &HistoryArgs, output: &Output) -> Result<(), Failure> {
    let library = library_folder().map_err(Failure::usage)?;
    let found =
        use_updated_catalog(&library, output, |catalog| catalog.history(args.subject, &args.name));
    let (events, remarks) = found?;
    remarks.iter().for_each(|remark| output.note(remark));
    if events.is_empty() {
        return Err(Failure::usage(format!(
            "the library has no record of '{}'; write the name exactly as in 'palpate find'",
            args.name
        )));
    }
    let object = serde_json::json!({
        "subject": args.subject, "name": args.name, "events": events, "remarks": remarks,
    });
    output.answer("history", &object, || report::history(&events));
    Ok(())
}
