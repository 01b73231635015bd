//! Fits in a lake: one file each, which tells how it was made.

use super::layout::{is_file_name, root, value};
use crate::export::atomic::{io_error, write_or_same};
use crate::export::{ExportError, Kept};
use palpate_sessions::text::sha256;
use serde_json::{Value, json};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A fit that is kept or to be made.
#[derive(Clone, Copy, Debug)]
pub struct FitFile<'a> {
    /// The lake.
    pub lake: &'a Path,
    /// Key of the model family.
    pub model: &'a str,
    /// The session.
    pub session_id: &'a str,
    /// All that decides about the result beside the session: what was asked for, and the software's version.
    pub settings: &'a Value,
}

/// Whether a fit is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitState {
    /// It is not.
    Missing,
    /// It is, made with the same settings.
    There,
}

impl FitFile<'_> {
    /// Where it is.
    pub fn path(&self) -> PathBuf {
        let folder = root(self.lake).join("fits");
        let folder = folder.join(format!("model={}", value(self.model)));
        folder.join(format!("{}.json", self.session_id))
    }

    fn settings_sha256(&self) -> String {
        sha256(self.settings.to_string().as_bytes())
    }
}

/// Looks for a fit. One with other settings is refused, for files of a lake never change.
pub fn state_of_fit(file: &FitFile) -> Result<FitState, ExportError> {
    let path = file.path();
    if !path.exists() {
        return Ok(FitState::Missing);
    }
    let text = fs::read(&path).map_err(io_error(&path))?;
    let kept: Option<Value> = serde_json::from_slice(&text).ok();
    let hash = kept.as_ref().and_then(|kept| kept["settings_sha256"].as_str());
    match hash == Some(file.settings_sha256().as_str()) {
        true => Ok(FitState::There),
        false => Err(ExportError::Different { path }),
    }
}

/// Keeps a fit: one JSON object with `session_id`, `model`, `settings`, `settings_sha256` and `fit`.
pub fn keep_fit(file: &FitFile, fit: &impl serde::Serialize) -> Result<Kept, ExportError> {
    let id = file.session_id;
    if !is_file_name(id) {
        return Err(ExportError::BadName { name: id.into() });
    }
    let path = file.path();
    let failed = io_error(&path);
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(&failed)?;
    }
    let object = json!({
        "session_id": id, "model": file.model, "settings": file.settings,
        "settings_sha256": file.settings_sha256(), "fit": fit,
    });
    write_or_same(&path, |out| writeln!(out, "{object}").map_err(&failed))
}
