//! Finds the recordings that a user's paths mean, and reads them for joint analysis.
//!
//! Decided here, once for every front end: a folder with a segment of a log is a session and any other folder a
//! collection of recordings; what was recovered stands for the session it was recovered from; a recording given twice is
//! refused; a rejected session is left out with a note.

use crate::compliance::{ComplianceCorrection, ComplianceCorrections, RawDepths};
use crate::exports::remove_recovered_originals;
use crate::fit::Origin;
use crate::source::{self, FitSource, SourceError, SourceSelection};
use palpate_model::calibration::{Calibration, CalibrationError};
use palpate_rheology::fit::{FitError, FitSample, Signal, SignalRecord, TracedRecord};
use palpate_sessions::folder::is_session_folder;
use palpate_sessions::log::ReadError;
use palpate_tables::import::ColumnNames;
use std::path::{Path, PathBuf};
use thiserror::Error;
use walkdir::WalkDir;

/// Endings of file names that are taken for tables.
const TABLES: [&str; 2] = ["csv", "tsv"];
/// Ending of a session's log.
const LOG: &str = "mcap";

#[derive(Debug, Error)]
pub enum RecordingsError {
    #[error(transparent)]
    Missing(ReadError),
    #[error("cannot read the folder {} ({reason}); check its permissions", path.display())]
    Folder { path: PathBuf, reason: String },
    #[error("{} contains neither a session nor a table (.csv or .tsv); give a folder that contains one", .0.display())]
    Nothing(PathBuf),
    #[error("{} is a table, not a session", .0.display())]
    Table(PathBuf),
    #[error("{} is given twice and would count as two recordings; give it once", .0.display())]
    Twice(PathBuf),
    #[error("{}: {reason}", path.display())]
    Source { path: PathBuf, reason: Box<SourceError> },
    #[error("all {0} sources are rejected, so nothing is left to fit")]
    Rejected(usize),
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FoundRecordings {
    pub paths: Vec<PathBuf>,
    /// Sessions that are left out, because what was recovered from them is there too.
    pub recovered_originals: Vec<PathBuf>,
}

/// A note on sessions that their recovered copies replace; `None` without any.
#[must_use]
pub fn recovered_originals_note(names: impl IntoIterator<Item = String>) -> Option<String> {
    let names: Vec<String> = names.into_iter().collect();
    (!names.is_empty()).then(|| {
        format!("left out, because their recovered copies are included: {}", names.join(", "))
    })
}

impl FoundRecordings {
    pub fn note(&self) -> Option<String> {
        recovered_originals_note(
            self.recovered_originals.iter().map(|path| path.display().to_string()),
        )
    }
}

/// Whether a path is a session: its folder, or the file of its log. What is not there is taken for one, so that its
/// reader says what is missing.
#[must_use]
pub fn is_session(path: &Path) -> bool {
    path.is_dir() || has_ending(path, &[LOG]) || !path.exists()
}

/// Whether a path is a folder of recordings rather than one recording.
#[must_use]
pub fn is_collection(path: &Path) -> bool {
    path.is_dir() && !is_session_folder(path)
}

fn has_ending(path: &Path, endings: &[&str]) -> bool {
    let is_ending = |ending: &std::ffi::OsStr| {
        let mut known = endings.iter();
        known.any(|known| ending.eq_ignore_ascii_case(known))
    };
    path.extension().is_some_and(is_ending)
}

/// Every recording named, and every one in the folders named: folder by folder, by name.
pub fn find(paths: &[PathBuf]) -> Result<FoundRecordings, RecordingsError> {
    let (paths, copied) = remove_recovered_originals(all(paths)?, is_session);
    Ok(FoundRecordings { paths, recovered_originals: copied })
}

/// Sessions alone; a table is an error.
pub fn find_sessions(paths: &[PathBuf]) -> Result<FoundRecordings, RecordingsError> {
    if let Some(table) = paths.iter().find(|path| !is_session(path)) {
        return Err(RecordingsError::Table(table.clone()));
    }
    let mut found = find(paths)?;
    found.paths.retain(|path| is_session(path));
    Ok(found)
}

fn all(paths: &[PathBuf]) -> Result<Vec<PathBuf>, RecordingsError> {
    let mut found = Vec::new();
    for path in paths {
        if !path.exists() {
            let path = path.clone();
            return Err(RecordingsError::Missing(ReadError::Missing { path }));
        }
        if !is_collection(path) {
            found.push(path.clone());
            continue;
        }
        let before = found.len();
        below(path, &mut found).map_err(|err| RecordingsError::Folder {
            path: err.path().unwrap_or(path).to_owned(),
            reason: err.io_error().map_or(err.to_string(), ToString::to_string),
        })?;
        if found.len() == before {
            return Err(RecordingsError::Nothing(path.clone()));
        }
    }
    Ok(found)
}

/// Recordings below a folder. Links to folders are not followed, so no walk is endless and nothing
/// counts twice; hidden names are left alone.
fn below(folder: &Path, found: &mut Vec<PathBuf>) -> Result<(), walkdir::Error> {
    let mut entries = WalkDir::new(folder).sort_by_file_name().into_iter();
    while let Some(entry) = entries.next() {
        let entry = entry?;
        let (path, is_folder) = (entry.path(), entry.file_type().is_dir());
        let is_hidden = entry.depth() > 0 && entry.file_name().to_string_lossy().starts_with('.');
        let is_session = is_folder && entry.depth() > 0 && is_session_folder(path);
        if is_folder && (is_hidden || is_session) {
            entries.skip_current_dir();
        }
        let is_file = || path.is_file() && has_ending(path, &[TABLES[0], TABLES[1], LOG]);
        if !is_hidden && (is_session || (!is_folder && is_file())) {
            found.push(entry.into_path());
        }
    }
    Ok(())
}

/// Names of recordings that are analysed together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RecordingNames {
    #[default]
    Path,
    /// Name of the folder or file alone.
    Stem,
}

impl RecordingNames {
    fn name(self, path: &Path) -> String {
        let stem = path.file_stem().filter(|_| self == Self::Stem);
        stem.map_or_else(|| path.display().to_string(), |stem| stem.to_string_lossy().into_owned())
    }
}

#[derive(Clone, Copy, Debug)]
pub struct RecordingOptions<'a> {
    /// Names of the columns of tables without a header.
    pub columns: Option<&'a ColumnNames>,
    /// Which part of each, and whether rejected ones are taken.
    pub wanted: SourceSelection,
    pub corrections: &'a ComplianceCorrections,
    pub naming: RecordingNames,
}

/// A recording that is analysed together with others.
#[derive(Clone, Debug)]
pub struct Recording {
    pub name: String,
    pub samples: Vec<FitSample>,
    /// The specimen pressed, where the source says so.
    pub specimen: Option<String>,
    /// Effect of the machine compliance on its depths, applied or not.
    pub compliance: Option<ComplianceCorrection>,
    /// The calibration its forces were read with; `None` for a table.
    pub calibration: Option<Calibration>,
    /// What the load cell reported, where it was recorded.
    pub signal: Option<Signal>,
    /// Its depths before they were corrected for machine compliance; `None` where they were not.
    pub raw: Option<RawDepths>,
}

impl Recording {
    #[must_use]
    pub fn of(name: String, source: FitSource, compliance: Option<ComplianceCorrection>) -> Self {
        Self {
            name,
            samples: source.samples,
            specimen: source.specimen,
            calibration: source.calibration,
            signal: source.signal,
            raw: source.raw,
            compliance,
        }
    }

    pub fn borrowed(&self) -> (&str, &[FitSample]) {
        (&self.name, &self.samples)
    }
}

#[derive(Clone, Debug, Default)]
pub struct Recordings {
    pub all: Vec<Recording>,
    /// Remarks, each with the name of its recording.
    pub notes: Vec<String>,
}

/// Refuses a recording that is named twice, however it is written.
pub fn check_once<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> Result<(), RecordingsError> {
    let real = |path: &PathBuf| path.canonicalize().unwrap_or_else(|_| path.clone());
    let mut reals: Vec<PathBuf> = paths.into_iter().map(real).collect();
    reals.sort();
    match reals.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(RecordingsError::Twice(pair[0].clone())),
        None => Ok(()),
    }
}

/// Reads recordings that are analysed together, each once.
pub fn read(paths: &[PathBuf], how: RecordingOptions<'_>) -> Result<Recordings, RecordingsError> {
    check_once(paths)?;
    let mut read = Recordings::default();
    for path in paths {
        let name = how.naming.name(path);
        let failed = |reason: SourceError| RecordingsError::Source {
            path: path.clone(),
            reason: Box::new(reason),
        };
        let mut source = match source::read_stretch(path, how.columns, how.wanted) {
            Err(SourceError::Rejected { reason }) => {
                let note = format!("{name}: left out, because the session was rejected: {reason}");
                read.notes.push(note);
                continue;
            }
            source => source.map_err(failed)?,
        };
        let compliance = how.corrections.apply(&mut source).map_err(|err| failed(err.into()))?;
        let applied = compliance.as_ref().filter(|one| one.is_applied);
        source.notes.extend(applied.map(ComplianceCorrection::sentence));
        let notes = source.notes.iter().map(|note| format!("{name}: {note}"));
        read.notes.extend(notes);
        read.all.push(Recording::of(name, source, compliance));
    }
    match paths.len() - read.all.len() {
        0 => {}
        all if all == paths.len() => return Err(RecordingsError::Rejected(all)),
        rejected => {
            read.notes.push(format!("{} sources, {rejected} of them rejected", paths.len()))
        }
    }
    Ok(read)
}

impl Recordings {
    pub fn borrowed(&self) -> Vec<(&str, &[FitSample])> {
        self.all.iter().map(Recording::borrowed).collect()
    }

    /// All of them with their signals, where they have one.
    pub fn signals(&self) -> Vec<SignalRecord<'_>> {
        fn of(one: &Recording) -> SignalRecord<'_> {
            let Recording { name, samples, signal, .. } = one;
            SignalRecord { name, samples, signal: signal.as_ref() }
        }
        self.all.iter().map(of).collect()
    }

    /// Systematic uncertainty by `find`; `None` where no record has a calibration or compliance.
    pub fn systematic<T>(
        &self,
        find: impl FnOnce(&[TracedRecord<'_>]) -> Result<T, FitError>,
    ) -> Result<Option<T>, String> {
        let origin =
            |one: &Recording| Origin::of(one.calibration.as_ref(), one.compliance.as_ref());
        let origins: Result<Vec<_>, _> = self.all.iter().map(origin).collect();
        let origins = origins.map_err(|err: CalibrationError| err.to_string())?;
        if !origins.iter().any(Origin::is_known) {
            return Ok(None);
        }
        let pairs = self.all.iter().zip(&origins);
        let traced = pairs.map(|(one, origin)| origin.traced(&one.name, &one.samples));
        find(&traced.collect::<Vec<_>>()).map(Some).map_err(|err| err.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

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
        let names: Vec<_> = found.iter().map(|path| path.strip_prefix(at).unwrap()).collect();
        let expected = ["a/alone.mcap", "a/deep/t.tsv", "b/s10", "b/s9", "b/table.CSV"];
        assert_eq!(names, expected.map(Path::new));
        // Named itself, a link is what it leads to; a session is a source and not a folder of some.
        assert_eq!(all(&[at.join("again")]).unwrap().len(), 3);
        assert_eq!(all(&[at.join("b/s9")]).unwrap(), [at.join("b/s9")]);
        let refusal = all(&[at.join("empty")]).unwrap_err();
        assert!(matches!(refusal, RecordingsError::Nothing(_)), "{refusal}");
        let table = find_sessions(&[at.join("b/table.CSV")]).unwrap_err();
        assert!(matches!(table, RecordingsError::Table(_)), "{table}");
    }

    #[test]
    fn a_recording_given_twice_is_refused_however_it_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let table = folder.path().join("one.csv");
        fs::write(&table, "t_s,depth_mm,force_N\n0,0,0\n1,1,0.5\n2,1,0.4\n").unwrap();
        let how = RecordingOptions {
            columns: None,
            wanted: SourceSelection::default(),
            corrections: &ComplianceCorrections::none(None),
            naming: RecordingNames::Stem,
        };
        let once = read(std::slice::from_ref(&table), how).unwrap();
        assert_eq!((once.all[0].name.as_str(), once.all.len()), ("one", 1));
        let again = folder.path().join(".").join("one.csv");
        let twice = read(&[table, again], how).unwrap_err();
        assert!(matches!(twice, RecordingsError::Twice(_)), "{twice}");
    }
}
