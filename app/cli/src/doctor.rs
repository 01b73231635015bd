//! `palpate doctor`: state of sessions.

use super::Failure;
use super::output::Output;
use clap::Args;
use palpate_analysis::kept_files::{KeptFile, kept_files};
use palpate_sessions::atomic::find_leftovers;
use palpate_sessions::library_folder;
use palpate_sessions::recover::{SessionExamination, SessionHealth, examine_session};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Report the state of sessions: healthy, interrupted, damaged, newer or not a session
#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// Session folders or files; without any, every session of the library (~/palpate or PALPATE_HOME)
    sessions: Vec<PathBuf>,
    /// Instead, list what palpate keeps on this computer: every kind of file, its version, and how to reset it
    #[arg(long, conflicts_with = "sessions")]
    files: bool,
}

#[derive(Serialize)]
struct DoctorReport {
    sessions: Vec<SessionExamination>,
    unwell: usize,
    /// Unfinished files of a program that was killed.
    leftovers: Vec<PathBuf>,
}

pub(super) fn run(args: &DoctorArgs, output: &Output) -> Result<(), Failure> {
    if args.files {
        return list_files(output);
    }
    let (paths, places) = if args.sessions.is_empty() {
        let library = library_folder().map_err(Failure::usage)?;
        // Exports go to the current folder by default.
        let here = PathBuf::from(".");
        (all_sessions(&library)?, vec![(library, usize::MAX), (here, 1)])
    } else {
        let places = args.sessions.iter().map(|path| (path.clone(), usize::MAX));
        (args.sessions.clone(), places.collect())
    };
    let report = examine_all(&paths, &places, output);
    output.answer("doctor", &report, || report.text());
    if report.unwell > 0 {
        return Err(Failure::failed(format!(
            "{} of {} sessions cannot be used as they are",
            report.unwell,
            report.sessions.len()
        )));
    }
    Ok(())
}

fn list_files(output: &Output) -> Result<(), Failure> {
    let files = kept_files(&library_folder().map_err(Failure::usage)?);
    let object = serde_json::json!({ "files": files });
    output.answer("doctor", &object, || {
        let line = |one: &KeptFile| {
            let absent = if one.is_there { "" } else { " (none yet)" };
            format!(
                "{}{absent}: {}\n  {}; written by {}; to reset: {}",
                one.what,
                one.place.display(),
                one.form,
                one.written_by,
                one.reset
            )
        };
        files.iter().map(line).collect::<Vec<_>>().join("\n")
    });
    Ok(())
}

/// The report on every session of a library, as text.
pub(super) fn findings(library: &Path, output: &Output) -> Result<String, Failure> {
    let places = [(library.to_owned(), usize::MAX)];
    Ok(examine_all(&all_sessions(library)?, &places, output).text() + "\n")
}

fn examine_all(paths: &[PathBuf], places: &[(PathBuf, usize)], output: &Output) -> DoctorReport {
    let sessions = for_each(paths, output, examine_session);
    let remains = places.iter().flat_map(|(place, depth)| find_leftovers(place, *depth));
    DoctorReport {
        unwell: sessions.iter().filter(|one| is_unusable(one)).count(),
        sessions,
        leftovers: remains.collect(),
    }
}

impl DoctorReport {
    fn text(&self) -> String {
        let (count, unwell) = (self.sessions.len(), self.unwell);
        let mut lines: Vec<String> = self.sessions.iter().map(session_text).collect();
        lines.extend(self.leftovers.iter().map(|path| {
            format!(
                "{} is unfinished, because the program that wrote it was killed; delete the file, or let the next export into this folder delete it",
                path.display()
            )
        }));
        lines.push(match unwell {
            0 => format!("sessions examined: {count}; all are usable"),
            _ => format!("sessions examined: {count}; {unwell} cannot be used as they are"),
        });
        lines.join("\n")
    }
}

/// One session after the other, with progress.
pub(super) fn for_each<T>(paths: &[PathBuf], output: &Output, work: impl Fn(&Path) -> T) -> Vec<T> {
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

fn is_unusable(session: &SessionExamination) -> bool {
    !matches!(
        session.health,
        SessionHealth::Healthy | SessionHealth::BeingRecorded | SessionHealth::Interrupted
    ) || !session.damaged_companions.is_empty()
}

fn session_text(session: &SessionExamination) -> String {
    let state = match &session.health {
        SessionHealth::Healthy if !session.damaged_companions.is_empty() => "its log is healthy",
        SessionHealth::Healthy => "healthy",
        SessionHealth::BeingRecorded => "being recorded",
        SessionHealth::Interrupted => "interrupted",
        SessionHealth::Incomplete => "incomplete",
        SessionHealth::Damaged { .. } => "damaged",
        SessionHealth::Lost => "lost",
        SessionHealth::Newer => "newer",
        SessionHealth::Foreign => "not a session",
    };
    let mut lines = vec![match session.samples {
        0 => format!("{}: {state}", session.path.display()),
        samples => format!(
            "{}: {state}, {samples} samples to {:.1} s",
            session.path.display(),
            session.until_s
        ),
    }];
    let sentences = session.findings.iter().chain(&session.damaged_companions);
    lines.extend(sentences.map(|one| format!("  {one}")));
    let can_be_kept =
        matches!(session.health, SessionHealth::Damaged { .. } | SessionHealth::Interrupted);
    match &session.recovered {
        Some(folder) => {
            lines.push(format!("  the intact part was recovered into {}", folder.display()))
        }
        None if can_be_kept => lines
            .push(format!("  'palpate recover {}' keeps the intact part", session.path.display())),
        None => {}
    }
    lines.join("\n")
}

/// Every session of a library, oldest first.
fn all_sessions(library: &Path) -> Result<Vec<PathBuf>, Failure> {
    let folder = library.join("sessions");
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let items = std::fs::read_dir(&folder)
        .and_then(|items| items.map(|item| Ok(item?.path())).collect::<Result<Vec<_>, _>>());
    let mut paths = items.map_err(|err| {
        Failure::failed(format!(
            "{} cannot be read ({err}); check its permissions",
            folder.display()
        ))
    })?;
    paths.retain(|path| path.is_dir());
    paths.sort_unstable();
    Ok(paths)
}
