//! Examination of sessions.

use super::companions::find_damaged;
use super::write::{is_in_use, recover};
use super::{MissingData, recovered_folder, salvage};
use crate::log::files::{absent_spare, describe_absent};
use crate::log::{ReadError, Session, SessionSummary};
use chrono::{DateTime, Utc};
use serde::Serialize;
use std::io;
use std::path::{Path, PathBuf};

#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "health")]
pub enum SessionHealth {
    /// Complete, with correct checksums.
    Healthy,
    BeingRecorded,
    /// Undamaged, but without an end.
    Interrupted,
    /// Without an end, and a disk that may hold it is missing.
    Incomplete,
    Damaged {
        missing: MissingData,
    },
    Lost,
    /// A newer version of the program wrote it.
    Newer,
    Foreign,
}

/// Result of an examination.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SessionExamination {
    pub path: PathBuf,
    #[serde(flatten)]
    pub health: SessionHealth,
    pub samples: u64,
    /// Session time of the last usable sample, in s.
    pub until_s: f64,
    /// Remarks, one sentence each.
    pub findings: Vec<String>,
    /// Damaged files beside the log, one sentence each.
    #[serde(rename = "wrong_beside")]
    pub damaged_companions: Vec<String>,
    /// Folder of the recovered copy, if there is one.
    pub recovered: Option<PathBuf>,
}

/// Reads every byte of a session.
#[must_use]
pub fn examine_session(path: &Path) -> SessionExamination {
    let mut until = 0.0;
    let opened = Session::scan(path, &mut |block| {
        until = block.last_time().map_or(until, |time| time.seconds().0);
    });
    let result = |health, samples, until_s, findings| SessionExamination {
        path: path.into(),
        health,
        samples,
        until_s,
        findings,
        damaged_companions: Vec::new(),
        recovered: Some(recovered_folder(path)).filter(|folder| folder.is_dir()),
    };
    match opened {
        Ok(outline) => {
            let health = if outline.end.is_some() {
                SessionHealth::Healthy
            } else if is_in_use(path) {
                SessionHealth::BeingRecorded
            } else if absent_spare(path).is_some() {
                SessionHealth::Incomplete
            } else {
                SessionHealth::Interrupted
            };
            SessionExamination {
                damaged_companions: find_damaged(path, &outline.manifest),
                ..result(health, outline.samples, until, outline.notes)
            }
        }
        Err(err @ ReadError::Newer { .. }) => {
            result(SessionHealth::Newer, 0, 0.0, vec![err.to_string()])
        }
        Err(err @ (ReadError::NotASession { .. } | ReadError::Missing { .. })) => {
            result(SessionHealth::Foreign, 0, 0.0, vec![err.to_string()])
        }
        Err(err) => {
            let mut until = 0.0;
            let salvage = salvage(path, &mut |block| {
                until = block.last_time().map_or(until, |time| time.seconds().0);
            });
            match salvage {
                Ok(salvage) => {
                    let mut findings = salvage.missing.sentences();
                    let lacks_files = salvage.missing.is_end_lost || salvage.lacks_segments;
                    let spare = absent_spare(path).filter(|_| lacks_files);
                    findings.extend(spare.map(|spare| describe_absent(&spare)));
                    let missing = salvage.missing;
                    result(SessionHealth::Damaged { missing }, salvage.samples, until, findings)
                }
                Err(_) => result(SessionHealth::Lost, 0, 0.0, vec![err.to_string()]),
            }
        }
    }
}

/// Recovers the interrupted sessions of a library; returns lines with the results and errors.
#[must_use]
pub fn recover_library(library: &Path, software_version: &str, at: DateTime<Utc>) -> Vec<String> {
    let found = match find_unfinished_sessions(library) {
        Ok(found) => found,
        Err(err) => {
            let folder = library.display();
            return vec![format!("cannot read {folder} ({err}); check its permissions")];
        }
    };
    let one = |path: &PathBuf| match recover(path, software_version, at) {
        Ok(recovery) => recovery.sentences(path),
        Err(err) => vec![err.to_string()],
    };
    found.iter().flat_map(one).collect()
}

/// The interrupted sessions of a library without a recovered copy, newest first. Reads only their ends.
pub fn find_unfinished_sessions(library: &Path) -> io::Result<Vec<PathBuf>> {
    let sessions = library.join("sessions");
    if !sessions.is_dir() {
        return Ok(Vec::new());
    }
    let mut found = Vec::new();
    for item in std::fs::read_dir(sessions)? {
        let path = item?.path();
        let is_made = path.extension().is_some_and(|end| end == "recovered" || end == "recovering");
        if is_made || !path.is_dir() || recovered_folder(&path).is_dir() || is_in_use(&path) {
            continue;
        }
        // An unreadable session cannot be recovered; an examination reports it.
        if SessionSummary::read(&path).is_ok_and(|summary| summary.end.is_none()) {
            found.push(path);
        }
    }
    found.sort_unstable_by(|a, b| b.cmp(a));
    Ok(found)
}
