//! `palpate recover`: recovers the intact part of interrupted or damaged sessions.

use super::Failure;
use super::doctor::for_each;
use super::output::Output;
use clap::Args;
use palpate_runner::wall_now;
use palpate_sessions::library_folder;
use palpate_sessions::recover::{
    MissingData, RecoverError, find_unfinished_sessions, recover, recover_library,
};
use serde::Serialize;
use serde_json::json;
use std::path::{Path, PathBuf};

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Recover the intact part of interrupted or damaged sessions; the originals stay
#[derive(Debug, Args)]
pub struct RecoverArgs {
    /// Session folders; without any, every unfinished session of the library
    sessions: Vec<PathBuf>,
}

#[derive(Serialize)]
struct Recovered {
    session: PathBuf,
    recovered: PathBuf,
    session_id: String,
    samples: u64,
    raw_bytes: u64,
    missing: MissingData,
    #[serde(skip)]
    sentences: Vec<String>,
}

pub(super) fn run(args: &RecoverArgs, output: &Output) -> Result<(), Failure> {
    let paths = if args.sessions.is_empty() {
        unfinished(&library_folder().map_err(Failure::usage)?)?
    } else {
        args.sessions.clone()
    };
    let (mut recovered, mut failed, mut lines) = (Vec::new(), Vec::new(), Vec::new());
    for (path, outcome) in paths.iter().zip(for_each(&paths, output, recover_one)) {
        match outcome {
            Ok(one) => {
                lines.extend(one.sentences.iter().cloned());
                recovered.push(one);
            }
            // The error of a single session is the answer.
            Err(failure) if paths.len() == 1 => return Err(failure),
            Err(failure) => {
                lines.push(format!("not recovered: {}", failure.sentence()));
                failed.push((path, failure));
            }
        }
    }
    let not_recovered = failed.iter().map(|(path, failure)| {
        json!({
            "session": path.display().to_string(), "error": failure.sentence(), "exit": failure.code(),
        })
    });
    let object =
        json!({ "sessions": recovered, "not_recovered": not_recovered.collect::<Vec<_>>() });
    output.answer("recover", &object, || match lines.is_empty() {
        true => "nothing to recover".into(),
        false => lines.join("\n"),
    });
    let sentence = || format!("{} of {} were not recovered", failed.len(), paths.len());
    // A failure weighs more than wrong use.
    match failed.iter().map(|(_, failure)| failure.code()).min() {
        None => Ok(()),
        Some(1) => Err(Failure::failed(sentence())),
        Some(_) => Err(Failure::usage(sentence())),
    }
}

fn unfinished(library: &Path) -> Result<Vec<PathBuf>, Failure> {
    find_unfinished_sessions(library).map_err(|err| {
        Failure::failed(format!(
            "{} cannot be read ({err}); check its permissions",
            library.display()
        ))
    })
}

fn recover_one(path: &Path) -> Result<Recovered, Failure> {
    let recovery = recover(path, VERSION, wall_now().into()).map_err(|err| match err {
        RecoverError::Read(err) => super::read_failure(err),
        RecoverError::Whole { .. }
        | RecoverError::InUse { .. }
        | RecoverError::InProgress { .. }
        | RecoverError::Before { .. } => Failure::usage(err),
        _ => Failure::failed(err),
    })?;
    Ok(Recovered {
        sentences: recovery.sentences(path),
        session: path.into(),
        recovered: recovery.folder,
        session_id: recovery.session_id,
        samples: recovery.salvage.samples,
        raw_bytes: recovery.salvage.raw_bytes,
        missing: recovery.salvage.missing,
    })
}

/// Recovers the unfinished sessions of a library and notes each; a failure is only noted.
pub(super) fn recover_unfinished(library: &Path, output: &Output) {
    let sentences = recover_library(library, VERSION, wall_now().into());
    sentences.iter().for_each(|line| output.note(line));
}
