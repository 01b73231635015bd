//! `palpate demo`: records a library of simulated sessions to try palpate with.

use super::Failure;
use super::output::Output;
use super::terminal::ctrl_c_flag;
use clap::Args;
use palpate_analysis::demonstration_library::{
    DemonstrationLibraryError, RecordedDemonstration, record_demonstration,
};
use palpate_analysis::progress::Progress;
use palpate_sessions::library_folder;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

/// Record a library of simulated sessions to try palpate with
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Folder of the library, which must have no sessions yet; without it ~/palpate or PALPATE_HOME
    #[arg(value_name = "FOLDER")]
    folder: Option<PathBuf>,
}

pub(super) fn run(args: &DemoArgs, output: &Output) -> Result<(), Failure> {
    let library = match &args.folder {
        Some(folder) => folder.clone(),
        None => library_folder().map_err(Failure::usage)?,
    };
    let is_ending = ctrl_c_flag()?;
    let bar = output.count_bar(0);
    let progress = |done: usize, of: usize, what: &str| {
        if is_ending.load(Ordering::Relaxed) {
            return ControlFlow::Break(());
        }
        bar.report(done, of, what)
    };
    let recorded = record_demonstration(&library, &progress);
    drop(bar);
    let sessions = recorded.map_err(failure)?;
    let shown = library.display().to_string();
    let object = serde_json::json!({ "library": shown, "sessions": sessions });
    output.answer("demo", &object, || text(&sessions, &shown));
    Ok(())
}

fn failure(err: DemonstrationLibraryError) -> Failure {
    match err {
        DemonstrationLibraryError::InUse(_) => {
            Failure::usage(format!("{err}; give a new folder, as in 'palpate demo trial'"))
        }
        DemonstrationLibraryError::Interrupted(_) => {
            Failure::failed(format!("{err}; give another folder and record them again"))
        }
        err => Failure::failed(err),
    }
}

fn text(sessions: &[RecordedDemonstration], library: &str) -> String {
    let line = |one: &RecordedDemonstration| format!("{:<22} {}", one.protocol, one.specimen);
    let lines: Vec<String> = sessions.iter().map(line).collect();
    format!(
        "{}\n{} sessions recorded in {library}; set PALPATE_HOME to this folder to find them in the window and with 'palpate find'",
        lines.join("\n"),
        sessions.len()
    )
}
