//! Tells in which state a session is.

use super::write::{is_in_use, recover};
use super::wrong_beside::wrong_beside;
use super::{Missing, recovered_folder, salvage};
use crate::log::files::{absent_spare, away};
use crate::log::{ReadError, Session, Summary};
use chrono::{DateTime, Utc};
use serde::Serialize;
use std::io;
use std::path::{Path, PathBuf};

/// The state of a session.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "health")]
pub enum Health {
    /// Whole: every checksum is right and the end is there.
    Healthy,
    /// Somebody records it now.
    BeingRecorded,
    /// Everything in it is whole, but the recording broke off.
    Interrupted,
    /// The end is not there, and neither is a disk that it may be on.
    Incomplete,
    /// Parts of it are damaged or missing.
    Damaged {
        /// Which.
        missing: Missing,
    },
    /// Nothing of it can be used.
    Lost,
    /// A newer version of the program wrote it.
    Newer,
    /// It is something else.
    Foreign,
}

/// A session that was looked at.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Patient {
    /// Where it is.
    pub path: PathBuf,
    /// How it is.
    #[serde(flatten)]
    pub health: Health,
    /// Samples that can be used.
    pub samples: u64,
    /// Session time of the last of them, in s.
    pub until_s: f64,
    /// Everything there is to know, one sentence each.
    pub findings: Vec<String>,
    /// What stands beside the log and is not as it was written, one sentence each.
    pub wrong_beside: Vec<String>,
    /// What it was recovered into.
    pub recovered: Option<PathBuf>,
}

/// Looks at every byte of a session.
#[must_use]
pub fn examine(path: &Path) -> Patient {
    let mut until = 0.0;
    let opened = Session::scan(path, &mut |block| {
        until = block.last_time().map_or(until, |time| time.seconds().0);
    });
    let patient = |health, samples, until_s, findings| Patient {
        path: path.into(),
        health,
        samples,
        until_s,
        findings,
        wrong_beside: Vec::new(),
        recovered: Some(recovered_folder(path)).filter(|folder| folder.is_dir()),
    };
    match opened {
        Ok(outline) => {
            let health = if outline.end.is_some() {
                Health::Healthy
            } else if is_in_use(path) {
                Health::BeingRecorded
            } else if absent_spare(path).is_some() {
                Health::Incomplete
            } else {
                Health::Interrupted
            };
            Patient {
                wrong_beside: wrong_beside(path, &outline.manifest),
                ..patient(health, outline.samples, until, outline.notes)
            }
        }
        Err(err @ ReadError::Newer { .. }) => patient(Health::Newer, 0, 0.0, vec![err.to_string()]),
        Err(err @ (ReadError::NotASession { .. } | ReadError::Missing { .. })) => {
            patient(Health::Foreign, 0, 0.0, vec![err.to_string()])
        }
        Err(err) => {
            let mut until = 0.0;
            let left = salvage(path, &mut |block| {
                until = block.last_time().map_or(until, |time| time.seconds().0);
            });
            match left {
                Ok(left) => {
                    let mut findings = left.missing.sentences();
                    let lacks_files = left.missing.is_end_lost || left.lacks_segments;
                    let spare = absent_spare(path).filter(|_| lacks_files);
                    findings.extend(spare.map(|spare| away(&spare)));
                    let missing = left.missing;
                    patient(Health::Damaged { missing }, left.samples, until, findings)
                }
                Err(_) => patient(Health::Lost, 0, 0.0, vec![err.to_string()]),
            }
        }
    }
}

/// Recovers the unfinished sessions of a library and tells what came of it, a line each. What fails is told and
/// stays as it is.
#[must_use]
pub fn recover_library(library: &Path, software_version: &str, at: DateTime<Utc>) -> Vec<String> {
    let found = match examine_library(library) {
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

/// The unfinished sessions of a library that nobody records and nobody recovered, newest first.
///
/// Only the ends of their files are looked at.
pub fn examine_library(library: &Path) -> io::Result<Vec<PathBuf>> {
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
        // What cannot be read at all is not made better by a copy; the doctor tells of it.
        if Summary::read(&path).is_ok_and(|summary| summary.end.is_none()) {
            found.push(path);
        }
    }
    found.sort_unstable_by(|a, b| b.cmp(a));
    Ok(found)
}
