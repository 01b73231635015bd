//! The sessions of a crate, and what is taken out of them for readers without palpate: calibrations and protocols.

use super::error::CrateError;
use super::files;
use crate::recordings::find_sessions;
use chrono::{DateTime, TimeDelta, Utc};
use palpate_model::calibration::Calibration;
use palpate_model::metadata::SessionLabels;
use palpate_sessions::analyses::{Analyses, Analysis, AnalysisContent};
use palpate_sessions::compliances::ComplianceStore;
use palpate_sessions::log::find_files;
use palpate_sessions::recover::is_in_use;
use palpate_sessions::text::sha256;
use palpate_sessions::{DataQuality, Edits, LOCK_FILE, Manifest, SPARE_FILE, SessionSummary};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Folder of a crate with its sessions.
pub const SESSIONS: &str = "sessions";
/// Folder with further files of the study.
pub const FILES: &str = "files";
/// Folder with what the steps need of a library.
pub const LIBRARY: &str = "library";
const COMPLIANCES: &str = "compliances";
const CALIBRATIONS: &str = "calibrations";
const PROTOCOLS: &str = "protocols";

/// A session in a crate.
#[derive(Clone, Debug)]
pub(super) struct CrateSession {
    /// Of its folder in `sessions`.
    pub name: String,
    pub manifest: Manifest,
    /// With the edits of the session made.
    pub labels: SessionLabels,
    pub samples: u64,
    pub duration_s: f64,
    pub is_ended: bool,
    /// With the reason.
    pub verdict: Option<(DataQuality, String)>,
    pub analyses: Vec<StoredName>,
    pub calibration: Option<ExtractedFile>,
    pub protocol: Option<ExtractedFile>,
}

/// An analysis of a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct StoredName {
    pub name: String,
    /// Such as `fit`.
    pub kind: &'static str,
}

/// A document of a session as a file of the crate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ExtractedFile {
    /// From the crate's folder.
    pub file: String,
    /// Of the document.
    pub name: String,
}

impl CrateSession {
    /// Its folder, from the crate's.
    pub fn folder(&self) -> String {
        format!("{SESSIONS}/{}", self.name)
    }

    pub fn rejection(&self) -> Option<&str> {
        let rejected = self.verdict.as_ref();
        let rejected = rejected.filter(|(verdict, _)| *verdict == DataQuality::Rejected);
        rejected.map(|(_, reason)| reason.as_str())
    }

    pub fn ended_at(&self) -> DateTime<Utc> {
        let span = TimeDelta::milliseconds((1e3 * self.duration_s) as i64);
        self.manifest.started_at.checked_add_signed(span).unwrap_or(self.manifest.started_at)
    }

    /// Its calibration; `None` of an imported session.
    pub fn read_calibration(&self) -> Option<Calibration> {
        serde_json::from_value(self.manifest.calibration.clone()).ok()
    }

    /// Days from the calibration to the session.
    pub fn calibration_age_days(&self, calibration: &Calibration) -> Option<i64> {
        let taken = DateTime::parse_from_rfc3339(calibration.taken_at.as_deref()?).ok()?;
        Some((self.manifest.started_at - taken.with_timezone(&Utc)).num_days())
    }
}

/// Copies sessions whole into the folder of a crate.
pub(super) fn copy_sessions(paths: &[PathBuf], folder: &Path) -> Result<(), CrateError> {
    let mut names = BTreeSet::new();
    let mut known = BTreeSet::new();
    for path in find_sessions(paths)?.paths {
        if !path.is_dir() {
            return Err(CrateError::NoFolder(path));
        }
        let summary = SessionSummary::read(&path)
            .map_err(|reason| CrateError::Session { path: path.clone(), reason })?;
        if summary.end.is_none() && is_in_use(&path) {
            return Err(CrateError::BeingRecorded(path));
        }
        let whole = path.canonicalize().map_err(|err| CrateError::read(&path, err))?;
        let name = free_name(&plain_name(&whole), &mut names);
        if !known.insert(whole) {
            return Err(CrateError::Twice(path));
        }
        copy_session(&path, &folder.join(SESSIONS).join(name))?;
    }
    Ok(())
}

fn copy_session(from: &Path, to: &Path) -> Result<(), CrateError> {
    let segments =
        find_files(from).map_err(|reason| CrateError::Session { path: from.to_owned(), reason })?;
    // A part of the log may be in the spare folder; in the crate all parts are in one.
    for segment in &segments {
        files::copy(segment, &to.join(segment.file_name().unwrap_or_default()))?;
    }
    for name in files::list(from)? {
        let is_draft = name.ends_with(".palpate.tmp");
        let target = files::path_of(to, &name);
        if ![LOCK_FILE, SPARE_FILE].contains(&name.as_str()) && !is_draft && !target.exists() {
            files::copy(&files::path_of(from, &name), &target)?;
        }
    }
    Ok(())
}

/// A name of a folder that every system takes.
fn plain_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let is_odd = |letter: char| letter.is_control() || "<>:\"/\\|?*\u{fffd}".contains(letter);
    let name = name.replace(is_odd, "-");
    let name = name.trim_end_matches(['.', ' ']);
    if name.is_empty() { "session".to_owned() } else { name.to_owned() }
}

/// The name, with a number where it is taken. Some systems do not tell large letters from small.
fn free_name(name: &str, taken: &mut BTreeSet<String>) -> String {
    let numbered = |number: usize| match number {
        1 => name.to_owned(),
        number => format!("{name}-{number}"),
    };
    let mut names = (1..).map(numbered);
    let free = names.find(|one| taken.insert(one.to_lowercase()));
    free.unwrap_or_else(|| name.to_owned())
}

/// Reads the sessions of a crate, and writes their calibrations and protocols as files of their own.
pub(super) fn read_sessions(folder: &Path) -> Result<Vec<CrateSession>, CrateError> {
    let at = folder.join(SESSIONS);
    let mut names = BTreeSet::new();
    for name in files::list(&at)? {
        names.extend(name.split_once('/').map(|(session, _)| session.to_owned()));
    }
    names.into_iter().map(|name| read_session(folder, name)).collect()
}

fn read_session(folder: &Path, name: String) -> Result<CrateSession, CrateError> {
    let path = folder.join(SESSIONS).join(&name);
    let summary = SessionSummary::read(&path)
        .map_err(|reason| CrateError::Session { path: path.clone(), reason })?;
    let manifest = summary.manifest;
    let edits = Edits::read(&path, &manifest.session_id)
        .map_err(|reason| CrateError::Edits { path: path.clone(), reason })?;
    let mut labels = manifest.labels();
    edits.apply_to_labels(&mut labels);
    let calibration = extract(folder, CALIBRATIONS, &manifest.calibration)?;
    let protocol = extract(folder, PROTOCOLS, &manifest.plan)?;
    Ok(CrateSession {
        name,
        labels,
        samples: summary.samples,
        duration_s: summary.last.seconds().0,
        is_ended: summary.end.is_some() || manifest.imported.is_some(),
        verdict: edits.verdict().map(|(verdict, edit)| (verdict, edit.reason.clone())),
        analyses: stored_names(&path, &manifest.session_id),
        calibration,
        protocol,
        manifest,
    })
}

fn stored_names(session: &Path, session_id: &str) -> Vec<StoredName> {
    let Ok(analyses) = Analyses::read(session, session_id) else { return Vec::new() };
    let is_withdrawal = |one: &&Analysis| matches!(one.what, AnalysisContent::Withdrawal);
    let withdrawn: Vec<&str> =
        analyses.all.iter().filter(is_withdrawal).map(|one| one.name.as_str()).collect();
    let counts = analyses.all.iter().filter(|one| !withdrawn.contains(&one.name.as_str()));
    counts.map(|one| StoredName { name: one.name.clone(), kind: one.what.word() }).collect()
}

/// Writes a document of a manifest as a file; sessions with the same one share it.
fn extract(
    folder: &Path,
    kind: &str,
    document: &Value,
) -> Result<Option<ExtractedFile>, CrateError> {
    if document.is_null() {
        return Ok(None);
    }
    let name = document["name"].as_str().unwrap_or(kind).to_owned();
    let plain = |letter: char| if letter.is_ascii_alphanumeric() { letter } else { '-' };
    let short: String = name.to_lowercase().chars().map(plain).take(40).collect();
    let text = format!("{document:#}\n");
    let file = format!("{kind}/{short}-{}.json", &sha256(text.as_bytes())[..8]);
    let path = files::path_of(folder, &file);
    if !path.exists() {
        files::write(&path, text.as_bytes())?;
    }
    Ok(Some(ExtractedFile { file, name }))
}

/// Copies the machine compliances of the sessions' rigs.
pub(super) fn copy_compliances(
    library: Option<&Path>,
    sessions: &[CrateSession],
    folder: &Path,
) -> Result<(), CrateError> {
    let rigs: BTreeSet<&str> =
        sessions.iter().filter_map(|one| Some(one.manifest.rig.as_ref()?.name.as_str())).collect();
    let shelf = library.map(ComplianceStore::open).unwrap_or_default();
    for one in shelf.documents.iter().filter(|one| rigs.contains(one.document.rig.as_str())) {
        let name = one.path.file_name().unwrap_or_default();
        files::copy(&one.path, &folder.join(LIBRARY).join(COMPLIANCES).join(name))?;
    }
    Ok(())
}

/// Copies further files of a study.
pub(super) fn copy_files(
    named: &[String],
    study: Option<&Path>,
    folder: &Path,
) -> Result<(), CrateError> {
    let base = study.and_then(Path::parent).unwrap_or(Path::new(""));
    for name in named {
        if super::steps::leads_out(name) {
            return Err(CrateError::FileOutside(name.clone()));
        }
        let from = base.join(name);
        let to = folder.join(FILES).join(from.file_name().unwrap_or_default());
        if to.exists() {
            return Err(CrateError::FileTwice(name.clone()));
        }
        files::copy(&from, &to)?;
    }
    Ok(())
}
