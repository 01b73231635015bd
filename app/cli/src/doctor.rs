//! `palpate doctor` and `palpate recover`: in which state sessions are, and what can be kept of them.

use super::Failure;
use super::output::Output;
use clap::Args;
use palpate_runner::wall_now;
use palpate_sessions::atomic::leftovers;
use palpate_sessions::library_folder;
use palpate_sessions::recover::{
    Health, Missing, Patient, RecoverError, examine, examine_library, recover, recover_library,
};
use serde::Serialize;
use std::path::{Path, PathBuf};

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Arguments of `palpate doctor`.
#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// Session folders or files; without any, every session of the library (~/palpate or PALPATE_HOME)
    sessions: Vec<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `palpate recover`.
#[derive(Debug, Args)]
pub struct RecoverArgs {
    /// Session folders; without any, every unfinished session of the library
    sessions: Vec<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Serialize)]
struct Visit {
    command: &'static str,
    sessions: Vec<Patient>,
    /// How many cannot be used as they are.
    unwell: usize,
    /// Files that a killed program was writing and nobody finishes.
    leftovers: Vec<PathBuf>,
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
    command: &'static str,
    sessions: Vec<Recovered>,
    not_recovered: Vec<NotRecovered>,
}

pub(super) fn doctor(args: &DoctorArgs, output: &Output) -> Result<(), Failure> {
    let (paths, places) = if args.sessions.is_empty() {
        let library = library_folder().map_err(Failure::usage)?;
        // Exports go to where the user is, if nothing else is said.
        let here = PathBuf::from(".");
        (
            all_sessions(&library)?,
            vec![(library, usize::MAX), (here, 1)],
        )
    } else {
        let places = args.sessions.iter().map(|path| (path.clone(), usize::MAX));
        (args.sessions.clone(), places.collect())
    };
    let visit = visit(&paths, &places, output);
    output.result(&visit, || visit.text());
    if visit.unwell > 0 {
        return Err(Failure::failed(format!(
            "{} of {} cannot be used as they are",
            visit.unwell,
            visit.sessions.len()
        )));
    }
    Ok(())
}

/// What a visit to every session of a library finds, in words.
pub(super) fn findings(library: &Path, output: &Output) -> Result<String, Failure> {
    let places = [(library.to_owned(), usize::MAX)];
    Ok(visit(&all_sessions(library)?, &places, output).text() + "\n")
}

fn visit(paths: &[PathBuf], places: &[(PathBuf, usize)], output: &Output) -> Visit {
    let sessions = each(paths, output, examine);
    let left = places
        .iter()
        .flat_map(|(place, depth)| leftovers(place, *depth));
    Visit {
        command: "doctor",
        unwell: sessions.iter().filter(|one| is_unwell(one)).count(),
        sessions,
        leftovers: left.collect(),
    }
}

impl Visit {
    fn text(&self) -> String {
        let (count, unwell) = (self.sessions.len(), self.unwell);
        let mut lines: Vec<String> = self.sessions.iter().map(patient_text).collect();
        lines.extend(self.leftovers.iter().map(|path| {
            format!(
                "{}: left by a program that was ended while it wrote; delete it, or the next export there does",
                path.display()
            )
        }));
        lines.push(match unwell {
            0 => format!("{count} looked at, all can be used"),
            _ => format!("{count} looked at, {unwell} cannot be used as they are"),
        });
        lines.join("\n")
    }
}

/// One session after the other, with progress.
fn each<T>(paths: &[PathBuf], output: &Output, work: impl Fn(&Path) -> T) -> Vec<T> {
    let bar = output.count_bar(paths.len() as u64);
    let done = paths
        .iter()
        .map(|path| {
            bar.set_message(path.display().to_string());
            let done = work(path);
            bar.inc(1);
            done
        })
        .collect();
    bar.finish_and_clear();
    done
}

fn is_unwell(patient: &Patient) -> bool {
    !matches!(
        patient.health,
        Health::Healthy | Health::BeingRecorded | Health::Interrupted
    ) || !patient.wrong_beside.is_empty()
}

fn patient_text(patient: &Patient) -> String {
    let state = match &patient.health {
        Health::Healthy if !patient.wrong_beside.is_empty() => "its log is healthy",
        Health::Healthy => "healthy",
        Health::BeingRecorded => "being recorded",
        Health::Interrupted => "interrupted",
        Health::Incomplete => "incomplete",
        Health::Damaged { .. } => "damaged",
        Health::Lost => "lost",
        Health::Newer => "newer",
        Health::Foreign => "not a session",
    };
    let mut lines = vec![match patient.samples {
        0 => format!("{}: {state}", patient.path.display()),
        samples => format!(
            "{}: {state}, {samples} samples to {:.1} s",
            patient.path.display(),
            patient.until_s
        ),
    }];
    let sentences = patient.findings.iter().chain(&patient.wrong_beside);
    lines.extend(sentences.map(|one| format!("  {one}")));
    let can_be_kept = matches!(patient.health, Health::Damaged { .. } | Health::Interrupted);
    match &patient.recovered {
        Some(folder) => lines.push(format!(
            "  what is whole was recovered into {}",
            folder.display()
        )),
        None if can_be_kept => lines.push(format!(
            "  palpate recover {} keeps what is whole",
            patient.path.display()
        )),
        None => {}
    }
    lines.join("\n")
}

/// Every session of a library, oldest first.
fn all_sessions(library: &Path) -> Result<Vec<PathBuf>, Failure> {
    let folder = library.join("sessions");
    let failed = |err: std::io::Error| {
        Failure::failed(format!(
            "cannot read {} ({err}); check its permissions",
            folder.display()
        ))
    };
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let mut paths = Vec::new();
    for item in std::fs::read_dir(&folder).map_err(failed)? {
        let path = item.map_err(failed)?.path();
        if path.is_dir() {
            paths.push(path);
        }
    }
    paths.sort_unstable();
    Ok(paths)
}

pub(super) fn run_recover(args: &RecoverArgs, output: &Output) -> Result<(), Failure> {
    let paths = if args.sessions.is_empty() {
        unfinished(&library_folder().map_err(Failure::usage)?)?
    } else {
        args.sessions.clone()
    };
    let mut recoveries = Recoveries {
        command: "recover",
        sessions: Vec::new(),
        not_recovered: Vec::new(),
    };
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
    output.result(&recoveries, || match lines.is_empty() {
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
        Failure::failed(format!(
            "cannot read {} ({err}); check its permissions",
            library.display()
        ))
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
