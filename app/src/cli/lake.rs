//! `palpate export --lake`: sessions into a lake.

use super::export::failure;
use super::fit::sources;
use super::output::Output;
use super::{Failure, source_failure};
use palpate_protocols::edited;
use palpate_sessions::lake::{Added, Told, add};
use std::path::{Path, PathBuf};

pub(super) fn run(lake: &Path, named: &[PathBuf], output: &Output) -> Result<(), Failure> {
    let found = sources::find_sessions(named, output)?;
    let bar = output.count_bar(found.len() as u64);
    let (mut was_there, mut failed) = (0, Vec::new());
    for session in &found {
        match one(lake, session) {
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

fn one(lake: &Path, session: &Path) -> Result<Added, Failure> {
    let passing = edited::outline(session).map_err(source_failure)?;
    let verdict = passing.edits.verdict();
    let told = Told {
        verdict: verdict.map(|(verdict, edit)| (verdict, edit.reason.as_str())),
    };
    let mut feed = |visit: &mut dyn FnMut(&[_])| passing.rows(session, visit);
    add(lake, &passing.outline, told, &mut feed).map_err(failure)
}
