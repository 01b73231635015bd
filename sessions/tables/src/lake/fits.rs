//! Fits and moduli in a lake: one file each, with settings and result.

use super::layout::{encode_value, is_file_name, root};
use super::read::LakeError;
use crate::export::atomic::{io_error, write_or_same};
use crate::export::{ExportError, WriteOutcome};
use palpate_sessions::text::sha256;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// What was fitted to a session of a lake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LakeResult {
    /// A force model.
    Fit,
    /// A contact law.
    Modulus,
}

impl LakeResult {
    /// Its folder, the key of the folders below and of the file, and the key of the result in the file.
    const fn names(self) -> [&'static str; 3] {
        match self {
            Self::Fit => ["fits", "model", "fit"],
            Self::Modulus => ["moduli", "law", "modulus"],
        }
    }
}

/// Identity of a fit in a lake.
#[derive(Clone, Copy, Debug)]
pub struct FitFile<'a> {
    pub lake: &'a Path,
    pub result: LakeResult,
    /// Key of the model or of the law.
    pub model: &'a str,
    pub session_id: &'a str,
    /// Everything except the session that determines the result: options and software version.
    pub settings: &'a Value,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitState {
    Missing,
    /// Made with the same settings.
    There,
}

impl FitFile<'_> {
    pub fn path(&self) -> PathBuf {
        result_path(self.lake, self.result, self.model, self.session_id)
    }

    fn settings_sha256(&self) -> String {
        sha256(self.settings.to_string().as_bytes())
    }
}

/// The folder of the results of a model or a law.
#[must_use]
pub fn model_folder(lake: &Path, result: LakeResult, model: &str) -> PathBuf {
    let [folder, key, _] = result.names();
    root(lake).join(folder).join(format!("{key}={}", encode_value(model)))
}

/// Keys of the models or laws that a lake has results of, by name.
pub fn list_models(lake: &Path, result: LakeResult) -> Result<Vec<String>, LakeError> {
    let [folder, key, _] = result.names();
    let path = root(lake).join(folder);
    let failed = |source| LakeError::Io { path: path.clone(), source };
    if !path.exists() {
        return Ok(Vec::new());
    }
    let mut models = Vec::new();
    for entry in fs::read_dir(&path).map_err(failed)? {
        let name = entry.map_err(failed)?.file_name();
        let model = name.to_str().and_then(|name| name.strip_prefix(key)?.strip_prefix('='));
        models.extend(model.map(str::to_owned));
    }
    models.sort();
    Ok(models)
}

/// The settings of a stored fit and, as far as `T` takes them, its numbers; `None` where the session has none.
pub fn read_fit<T: DeserializeOwned>(
    lake: &Path,
    model: &str,
    session_id: &str,
) -> Result<Option<StoredFitFile<T>>, LakeError> {
    let path = result_path(lake, LakeResult::Fit, model, session_id);
    let Some(text) = read_text(&path)? else { return Ok(None) };
    let read = serde_json::from_str(&text);
    read.map(Some).map_err(|err| LakeError::BadFit { path, reason: err.to_string() })
}

/// The file of a session's result.
#[must_use]
pub fn result_path(lake: &Path, result: LakeResult, model: &str, session_id: &str) -> PathBuf {
    model_folder(lake, result, model).join(format!("{session_id}.json"))
}

fn read_text(path: &Path) -> Result<Option<String>, LakeError> {
    match fs::read_to_string(path) {
        Err(err) if err.kind() == ErrorKind::NotFound => Ok(None),
        text => text.map(Some).map_err(|source| LakeError::Io { path: path.into(), source }),
    }
}

/// A whole result as it is stored.
#[derive(Clone, Debug)]
pub struct StoredResult {
    /// The bytes of its file.
    pub text: String,
    pub settings: Value,
    pub result: Value,
}

/// The result of a session; `None` where there is none.
pub fn read_result(
    lake: &Path,
    result: LakeResult,
    model: &str,
    session_id: &str,
) -> Result<Option<StoredResult>, LakeError> {
    let path = result_path(lake, result, model, session_id);
    let Some(text) = read_text(&path)? else { return Ok(None) };
    let bad = |reason: String| LakeError::BadFit { path: path.clone(), reason };
    let mut stored: Value = serde_json::from_str(&text).map_err(|err| bad(err.to_string()))?;
    let [_, _, key] = result.names();
    let [settings, result] = ["settings", key].map(|key| stored[key].take());
    match settings.is_object() && result.is_object() {
        true => Ok(Some(StoredResult { text, settings, result })),
        false => Err(bad(format!("it has no settings or no {key}"))),
    }
}

/// What [`store_fit`] stored of a fit.
#[derive(Clone, Debug, Deserialize)]
pub struct StoredFitFile<T> {
    pub settings: Value,
    pub fit: T,
}

/// Refuses a fit with other settings, because files in a lake are never overwritten.
pub fn find_fit(file: &FitFile) -> Result<FitState, ExportError> {
    let path = file.path();
    if !path.exists() {
        return Ok(FitState::Missing);
    }
    let text = fs::read(&path).map_err(io_error(&path))?;
    let stored: Option<Value> = serde_json::from_slice(&text).ok();
    let hash = stored.as_ref().and_then(|stored| stored["settings_sha256"].as_str());
    match hash == Some(file.settings_sha256().as_str()) {
        true => Ok(FitState::There),
        false => Err(ExportError::Different { path }),
    }
}

/// Stores a fit as a JSON object with `session_id`, `model`, `settings`, `settings_sha256` and `fit`; a modulus with `law` and
/// `modulus` instead of `model` and `fit`.
pub fn store_fit(file: &FitFile, fit: &impl serde::Serialize) -> Result<WriteOutcome, ExportError> {
    let id = file.session_id;
    if !is_file_name(id) {
        return Err(ExportError::BadName { name: id.into() });
    }
    let path = file.path();
    let failed = io_error(&path);
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(&failed)?;
    }
    let [_, key, result] = file.result.names();
    let object = json!({
        "session_id": id, key: file.model, "settings": file.settings,
        "settings_sha256": file.settings_sha256(), result: fit,
    });
    write_or_same(&path, |out| writeln!(out, "{object}").map_err(&failed))
}
