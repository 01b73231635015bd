//! `palpate doctor`: in which state sessions are.

use super::Failure;
use super::output::Output;
use clap::Args;
use palpate_sessions::atomic::leftovers;
use palpate_sessions::library_folder;
use palpate_sessions::recover::{Health, Patient, examine};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Tell in which state sessions are: whole, interrupted, damaged, newer or something else
#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// Session folders or files; without any, every session of the library (~/palpate or PALPATE_HOME)
    sessions: Vec<PathBuf>,
}

#[derive(Serialize)]
struct Visit {
    sessions: Vec<Patient>,
    /// How many cannot be used as they are.
    unwell: usize,
    /// Files that a killed program was writing and nobody finishes.
    leftovers: Vec<PathBuf>,
}

pub(super) fn run(args: &DoctorArgs, output: &Output) -> Result<(), Failure> {
    let (paths, places) = if args.sessions.is_empty() {
        let library = library_folder().map_err(Failure::usage)?;
        // Exports go to where the user is, if nothing else is said.
        let here = PathBuf::from(".");
        (all_sessions(&library)?, vec![(library, usize::MAX), (here, 1)])
    } else {
        let places = args.sessions.iter().map(|path| (path.clone(), usize::MAX));
        (args.sessions.clone(), places.collect())
    };
    let visit = visit(&paths, &places, output);
    output.answer("doctor", &visit, || visit.text());
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
    let left = places.iter().flat_map(|(place, depth)| leftovers(place, *depth));
    Visit {
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
pub(super) fn each<T>(paths: &[PathBuf], output: &Output, work: impl Fn(&Path) -> T) -> Vec<T> {
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
    drop(bar);
    done
}

fn is_unwell(patient: &Patient) -> bool {
    !matches!(patient.health, Health::Healthy | Health::BeingRecorded | Health::Interrupted)
        || !patient.wrong_beside.is_empty()
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
        Some(folder) => {
            lines.push(format!("  what is whole was recovered into {}", folder.display()))
        }
        None if can_be_kept => {
            lines.push(format!("  palpate recover {} keeps what is whole", patient.path.display()))
        }
        None => {}
    }
    lines.join("\n")
}

/// Every session of a library, oldest first.
fn all_sessions(library: &Path) -> Result<Vec<PathBuf>, Failure> {
    let folder = library.join("sessions");
    let failed = |err: std::io::Error| {
        Failure::failed(format!("cannot read {} ({err}); check its permissions", folder.display()))
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
