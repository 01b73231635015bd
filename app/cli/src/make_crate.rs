//! `palpate crate`: a study as a research object that anybody computes again.

use super::arguments::date_of_pages;
use super::output::Output;
use super::steps::OwnProgram;
use super::{Failure, new_file, sources_failure};
use clap::Args;
use palpate_analysis::report::text::counted;
use palpate_analysis::research_object::{CrateError, CrateRequest, Finding, MadeCrate, make_crate};
use palpate_sessions::library_folder;
use std::path::PathBuf;

/// Make a crate (RO-Crate) of sessions: whole recordings, settings, numbers and figures, for 'palpate reproduce'
#[derive(Debug, Args)]
pub struct CrateArgs {
    /// New folder, or new file whose name ends in .zip
    #[arg(value_name = "OUT")]
    to: PathBuf,
    /// Session folders and folders of sessions
    #[arg(required = true, value_name = "SESSION")]
    sessions: Vec<PathBuf>,
    /// File with title, people, licence and the steps to compute; without it a page on the sessions and a fit of each
    #[arg(long, value_name = "FILE")]
    study: Option<PathBuf>,
}

pub(super) fn run(args: &CrateArgs, output: &Output) -> Result<(), Failure> {
    new_file::check("crate", Some(&args.to))?;
    let library = library_folder().ok();
    let request = CrateRequest {
        to: &args.to,
        sessions: &args.sessions,
        study: args.study.as_deref(),
        library: library.as_deref(),
        made_at: date_of_pages(),
    };
    let bar = output.count_bar(0);
    let made = make_crate(&request, &OwnProgram::find()?, &bar);
    drop(bar);
    let made = made.map_err(failure)?;
    made.left_out.iter().for_each(|sentence| output.note(sentence));
    output.answer("crate", &made, || text(&made));
    Ok(())
}

fn text(made: &MadeCrate) -> String {
    let to = made.path.display();
    let mut lines = vec![format!(
        "{to}: {}, {}, {}, {} bytes",
        counted(made.sessions.len(), "session"),
        counted(made.steps.len(), "step"),
        counted(made.files, "file"),
        made.bytes
    )];
    if !made.findings.is_empty() {
        lines.push("a reader will miss:".to_owned());
        let of = made.sessions.len();
        lines.extend(made.findings.iter().map(|one| format!("  {}", one.text(of))));
        lines.extend(remedy(&made.findings));
    }
    lines.push(format!("'palpate reproduce {to}' computes the numbers again"));
    lines.join("\n")
}

/// How the first missing entry is added; the others likewise.
fn remedy(findings: &[Finding]) -> Option<String> {
    let missing = |one: &&Finding| one.entry.is_some_and(|entry| one.sentence.starts_with(entry));
    let first = findings.iter().find(missing)?;
    Some(format!(
        "'palpate about SESSION {}=... --reason TEXT' adds an entry to a session; make the crate again afterwards",
        first.entry.unwrap_or_default()
    ))
}

pub(super) fn failure(err: CrateError) -> Failure {
    match err {
        CrateError::Recordings(err) => sources_failure(err),
        err if err.is_wrong_use() => Failure::usage(err),
        err => Failure::failed(err),
    }
}
