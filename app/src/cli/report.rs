//! `palpate report`: what happened in a run, against what its plan said.

use super::Failure;
use super::output::Output;
use crate::report::session::fidelity_text;
use clap::Args;
use palpate_protocols::base::FoundBase;
use palpate_protocols::edited;
use palpate_protocols::fidelity::{Fidelity, of_session};
use palpate_sessions::Verdict;
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `palpate report`.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Session folder
    session: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Serialize)]
struct Report<'a> {
    command: &'static str,
    session_id: &'a str,
    ending: Option<&'a str>,
    reason: Option<&'a str>,
    verdict: Option<Verdict>,
    verdict_reason: Option<&'a str>,
    #[serde(flatten)]
    base: FoundBase,
    #[serde(flatten)]
    fidelity: &'a Fidelity,
}

pub(super) fn run(args: &ReportArgs, output: &Output) -> Result<(), Failure> {
    let edited = edited::open(&args.session).map_err(super::source_failure)?;
    let session = &edited.session;
    session.notes.iter().for_each(|note| output.note(note));
    let fidelity = of_session(session).map_err(super::source_failure)?;
    let verdict = edited.edits.verdict();
    let verdict = verdict.map(|(verdict, edit)| (verdict, edit.reason.as_str()));
    let end = session.end.as_ref();
    let report = Report {
        command: "report",
        session_id: &session.manifest.session_id,
        ending: end.map(|end| end.outcome.as_str()),
        reason: end.map(|end| end.reason.as_str()),
        verdict: verdict.map(|(verdict, _)| verdict),
        verdict_reason: verdict.map(|(_, reason)| reason),
        base: FoundBase::of_session(session),
        fidelity: &fidelity,
    };
    output.result(&report, || {
        let told = fidelity_text(&fidelity, end, verdict);
        let facts = report.base.facts();
        let base = facts.map(|(name, mm, error)| format!("\n{name:<10} {mm:.3} ± {error:.3} mm"));
        told + &base.collect::<String>()
    });
    Ok(())
}
