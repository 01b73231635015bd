//! Runs the steps of a crate, each into its own folder of results.

use super::contents::LIBRARY;
use super::error::CrateError;
use super::files;
use super::steps::{CrateStep, RESULTS, StepPlace, StepRunner};
use crate::progress::Progress;
use chrono::{DateTime, Utc};
use palpate_runner::wall_now;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Standard error of a command, where it printed any.
const REMARKS: &str = "remarks.txt";

/// A step that was run.
#[derive(Clone, Debug)]
pub(super) struct StepRecord {
    pub step: CrateStep,
    pub started_at: DateTime<Utc>,
    pub ended_at: DateTime<Utc>,
}

/// Steps that were run, and why others are not among them.
#[derive(Debug, Default)]
pub(super) struct StepsRun {
    pub records: Vec<StepRecord>,
    pub left_out: Vec<String>,
}

/// What becomes of a step that fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FailedStep {
    /// A person wants it, so there is no crate without it.
    Refused,
    /// The program chose it, and the crate is made without it.
    LeftOut,
    /// Its output is compared as it is.
    Kept,
}

/// Runs steps with the folder of a crate as their working directory.
pub(super) fn run_steps(
    steps: &[CrateStep],
    folder: &Path,
    made_at: DateTime<Utc>,
    (runner, failed): (&dyn StepRunner, FailedStep),
    progress: &dyn Progress,
) -> Result<StepsRun, CrateError> {
    let mut run = StepsRun::default();
    for (index, step) in steps.iter().enumerate() {
        if progress.report(index, steps.len(), &step.name).is_break() {
            return Err(CrateError::Cancelled);
        }
        let started_at: DateTime<Utc> = wall_now().into();
        let problem = run_step(step, folder, made_at, runner)?;
        let ended_at = wall_now().into();
        match (problem, failed) {
            (None, _) | (Some(_), FailedStep::Kept) => {
                run.records.push(StepRecord { step: step.clone(), started_at, ended_at });
            }
            (Some(reason), FailedStep::Refused) => {
                return Err(CrateError::Failed { step: step.name.clone(), reason });
            }
            (Some(reason), FailedStep::LeftOut) => {
                let results = folder.join(step.folder());
                fs::remove_dir_all(&results).map_err(|err| CrateError::write(&results, err))?;
                run.left_out.push(format!("step '{}' is left out: {reason}", step.name));
            }
        }
    }
    Ok(run)
}

/// Runs one; the result is why it failed, if it did.
fn run_step(
    step: &CrateStep,
    folder: &Path,
    made_at: DateTime<Utc>,
    runner: &dyn StepRunner,
) -> Result<Option<String>, CrateError> {
    let results = folder.join(RESULTS).join(&step.name);
    fs::create_dir_all(&results).map_err(|err| CrateError::write(&results, err))?;
    // A step finds nothing of the user's library and leaves nothing there.
    let home = tempfile::tempdir().map_err(|err| CrateError::write(&std::env::temp_dir(), err))?;
    let library = folder.join(LIBRARY);
    if library.is_dir() {
        for name in files::list(&library)? {
            files::copy(&files::path_of(&library, &name), &files::path_of(home.path(), &name))?;
        }
    }
    let before: BTreeSet<String> = files::list(folder)?.into_iter().collect();
    let place = StepPlace { folder, library: home.path(), made_at };
    let ran = runner.run(&step.words, &place);
    let ran = ran.map_err(|reason| CrateError::NotRun { step: step.name.clone(), reason })?;
    let own = format!("{}/", step.folder());
    let is_elsewhere = |name: &String| !name.starts_with(&own) && !before.contains(name);
    if let Some(file) = files::list(folder)?.into_iter().find(is_elsewhere) {
        return Err(CrateError::Elsewhere { step: step.name.clone(), file });
    }
    let (name, bytes) = kept_output(&ran.output);
    if !bytes.is_empty() {
        files::write(&results.join(name), &bytes)?;
    }
    if !ran.remarks.is_empty() {
        files::write(&results.join(REMARKS), &ran.remarks)?;
    }
    Ok((!ran.is_done).then(|| {
        let words = String::from_utf8_lossy(&ran.remarks);
        let last = words.lines().rev().find(|line| !line.trim().is_empty());
        let last = last.unwrap_or("the command gave no reason");
        last.strip_prefix("error: ").unwrap_or(last).to_owned()
    }))
}

/// How long a command computed: another each time, and no number of a paper.
const COMPUTING_TIME: &str = "seconds";

/// The name of the file for an output, and its bytes: objects without their computing time, or text as it is.
fn kept_output(output: &[u8]) -> (&'static str, Vec<u8>) {
    let text = String::from_utf8_lossy(output);
    let object = |line: &str| match serde_json::from_str(line) {
        Ok(Value::Object(mut fields)) => {
            fields.remove(COMPUTING_TIME);
            Some(Value::Object(fields))
        }
        _ => None,
    };
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    let objects: Option<Vec<Value>> = lines.iter().map(|line| object(line)).collect();
    match objects.as_deref() {
        // One object is laid out, so that a difference has a line.
        Some([one]) => ("output.json", format!("{one:#}\n").into_bytes()),
        Some(several) if !several.is_empty() => {
            let lines = several.iter().map(|one| format!("{one}\n"));
            ("output.jsonl", lines.collect::<String>().into_bytes())
        }
        _ => ("output.txt", output.to_vec()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn output_of_a_step_is_kept_without_its_computing_time() {
        let (name, bytes) = kept_output(b"{\"b\":0.1,\"seconds\":3.2,\"a\":1}\n");
        assert_eq!(
            (name, bytes.as_slice()),
            ("output.json", "{\n  \"a\": 1,\n  \"b\": 0.1\n}\n".as_bytes())
        );
        let (name, bytes) = kept_output(b"{\"a\":1}\n{\"a\":2}\n");
        assert_eq!((name, bytes.as_slice()), ("output.jsonl", "{\"a\":1}\n{\"a\":2}\n".as_bytes()));
        let text = b"mu1 0.1 seconds 3\n";
        assert_eq!(kept_output(text), ("output.txt", text.to_vec()));
    }
}
