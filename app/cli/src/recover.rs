//! `palpate recover`: what can be kept of sessions that were interrupted or damaged.

use super::Failure;
use super::doctor::each;
use super::output::Output;
use clap::Args;
use palpate_runner::wall_now;
use palpate_sessions::library_folder;
use palpate_sessions::recover::{Missing, RecoverError, examine_library, recover, recover_library};
use serde::Serialize;
use std::path::{Path, PathBuf};

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Keep what is whole of interrupted or damaged sessions, beside the originals
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
    missing: Missing,
    #[serde(skip)]
    sentences: Vec<String>,
}

/// A session that was not recovered.
#[derive(Serialize)]
struct NotRecovered {
    session: PathBuf,
    error: String,
    exit: u8,
}

#[derive(Serialize)]
struct Recoveries {
    sessions: Vec<Recovered>,
    not_recovered: Vec<NotRecovered>,
}

pub(super) fn run(args: &RecoverArgs, output: &Output) -> Result<(), Failure> {
    let paths = if args.sessions.is_empty() {
        unfinished(&library_folder().map_err(Failure::usage)?)?
    } else {
        args.sessions.clone()
    };
    let mut recoveries = Recoveries { sessions: Vec::new(), not_recovered: Vec::new() };
    let mut lines = Vec::new();
    for (path, outcome) in paths.iter().zip(each(&paths, output, one)) {
        match outcome {
            Ok(one) => {
                lines.extend(one.sentences.iter().cloned());
                recoveries.sessions.push(one);
            }
            // With one session there is nothing to go on with, and the error is the answer.
            Err(failure) if paths.len() == 1 => return Err(failure),
            Err(failure) => {
                lines.push(format!("not recovered: {}", failure.sentence()));
                recoveries.not_recovered.push(NotRecovered {
                    session: path.clone(),
                    error: failure.sentence().into(),
                    exit: failure.code(),
                });
            }
        }
    }
    output.answer("recover", &recoveries, || match lines.is_empty() {
        true => "nothing to recover".into(),
        false => lines.join("\n"),
    });
    let failed = &recoveries.not_recovered;
    let sentence = || format!("{} of {} were not recovered", failed.len(), paths.len());
    // A failure weighs more than wrong use.
    match failed.iter().map(|one| one.exit).min() {
        None => Ok(()),
        Some(1) => Err(Failure::failed(sentence())),
        Some(_) => Err(Failure::usage(sentence())),
    }
}

fn unfinished(library: &Path) -> Result<Vec<PathBuf>, Failure> {
    examine_library(library).map_err(|err| {
        Failure::failed(format!("cannot read {} ({err}); check its permissions", library.display()))
    })
}

fn one(path: &Path) -> Result<Recovered, Failure> {
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

/// Recovers what a crash left unfinished in a library, and says so; what fails is only told.
pub(super) fn recover_unfinished(library: &Path, output: &Output) {
    let told = recover_library(library, VERSION, wall_now().into());
    told.iter().for_each(|line| output.note(line));
}
