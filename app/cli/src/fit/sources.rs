//! What a batch fits: every session and table in folders, in order.

use super::super::output::Output;
use super::super::source_failure;
use super::Failure;
use palpate_analysis::compliance::{Correction, Corrections};
use palpate_analysis::exports::without_copied;
use palpate_analysis::fit::no_systematic;
use palpate_analysis::origin::Origin;
use palpate_analysis::source::{self, SourceError, Wanted};
use palpate_model::calibration::{Calibration, CalibrationError};
use palpate_rheology::fit::{FitError, FitSample, Traced};
use palpate_sessions::log::ReadError;
use palpate_tables::import::ColumnNames;
use std::fs;
use std::path::{Path, PathBuf};
use walkdir::WalkDir;

/// Endings of file names that are taken for tables.
const TABLES: [&str; 2] = ["csv", "tsv"];
/// Ending of a session's log.
const LOG: &str = "mcap";

/// Whether a path is a folder of sources rather than one source.
pub(super) fn is_collection(path: &Path) -> bool {
    path.is_dir() && !is_session(path)
}

/// A session's folder has a log whose name is a number: `000.mcap` or, where the first segment was
/// lost, a later one.
fn is_session(folder: &Path) -> bool {
    fs::read_dir(folder).is_ok_and(|mut entries| {
        entries.any(|entry| {
            entry.is_ok_and(|entry| {
                let path = entry.path();
                let stem = path.file_stem().map(|stem| stem.to_string_lossy());
                has_ending(&path, &[LOG])
                    && stem.is_some_and(|stem| {
                        stem.len() >= 3 && stem.bytes().all(|byte| byte.is_ascii_digit())
                    })
            })
        })
    })
}

fn has_ending(path: &Path, endings: &[&str]) -> bool {
    path.extension().is_some_and(|ending| {
        endings
            .iter()
            .any(|known| ending.eq_ignore_ascii_case(known))
    })
}

/// Every source named, and every one in the folders named: folder by folder, by name. A session whose
/// recovered copy is among them is left out, so that its samples count once.
pub(crate) fn find(paths: &[PathBuf], output: &Output) -> Result<Vec<PathBuf>, Failure> {
    let is_log = |path: &Path| path.is_dir() || has_ending(path, &[LOG]);
    let (rest, originals) = without_copied(all(paths)?, is_log);
    let names = originals.iter().map(|path| path.display().to_string());
    tell_copied(names.collect(), output);
    Ok(rest)
}

/// Tells which sessions are left out for their recovered copies.
pub(super) fn tell_copied(names: Vec<String>, output: &Output) {
    if !names.is_empty() {
        output.note(&format!(
            "left out, because the copy that was recovered from it is there too: {}",
            names.join(", ")
        ));
    }
}

/// Every source named, and every one in the folders named: folder by folder, by name.
fn all(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut found = Vec::new();
    for path in paths {
        if !path.exists() {
            return Err(Failure::usage(ReadError::Missing { path: path.clone() }));
        }
        if !is_collection(path) {
            found.push(path.clone());
            continue;
        }
        let before = found.len();
        below(path, &mut found).map_err(|err| {
            let reason = err.io_error().map_or(err.to_string(), ToString::to_string);
            Failure::failed(format!(
                "cannot look into {} ({reason}); check its permissions",
                err.path().unwrap_or(path).display()
            ))
        })?;
        if found.len() == before {
            return Err(Failure::usage(format!(
                "{} holds no session and no table (.csv or .tsv); name the folder that does",
                path.display()
            )));
        }
    }
    Ok(found)
}

/// Every session named, and every one in the folders named; tables are none.
pub(crate) fn find_sessions(paths: &[PathBuf], output: &Output) -> Result<Vec<PathBuf>, Failure> {
    let is_table = |path: &PathBuf| path.is_file() && !has_ending(path, &[LOG]);
    if let Some(table) = paths.iter().find(|path| is_table(path)) {
        return Err(Failure::usage(format!(
            "{} is no session; 'palpate import' makes one of a table",
            table.display()
        )));
    }
    let mut found = find(paths, output)?;
    found.retain(|path| !is_table(path));
    Ok(found)
}

/// A source that is looked at together with others.
pub(crate) struct Recording {
    /// Its path, as given.
    pub name: String,
    /// What is fitted.
    pub samples: Vec<FitSample>,
    /// The specimen pressed, where the source says so.
    pub specimen: Option<String>,
    /// What the rig's compliance does to its depths, or would.
    pub compliance: Option<Correction>,
    /// The calibration its forces were read with; `None` for a table.
    pub calibration: Option<Calibration>,
}

/// What calibrations and compliances add, as `find` tells it; `None` where neither is known of any record. What cannot be
/// told is a note.
pub(super) fn systematic<T>(
    records: &[Recording],
    find: impl FnOnce(&[Traced<'_>]) -> Result<T, FitError>,
    output: &Output,
) -> Option<T> {
    let each = records
        .iter()
        .map(|one| Origin::of(one.calibration.as_ref(), one.compliance.as_ref()));
    let origins: Result<Vec<Origin>, CalibrationError> = each.collect();
    let found = origins.map_err(|err| err.to_string()).and_then(|origins| {
        let traced: Vec<Traced<'_>> = records
            .iter()
            .zip(&origins)
            .map(|(one, origin)| origin.traced(&one.name, &one.samples))
            .collect();
        let is_known = origins.iter().any(Origin::is_known);
        let found = is_known.then(|| find(&traced)).transpose();
        found.map_err(|err| err.to_string())
    });
    found.unwrap_or_else(|reason| {
        output.note(&no_systematic(&reason));
        None
    })
}

impl Recording {
    /// As fits take it.
    pub fn borrowed(&self) -> (&str, &[FitSample]) {
        (&self.name, &self.samples)
    }
}

/// Reads sources that are looked at together, each once. Rejected sessions are left out and counted.
pub(crate) fn read(
    found: &[PathBuf],
    columns: Option<&ColumnNames>,
    wanted: Wanted,
    corrections: &Corrections,
    output: &Output,
) -> Result<Vec<Recording>, Failure> {
    let mut real: Vec<PathBuf> = found
        .iter()
        .map(|path| path.canonicalize().unwrap_or_else(|_| path.clone()))
        .collect();
    real.sort();
    if let Some(pair) = real.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Failure::usage(format!(
            "{} is given twice; fitted together it would count as two recordings",
            pair[0].display()
        )));
    }
    let one = |path: &PathBuf| {
        let name = path.display().to_string();
        let mut source = match source::read_stretch(path, columns, wanted) {
            Err(SourceError::Rejected { reason }) => {
                output.note(&format!("{name}: rejected, left out: {reason}"));
                return Ok(None);
            }
            source => source.map_err(source_failure)?,
        };
        let compliance = corrections.apply(&mut source);
        let compliance = compliance.map_err(|err| source_failure(err.into()))?;
        let told = compliance.as_ref().filter(|told| told.is_applied);
        source.notes.extend(told.map(Correction::sentence));
        for note in &source.notes {
            output.note(&format!("{name}: {note}"));
        }
        Ok(Some(Recording {
            name,
            samples: source.samples,
            specimen: source.specimen,
            calibration: source.calibration,
            compliance,
        }))
    };
    let read: Vec<Option<Recording>> = found.iter().map(one).collect::<Result<_, Failure>>()?;
    let taken: Vec<Recording> = read.into_iter().flatten().collect();
    let rejected = found.len() - taken.len();
    if rejected > 0 {
        let count = format!("{} sources, {rejected} of them rejected", found.len());
        if taken.is_empty() {
            return Err(Failure::usage(format!(
                "{count}: nothing is left; add --include-rejected to take them all the same"
            )));
        }
        output.note(&count);
    }
    Ok(taken)
}

/// Sources below a folder. Links to folders are not followed, so no walk is endless and nothing
/// counts twice; hidden names are left alone.
fn below(folder: &Path, found: &mut Vec<PathBuf>) -> Result<(), walkdir::Error> {
    let mut entries = WalkDir::new(folder).sort_by_file_name().into_iter();
    while let Some(entry) = entries.next() {
        let entry = entry?;
        let (path, is_folder) = (entry.path(), entry.file_type().is_dir());
        let is_hidden = entry.depth() > 0 && entry.file_name().to_string_lossy().starts_with('.');
        let is_session = is_folder && entry.depth() > 0 && is_session(path);
        if is_folder && (is_hidden || is_session) {
            entries.skip_current_dir();
        }
        let is_table = || path.is_file() && (has_ending(path, &TABLES) || has_ending(path, &[LOG]));
        if !is_hidden && (is_session || (!is_folder && is_table())) {
            found.push(entry.into_path());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sessions_and_tables_are_found_in_order_and_links_are_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        for name in ["b/s10", "b/s9", "a/deep", "empty", ".hidden"] {
            fs::create_dir_all(at.join(name)).unwrap();
        }
        for name in [
            "b/s10/000.mcap",
            "b/s9/001.mcap",
            "b/s9/lock",
            "b/table.CSV",
            "a/deep/t.tsv",
            "a/alone.mcap",
            ".hidden/t.csv",
            "notes.txt",
        ] {
            fs::write(at.join(name), "").unwrap();
        }
        // A loop, and a second way to the same sessions.
        std::os::unix::fs::symlink(at, at.join("a/loop")).unwrap();
        std::os::unix::fs::symlink(at.join("b"), at.join("again")).unwrap();
        let found = all(&[at.to_path_buf()]).unwrap();
        let names: Vec<_> = found
            .iter()
            .map(|path| path.strip_prefix(at).unwrap())
            .collect();
        let expected = [
            "a/alone.mcap",
            "a/deep/t.tsv",
            "b/s10",
            "b/s9",
            "b/table.CSV",
        ];
        assert_eq!(names, expected.map(Path::new));
        // Named itself, a link is what it leads to; a session is a source and not a folder of some.
        assert_eq!(all(&[at.join("again")]).unwrap().len(), 3);
        assert_eq!(all(&[at.join("b/s9")]).unwrap(), [at.join("b/s9")]);
        let refusal = all(&[at.join("empty")]).unwrap_err();
        assert!(refusal.sentence().contains("holds no session"));
    }
}
