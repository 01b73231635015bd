//! `palpate demo`: records a library of simulated sessions to try palpate with.

use super::Failure;
use super::catalog::use_updated_catalog;
use super::output::Output;
use super::terminal::ctrl_c_flag;
use clap::Args;
use palpate_analysis::pool::{WorkEvent, in_order};
use palpate_runner::demonstration::{DEMONSTRATION_RUNS, DemonstrationRun};
use palpate_sessions::library_folder;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Record a library of simulated sessions to try palpate with
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Folder of the library, which must have no sessions yet; without it ~/palpate or PALPATE_HOME
    #[arg(value_name = "FOLDER")]
    folder: Option<PathBuf>,
}

#[derive(Serialize)]
struct RecordedSession {
    session: PathBuf,
    protocol: &'static str,
    specimen: &'static str,
}

pub(super) fn run(args: &DemoArgs, output: &Output) -> Result<(), Failure> {
    let library = match &args.folder {
        Some(folder) => folder.clone(),
        None => library_folder().map_err(Failure::usage)?,
    };
    check_empty(&library)?;
    let jobs = std::thread::available_parallelism().map_or(1, usize::from);
    let is_ending = ctrl_c_flag()?;
    let bar = output.count_bar(DEMONSTRATION_RUNS.len() as u64);
    let mut outcomes = Vec::new();
    let work = |run: &DemonstrationRun| run.record(&library);
    in_order(jobs, &DEMONSTRATION_RUNS, &is_ending, work, |event| match event {
        WorkEvent::Done(count) => bar.set_position(count as u64),
        WorkEvent::Next(outcome) => outcomes.push(outcome),
    })
    .map_err(Failure::failed)?;
    drop(bar);
    let mut sessions = Vec::new();
    for (run, outcome) in DEMONSTRATION_RUNS.iter().zip(outcomes) {
        let session = outcome.map_err(|_| incomplete(&library))?;
        let session = session.map_err(Failure::failed)?;
        sessions.push(RecordedSession { session, protocol: run.protocol, specimen: run.specimen });
    }
    use_updated_catalog(&library, output, |_| Ok(()))?;
    let shown = library.display().to_string();
    let object = serde_json::json!({ "library": shown, "sessions": sessions });
    output.answer("demo", &object, || text(&sessions, &shown));
    Ok(())
}

fn incomplete(library: &Path) -> Failure {
    Failure::failed(format!(
        "the recording was interrupted, so {} lacks sessions; give another folder and record them again",
        library.display()
    ))
}

/// Simulated sessions are not mixed into a library that is in use.
fn check_empty(library: &Path) -> Result<(), Failure> {
    let folder = library.join("sessions");
    let is_empty = std::fs::read_dir(&folder).map_or(true, |mut items| items.next().is_none());
    if is_empty {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "the library {} already has sessions; give a new folder, as in 'palpate demo trial'",
        library.display()
    )))
}

fn text(sessions: &[RecordedSession], library: &str) -> String {
    let line = |one: &RecordedSession| format!("{:<22} {}", one.protocol, one.specimen);
    let lines: Vec<String> = sessions.iter().map(line).collect();
    format!(
        "{}\n{} sessions recorded in {library}; set PALPATE_HOME to this folder to find them in the window and with 'palpate find'",
        lines.join("\n"),
        sessions.len()
    )
}
