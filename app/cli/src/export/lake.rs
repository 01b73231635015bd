//! `palpate export --lake`: sessions into a lake.

use super::super::{Failure, output::Output, sources_failure};
use super::export_failure;
use palpate_analysis::exports::{add_to_lake, sweep_lake};
use palpate_analysis::recordings;
use std::path::{Path, PathBuf};

pub(super) fn run(lake: &Path, named: &[PathBuf], output: &Output) -> Result<(), Failure> {
    let found = recordings::find_sessions(named).map_err(sources_failure)?;
    found.note().iter().for_each(|note| output.note(note));
    let found = found.paths;
    sweep_lake(lake);
    let bar = output.count_bar(found.len() as u64);
    let (mut was_there, mut failed) = (0, Vec::new());
    for session in &found {
        match add_to_lake(lake, session).map_err(export_failure) {
            Ok(added) => was_there += usize::from(added.was_there),
            Err(failure) => {
                let sentence = format!("{}: {}", session.display(), failure.sentence());
                bar.suspend(|| output.note(&sentence));
                failed.push(sentence);
            }
        }
        bar.inc(1);
    }
    drop(bar);
    let added = found.len() - was_there - failed.len();
    let object = serde_json::json!({ "lake": lake, "sessions": found.len(), "added": added, "were_there": was_there,
        "failed": failed,
    });
    output.answer("export", &object, || {
        format!("{added} sessions added to {}; {was_there} were already there", lake.display())
    });
    match failed.len() {
        0 => Ok(()),
        count => Err(Failure::failed(format!(
            "{count} of {} sessions were not added; the notes above state the reasons",
            found.len()
        ))),
    }
}
