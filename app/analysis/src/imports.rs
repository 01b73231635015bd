//! Files of other programs made into sessions, as the command line and the window both do it.

use crate::progress::Progress;
use palpate_model::metadata::SessionLabels;
use palpate_runner::study::{StudyError, complete_labels};
use palpate_runner::wall_now;
use palpate_sessions::{
    FolderError, ImportOrigin, library_folder, new_session_folder, new_session_id,
};
use palpate_tables::import::{
    ForeignError, ForeignFile, ForeignPart, ImportOptions, ImportTarget, StoreImportError,
    folder_name, open_foreign, store_import,
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
    Keep(#[from] StoreImportError),
    #[error(transparent)]
    Library(#[from] FolderError),
    #[error("{} exists already, or two parts of the import would be stored in it; choose another folder", .0.display())]
    Taken(PathBuf),
    #[error(transparent)]
    Study(#[from] StudyError),
    #[error("cancelled")]
    Cancelled,
}

/// Files to import, and where their sessions go.
#[derive(Clone, Debug, Default)]
pub struct ImportRequest {
    pub files: Vec<PathBuf>,
    /// Layout that the user states; all else is detected.
    pub layout: ImportOptions,
    pub labels: SessionLabels,
    /// Folder for the new session folders, each named after its file.
    pub into: Option<PathBuf>,
    /// The library, where no folder is given; the user's own without it.
    pub library: Option<PathBuf>,
    /// Report how the files would be read, and import nothing.
    pub is_dry_run: bool,
}

#[derive(Debug, Serialize)]
pub struct ImportedFile {
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
    pub imported: ImportOrigin,
}

/// Makes sessions of files. `progress` hears which file is next, and may end it before the first session is made.
pub fn import(
    request: &ImportRequest,
    progress: &dyn Progress,
) -> Result<Vec<ImportedFile>, ImportFailure> {
    let read = |path: &PathBuf| open_foreign(path, &request.layout).map_err(ImportFailure::Foreign);
    // Every file is read before the first session is made: a refusal leaves nothing behind.
    let labels = labels_with_study(request)?;
    let of = request.files.len() * if request.is_dry_run { 1 } else { 2 };
    let (mut taken, mut reports) = (BTreeSet::new(), Vec::new());
    for (done, path) in request.files.iter().enumerate() {
        if progress.report(done, of, &path.display().to_string()).is_break() {
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
            let _ = progress.report(request.files.len() + done, of, &name);
            let foreign = read(path)?;
            for (part, report) in foreign.parts.iter().zip(&mut file.parts) {
                report.session = Some(make(part, &foreign.bytes, request, &labels)?);
            }
        }
    }
    Ok(reports)
}

/// The labels of the request, with those of the library's study.
fn labels_with_study(request: &ImportRequest) -> Result<SessionLabels, ImportFailure> {
    let mut labels = request.labels.clone();
    if let Some(library) = request.library.clone().or_else(|| library_folder().ok()) {
        complete_labels(&mut labels, &library)?;
    }
    Ok(labels)
}

/// Refuses folders that are there already or would be made twice.
fn check_folders(
    into: Option<&Path>,
    foreign: &ForeignFile,
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

fn make(
    part: &ForeignPart,
    original: &[u8],
    request: &ImportRequest,
    labels: &SessionLabels,
) -> Result<PathBuf, ImportFailure> {
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
    let target = ImportTarget {
        folder: &folder,
        original,
        session_id,
        at,
        software_version: env!("CARGO_PKG_VERSION"),
        labels: labels.clone(),
    };
    store_import(part, target).map_err(ImportFailure::Keep)?;
    Ok(folder)
}

fn report_of(path: &Path, foreign: ForeignFile) -> ImportedFile {
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
    ImportedFile { file: path.into(), parts: parts.collect(), left_out: foreign.left_out }
}

#[must_use]
pub fn text(file: &ImportedFile) -> String {
    let mut lines = vec![file.file.display().to_string()];
    for part in &file.parts {
        let rows = format!("{} over {:.3} s", part.samples, part.duration_s);
        lines.extend(import_lines(&part.imported, &rows));
        lines.push(match &part.session {
            Some(session) => format!("  session       {}", session.display()),
            None => "  session       none (dry run)".into(),
        });
    }
    let left_out = file.left_out.iter();
    lines.extend(left_out.map(|reason| format!("  left out      {reason}")));
    lines.join("\n")
}

/// Makes sessions of files and tells what was made of each, in lines; for the window.
pub fn import_with_summary(
    request: &ImportRequest,
    progress: &dyn Progress,
) -> Result<Vec<String>, String> {
    Ok(import(request, progress).map_err(|err| err.to_string())?.iter().map(text).collect())
}

/// One line for each thing that was taken for something, with the option that says it otherwise.
fn import_lines(imported: &ImportOrigin, rows: &str) -> Vec<String> {
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
