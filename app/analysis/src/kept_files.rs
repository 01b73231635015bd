//! What palpate keeps on a computer: every kind of file, its place, its version, and how it is reset.
//!
//! `docs/guide/settings.md` has the same table.

use crate::fit::last;
use crate::shared_library::STORES_FOLDER;
use crate::station_settings::{TOKENS_FILE, TOKENS_FORMAT};
use crate::window_requests::{SETTINGS_FILE, SETTINGS_VERSION};
use palpate_model::calibration::CALIBRATION_FORMAT;
use palpate_model::rig::compliance_document::COMPLIANCE_FORMAT;
use palpate_rheology::trade::TRADE_FORMAT;
use palpate_runner::study::{STUDY_FILE, STUDY_VERSION};
use palpate_sessions::catalog::{CATALOG_FILE, CATALOG_VERSION};
use palpate_sessions::document_store::Document;
use palpate_sessions::locked_protocols::{LOCKED_PROTOCOL_FORMAT, LockedProtocol};
use palpate_sessions::populations::{POPULATION_FORMAT, PopulationDocument};
use palpate_sessions::specimen_queue::{QUEUE_FOLDER, QUEUE_VERSION};
use palpate_sessions::{LINES_VERSION, RECORD_VERSION};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// One kind of file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct KeptFile {
    pub what: &'static str,
    pub place: PathBuf,
    /// Form and version that this program writes.
    pub form: String,
    pub written_by: &'static str,
    pub reset: &'static str,
    /// Whether there is such a file or folder here.
    pub is_there: bool,
}

/// All kinds, for a library.
#[must_use]
pub fn kept_files(library: &Path) -> Vec<KeptFile> {
    let lines = format!("JSON lines, head version {LINES_VERSION}");
    let rows = [
        (
            "window settings",
            SETTINGS_FILE,
            format!("JSON, settings version {SETTINGS_VERSION}"),
            "the window when it closes",
            "delete the file",
        ),
        (
            "sessions",
            "sessions",
            format!("MCAP, record version {RECORD_VERSION}"),
            "runs, imports and recoveries",
            "move a session's folder elsewhere",
        ),
        (
            "edits and analyses",
            "sessions/*/*.jsonl",
            lines.clone(),
            "tags, notes, reviews, saved fits",
            "undo or withdraw; nothing is erased",
        ),
        (
            "programmes",
            "programmes",
            lines.clone(),
            "runs of programmes",
            "move a programme's folder elsewhere",
        ),
        (
            "queue of specimens",
            QUEUE_FOLDER,
            format!("JSON lines, queue version {QUEUE_VERSION}"),
            "'palpate queue' and the window",
            "move the folder elsewhere",
        ),
        (
            "study",
            STUDY_FILE,
            format!("TOML, palpate-study {STUDY_VERSION}"),
            "you",
            "delete the file; sessions keep what they copied from it",
        ),
        (
            "notifications",
            "notifications.toml",
            "TOML, palpate-notifications 1".to_owned(),
            "you",
            "delete the file; nothing is sent then",
        ),
        (
            "announced calibrations",
            "notifications-announced.json",
            "JSON, version 1".to_owned(),
            "runs with notifications",
            "delete the file; the next run announces them once more",
        ),
        (
            "calibrations",
            "calibrations",
            format!("JSON, format {CALIBRATION_FORMAT}"),
            "'palpate calibration' and the window",
            "supersede the calibration by a newer one",
        ),
        (
            "locked protocols",
            LockedProtocol::FOLDER,
            format!("JSON, format {LOCKED_PROTOCOL_FORMAT}"),
            "'palpate protocol lock'",
            "lock it again; the newest of a name counts",
        ),
        (
            "machine compliances",
            "compliances",
            format!("JSON, format {COMPLIANCE_FORMAT}"),
            "'palpate compliance --save'",
            "measure again; the newest counts",
        ),
        (
            "populations",
            PopulationDocument::FOLDER,
            format!("JSON, format {POPULATION_FORMAT}"),
            "'palpate population --save'",
            "save it under another name; a stored one is never changed",
        ),
        (
            "daily checks",
            "checks",
            lines,
            "'palpate daily-check'",
            "check again; the newest counts",
        ),
        (
            "curves of the trade",
            "trade",
            format!("JSON, format {TRADE_FORMAT}"),
            "'palpate trade' and the window",
            "delete the folder and measure again",
        ),
        (
            "catalog",
            CATALOG_FILE,
            format!("SQLite, version {CATALOG_VERSION}"),
            "every search",
            "delete the file; the next search makes it again",
        ),
        (
            "catalogs of stores",
            STORES_FOLDER,
            format!("SQLite, version {CATALOG_VERSION}"),
            "'palpate library' and 'palpate find --store'",
            "delete the folder; the next search reads the store's table again",
        ),
        (
            "rig files and locks",
            "rigs",
            "TOML; locks are empty".to_owned(),
            "you; locks: a program that holds a rig",
            "delete a lock that no program holds",
        ),
        (
            "tokens of stations",
            TOKENS_FILE,
            format!("JSON, format {TOKENS_FORMAT}"),
            "'palpate token'",
            "'palpate token remove NAME', or delete the file",
        ),
        (
            "log of the program",
            "log",
            "text, 5 files at most".to_owned(),
            "every command",
            "delete the folder",
        ),
    ];
    let mut files: Vec<KeptFile> = rows
        .into_iter()
        .map(|(what, place, form, written_by, reset)| {
            let place = library.join(place);
            let is_there = match place.to_string_lossy().split_once('*') {
                Some((before, _)) => Path::new(before).exists(),
                None => place.exists(),
            };
            KeptFile { what, place, form, written_by, reset, is_there }
        })
        .collect();
    files.extend(last::state_file().map(|place| KeptFile {
        what: "last fit",
        is_there: place.exists(),
        place,
        form: format!("JSON, last fit version {}", last::VERSION),
        written_by: "'palpate fit'",
        reset: "delete the file",
    }));
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A raised version, or a new kind of file, is to be in the guide too.
    #[test]
    fn guide_has_every_kind_of_file_with_its_version() {
        let guide = include_str!("../../../docs/guide/settings.md");
        let files = kept_files(Path::new("library"));
        assert!(files.len() >= 11);
        for file in files {
            let row = guide.lines().find(|line| line.starts_with(&format!("| {} |", file.what)));
            let row = row.unwrap_or_else(|| panic!("the guide has no row '{}'", file.what));
            assert!(row.contains(&file.form), "'{}' is not in: {row}", file.form);
            assert!(row.contains(file.reset), "'{}' is not in: {row}", file.reset);
        }
    }
}
