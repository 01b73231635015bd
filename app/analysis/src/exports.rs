//! Sessions as tables and into lakes, as the command line and the window both write them.

use crate::analysed_session::StreamedAnalysis;
use crate::edited_session;
use crate::progress::Progress;
use crate::source::SourceError;
use palpate_sessions::recover::is_in_use;
use palpate_sessions::{Manifest, SessionSummary, atomic};
use palpate_tables::export::{
    ExportError, ExtraColumns, LogFacts, RowFeed, SampleSelection, SampleTable, TableExport,
    TableFormat,
};
use palpate_tables::lake::{self, LakeAddition, LakeQuality};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use thiserror::Error;

#[derive(Debug, Error)]
pub enum ExportFailure {
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(transparent)]
    Export(#[from] ExportError),
    #[error(
        "{} is still being recorded, and a lake (a folder of exported sessions) takes only complete ones; add the session when the run has ended", .0.display()
    )]
    BeingRecorded(PathBuf),
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ExportTarget {
    /// A table in this folder that takes the session folder's name.
    Table(TableFormat, PathBuf),
    /// One message per sample in this new file.
    Messages(PathBuf),
    /// One run of Bluesky documents with an event per sample in this new file.
    Documents(PathBuf),
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExportedFile {
    pub path: PathBuf,
    /// Rows, messages or events of samples in it.
    pub rows: u64,
    pub notes: Vec<String>,
}

impl ExportTarget {
    /// Removes leftovers of killed exports from the target folder.
    pub fn sweep(&self) {
        let folder = match self {
            Self::Table(_, folder) => Some(folder.as_path()),
            Self::Messages(path) | Self::Documents(path) => path.parent(),
        };
        folder.map(|folder| atomic::remove_leftovers(folder, 1));
    }

    /// Writes a table whose rows `feed` hands out, each time that it is called.
    pub fn write(
        &self,
        session: &Path,
        table: &TableExport,
        log: LogFacts,
        feed: RowFeed,
    ) -> Result<ExportedFile, ExportError> {
        let (path, rows) = match self {
            Self::Messages(path) => (path.clone(), table.write_messages(path, feed)?),
            Self::Documents(path) => (path.clone(), table.write_documents(path, log, feed)?),
            Self::Table(format, folder) => {
                let stem = stem(session, table.manifest);
                let name = table.selection.file_name(&stem, format.ending());
                let path = folder.join(name);
                let rows = table.write(*format, &path, feed)?;
                (path, rows)
            }
        };
        Ok(ExportedFile { path, rows, notes: table.notes.to_vec() })
    }
}

/// Writes what is chosen of a session, its edits made; samples pass by and are never all in memory. `tell` hears of
/// how many samples how many are done.
pub fn export(
    session: &Path,
    selection: &SampleSelection,
    target: &ExportTarget,
    tell: &mut dyn FnMut(u64, u64),
) -> Result<ExportedFile, ExportFailure> {
    let passing = edited_session::stream_edited(session)?;
    let extra = ExtraColumns::of_sensors(&passing.outline.manifest, &passing.outline.entries);
    let table = TableExport {
        manifest: &passing.outline.manifest,
        notes: &passing.outline.notes,
        extra: &extra,
        selection,
    };
    let of = passing.outline.samples;
    let mut feed = |visit: &mut dyn FnMut(&[_])| {
        // From the start each time that the samples are read.
        let mut done = 0;
        passing.rows(session, &mut |rows| {
            done += rows.len() as u64;
            tell(done, of);
            visit(rows);
        })
    };
    let log = LogFacts { entries: &passing.outline.entries, end: passing.outline.end.as_ref() };
    Ok(target.write(session, &table, log, &mut feed)?)
}

/// What is chosen of a session in memory, as one of its analyses has it: the table that [`export`] writes.
pub fn sample_table(
    session: &StreamedAnalysis,
    path: &Path,
    selection: &SampleSelection,
) -> Result<SampleTable, ExportFailure> {
    let outline = &session.edited.outline;
    let extra = ExtraColumns::of_sensors(&outline.manifest, &outline.entries);
    let table = TableExport {
        manifest: &outline.manifest,
        notes: &outline.notes,
        extra: &extra,
        selection,
    };
    Ok(table.collect(&mut |visit: &mut dyn FnMut(&[_])| session.table_rows(path, visit))?)
}

/// The name of the session's folder, for its export.
fn stem(session: &Path, manifest: &Manifest) -> String {
    let whole = session.canonicalize().ok();
    // A folder's name may have dots in it; the ending of a file's does not count.
    let stem = whole.as_deref().and_then(|path| match path.is_dir() {
        true => path.file_name(),
        false => path.file_stem(),
    });
    stem.map_or_else(|| manifest.session_id.clone(), |name| name.to_string_lossy().into_owned())
}

/// Removes leftovers of killed exports from a lake.
pub fn sweep_lake(lake: &Path) {
    atomic::remove_leftovers(lake, usize::MAX);
}

pub fn add_to_lake(lake: &Path, session: &Path) -> Result<LakeAddition, ExportFailure> {
    // Looked at before it is read: a run that ends in between would be there without its end.
    let is_in_use = is_in_use(session);
    let passing = edited_session::stream_edited(session)?;
    if is_in_use && passing.outline.end.is_none() {
        return Err(ExportFailure::BeingRecorded(session.into()));
    }
    let verdict = passing.edits.verdict();
    let quality =
        LakeQuality { quality: verdict.map(|(verdict, edit)| (verdict, edit.reason.as_str())) };
    let mut feed = |visit: &mut dyn FnMut(&[_])| passing.rows(session, visit);
    Ok(lake::add_session(lake, &passing.outline, quality, &mut feed)?)
}

/// The sessions and tables without those sessions whose recovered copy is among them, so that samples count once; then
/// those left out. `is_session` tells which can be sessions at all.
#[must_use]
pub fn remove_recovered_originals(
    found: Vec<PathBuf>,
    is_session: impl Fn(&Path) -> bool,
) -> (Vec<PathBuf>, Vec<PathBuf>) {
    let id = |path: &PathBuf| {
        let manifest = SessionSummary::read(path).ok().filter(|_| is_session(path))?.manifest;
        Some((manifest.session_id, manifest.recovered.map(|it| it.from)))
    };
    let ids: Vec<Option<(String, Option<String>)>> = found.iter().map(id).collect();
    let copied: BTreeSet<&String> = ids.iter().flatten().filter_map(|it| it.1.as_ref()).collect();
    let is_copied =
        |one: &Option<(String, _)>| one.as_ref().is_some_and(|it| copied.contains(&it.0));
    let (originals, rest): (Vec<_>, Vec<_>) =
        found.into_iter().zip(&ids).partition(|(_, one)| is_copied(one));
    let paths = |of: Vec<(PathBuf, _)>| of.into_iter().map(|(path, _)| path).collect();
    (paths(rest), paths(originals))
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ExportDestination {
    Tables(TableFormat, PathBuf),
    Lake(PathBuf),
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportSummary {
    pub sentence: String,
    /// A sentence for each session that was not written, and notes on the data.
    pub remarks: Vec<String>,
}

/// Writes every session, one after the other. An existing file is never overwritten; a remark names it.
pub fn export_all(
    sessions: Vec<PathBuf>,
    to: &ExportDestination,
    progress: &dyn Progress,
) -> ExportSummary {
    let of = sessions.len();
    let (sessions, copied) = match to {
        ExportDestination::Tables(..) => (sessions, Vec::new()),
        ExportDestination::Lake(_) => remove_recovered_originals(sessions, |_| true),
    };
    let left_out = |path: &PathBuf| {
        format!("{}: left out, because its recovered copy is included", name(path))
    };
    let mut remarks: Vec<String> = copied.iter().map(left_out).collect();
    match to {
        ExportDestination::Lake(lake) => sweep_lake(lake),
        ExportDestination::Tables(format, folder) => {
            if let Err(err) = std::fs::create_dir_all(folder) {
                let folder = folder.display();
                let sentence = format!(
                    "cannot create the folder {folder} ({err}), so nothing was written; choose another folder"
                );
                return ExportSummary { sentence, remarks };
            }
            ExportTarget::Table(*format, folder.clone()).sweep();
        }
    }
    let (mut written, mut were_there) = (0, 0);
    for (done, session) in sessions.iter().enumerate() {
        let name = name(session);
        if progress.report(done, of, &name).is_break() {
            remarks
                .push(format!("cancelled: {} sessions were not exported", sessions.len() - done));
            break;
        }
        let notes = match to {
            ExportDestination::Lake(lake) => add_to_lake(lake, session).map(|added| {
                were_there += usize::from(added.was_there);
                Vec::new()
            }),
            ExportDestination::Tables(format, folder) => {
                let target = ExportTarget::Table(*format, folder.clone());
                let mut tell = |rows, all| {
                    // One session is written whole once it is begun.
                    let _ = progress.report(done, of, &format!("{name}: {rows} of {all} samples"));
                };
                let exported = export(session, &SampleSelection::default(), &target, &mut tell);
                exported.map(|written| written.notes)
            }
        };
        written += usize::from(notes.is_ok());
        let notes = notes.unwrap_or_else(|err| vec![err.to_string()]);
        remarks.extend(notes.iter().map(|note| format!("{name}: {note}")));
    }
    let sentence = match to {
        ExportDestination::Tables(format, folder) => format!(
            "{written} of {of} sessions written as {} to {}",
            format.ending(),
            // A name alone does not tell the folder.
            std::path::absolute(folder).unwrap_or_else(|_| folder.clone()).display()
        ),
        ExportDestination::Lake(lake) => format!(
            "{} of {of} sessions added to {}; {were_there} were already there",
            written - were_there,
            lake.display()
        ),
    };
    ExportSummary { sentence, remarks }
}

fn name(session: &Path) -> String {
    session
        .file_name()
        .map_or_else(|| session.display().to_string(), |name| name.to_string_lossy().into_owned())
}
