//! `palpate export --lake`: sessions into a lake.

use super::Failure;
use super::export::export_failure;
use super::fit::sources;
use super::output::Output;
use palpate_analysis::exports::{into_lake, sweep_lake};
use std::path::{Path, PathBuf};

pub(super) fn run(lake: &Path, named: &[PathBuf], output: &Output) -> Result<(), Failure> {
    let found = sources::find_sessions(named, output)?;
    sweep_lake(lake);
    let bar = output.count_bar(found.len() as u64);
    let (mut was_there, mut failed) = (0, Vec::new());
    for session in &found {
        match into_lake(lake, session).map_err(export_failure) {
            Ok(added) => was_there += usize::from(added.was_there),
            Err(failure) => {
                let sentence = format!("{}: {}", session.display(), failure.sentence());
                bar.suspend(|| output.note(&sentence));
                failed.push(sentence);
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    let added = found.len() - was_there - failed.len();
    let object = serde_json::json!({
        "command": "export", "lake": lake, "sessions": found.len(), "added": added, "were_there": was_there,
        "failed": failed,
    });
    output.result(&object, || {
        format!(
            "{added} sessions added to {}, {was_there} were there",
            lake.display()
        )
    });
    match failed.len() {
        0 => Ok(()),
        count => Err(Failure::failed(format!(
            "{count} of {} sessions could not be added; each says why",
            found.len()
        ))),
    }
}
