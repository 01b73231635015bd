//! Files of other programs made into sessions, as the command line and the window both do it.

use crate::progress::Progress;
use palpate_model::about::Labels;
use palpate_runner::wall_now;
use palpate_sessions::{FolderError, Imported, library_folder, new_session_folder, new_session_id};
use palpate_tables::import::{
    Foreign, ForeignError, ForeignPart, KeepError, Kept, Told, folder_name, keep, open_foreign,
};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use thiserror::Error;

#[derive(Debug, Error)]
pub enum ImportFailure {
    #[error(transparent)]
    Foreign(#[from] ForeignError),
    #[error(transparent)]
    Keep(#[from] KeepError),
    #[error(transparent)]
    Library(#[from] FolderError),
    #[error("{} is there already or would be made twice; choose another folder", .0.display())]
    Taken(PathBuf),
    #[error("cancelled")]
    Cancelled,
}

/// Files to import, and where their sessions go.
#[derive(Clone, Debug, Default)]
pub struct Request {
    pub files: Vec<PathBuf>,
    /// Layout that the user states; all else is detected.
    pub told: Told,
    pub labels: Labels,
    /// Folder for the new session folders, each named after its file.
    pub into: Option<PathBuf>,
    /// The library, where no folder is given; the user's own without it.
    pub library: Option<PathBuf>,
    /// Report how the files would be read, and import nothing.
    pub is_dry_run: bool,
}

#[derive(Debug, Serialize)]
pub struct FileReport {
    pub file: PathBuf,
    /// Sheets, blocks or intervals of the file.
    pub parts: Vec<PartReport>,
    pub left_out: Vec<String>,
}

#[derive(Debug, Serialize)]
pub struct PartReport {
    /// `None` in a dry run.
    pub session: Option<PathBuf>,
    pub samples: usize,
    /// From the first to the last of them, in s.
    pub duration_s: f64,
    #[serde(flatten)]
    pub imported: Imported,
}

/// Makes sessions of files. `progress` hears which file is next, and may end it before the first session is made.
pub fn import(
    request: &Request,
    progress: &dyn Progress,
) -> Result<Vec<FileReport>, ImportFailure> {
    let read = |path: &PathBuf| open_foreign(path, &request.told).map_err(ImportFailure::Foreign);
    // Every file is read before the first session is made: a refusal leaves nothing behind.
    let of = request.files.len() * if request.is_dry_run { 1 } else { 2 };
    let (mut taken, mut reports) = (BTreeSet::new(), Vec::new());
    for (done, path) in request.files.iter().enumerate() {
        if progress.tell(done, of, &path.display().to_string()).is_break() {
            return Err(ImportFailure::Cancelled);
        }
        let foreign = read(path)?;
        check_folders(request.into.as_deref(), &foreign, &mut taken)?;
        reports.push(report_of(path, foreign));
    }
    if !request.is_dry_run {
        for (done, (path, file)) in request.files.iter().zip(&mut reports).enumerate() {
            // Sessions that are made stay.
            let name = path.display().to_string();
            let _ = progress.tell(request.files.len() + done, of, &name);
            let foreign = read(path)?;
            for (part, report) in foreign.parts.iter().zip(&mut file.parts) {
                report.session = Some(make(part, &foreign.bytes, request)?);
            }
        }
    }
    Ok(reports)
}

/// Refuses folders that are there already or would be made twice.
fn check_folders(
    into: Option<&Path>,
    foreign: &Foreign,
    taken: &mut BTreeSet<PathBuf>,
) -> Result<(), ImportFailure> {
    let Some(into) = into else { return Ok(()) };
    for part in &foreign.parts {
        let folder = into.join(folder_name(&part.imported));
        if folder.exists() || !taken.insert(folder.clone()) {
            return Err(ImportFailure::Taken(folder));
        }
    }
    Ok(())
}

fn make(part: &ForeignPart, original: &[u8], request: &Request) -> Result<PathBuf, ImportFailure> {
    let at = wall_now().into();
    let session_id = new_session_id(at);
    let folder = match (&request.into, &request.library) {
        (Some(into), _) => into.join(folder_name(&part.imported)),
        (None, Some(library)) => new_session_folder(library, &session_id),
        (None, None) => {
            let library = library_folder().map_err(ImportFailure::Library)?;
            new_session_folder(&library, &session_id)
        }
    };
    let target = Kept {
        folder: &folder,
        original,
        session_id,
        at,
        software_version: env!("CARGO_PKG_VERSION"),
        labels: request.labels.clone(),
    };
    keep(part, target).map_err(ImportFailure::Keep)?;
    Ok(folder)
}

fn report_of(path: &Path, foreign: Foreign) -> FileReport {
    let parts = foreign.parts.into_iter().map(|part| {
        let ends = [part.samples.first(), part.samples.last()];
        let [first, last] = ends.map(|one| one.map_or(0.0, |one| one.t));
        PartReport {
            session: None,
            samples: part.samples.len(),
            duration_s: last - first,
            imported: part.imported,
        }
    });
    FileReport { file: path.into(), parts: parts.collect(), left_out: foreign.left_out }
}

#[must_use]
pub fn text(file: &FileReport) -> String {
    let mut lines = vec![file.file.display().to_string()];
    for part in &file.parts {
        let rows = format!("{} over {:.3} s", part.samples, part.duration_s);
        lines.extend(import_lines(&part.imported, &rows));
        lines.push(match &part.session {
            Some(session) => format!("  session       {}", session.display()),
            None => "  session       none made: a dry run".into(),
        });
    }
    let left_out = file.left_out.iter();
    lines.extend(left_out.map(|reason| format!("  left out      {reason}")));
    lines.join("\n")
}

/// Makes sessions of files and tells what was made of each, in lines; for the window.
pub fn import_and_tell(request: &Request, progress: &dyn Progress) -> Result<Vec<String>, String> {
    Ok(import(request, progress).map_err(|err| err.to_string())?.iter().map(text).collect())
}

/// One line for each thing that was taken for something, with the option that says it otherwise.
fn import_lines(imported: &Imported, rows: &str) -> Vec<String> {
    let line = |what: &str, text: &str| format!("  {what:<13} {text}");
    let mut lines =
        vec![line("file", &format!("{} bytes, CRC-32 {}", imported.bytes, imported.checksum))];
    if !imported.part.is_empty() {
        lines.push(line("part", &format!("{} (--part NAME)", imported.part)));
    }
    let readings = imported.readings.iter();
    lines.extend(readings.map(|one| {
        // The record keeps this word for what the user stated.
        let stated = if one.how == "told" { ", as stated" } else { "" };
        line(&one.what, &format!("{}{stated} ({})", one.found, one.option))
    }));
    lines.push(line("rows", rows));
    let remarks = imported.remarks.iter();
    lines.extend(remarks.map(|remark| line("remark", remark)));
    lines
}
