//! What the fits of a lake say of their sessions' parameters, read back without the curves.

use super::FitRecipe;
use super::lake::{FIT_VERSION, lake_model};
use crate::compliance::ComplianceCorrectionError;
use palpate_rheology::fit::LogarithmStatistics;
use palpate_sessions::text::sha256_of_file;
use palpate_tables::lake::{
    LakeError, LakeResult, StoredFitFile, list_models, model_folder, read_fit,
};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use thiserror::Error;

#[derive(Debug, Error)]
pub enum StoredFitError {
    #[error(transparent)]
    Lake(#[from] LakeError),
    #[error(transparent)]
    Compliance(#[from] ComplianceCorrectionError),
    #[error(
        "only a lake stores the statistics of its fits; give one lake, or read the curves of these sessions"
    )]
    NoLake,
    #[error("the lake has no fits; fit the lake first")]
    NoFits,
    #[error(
        "the lake has no fits of {model}, but of {}; fit the lake with {model}, or choose another family", known.join(", ")
    )]
    OtherModels { model: String, known: Vec<String> },
    #[error(
        "the fits in {} are of an earlier version, without the statistics that a population needs; move this folder away and fit the lake again", folder.display()
    )]
    Earlier { folder: PathBuf },
    #[error("a newer version of palpate wrote the fit of {session}; update palpate")]
    Newer { session: String },
    #[error(
        "the stored fit of {session} has {found}, and the population is to have {wanted}; move {} away and fit the lake again with {wanted}", folder.display()
    )]
    Conditions { session: String, found: String, wanted: String, folder: PathBuf },
}

/// How a stored fit was made, of its settings.
#[derive(Debug, Deserialize)]
struct FitConditions {
    #[serde(default = "first_version")]
    fit_version: u32,
    fixed: Vec<String>,
    free: Vec<String>,
    compliance_sha256: Option<String>,
    #[serde(default)]
    unload: bool,
}

/// The first stored form names no version.
const fn first_version() -> u32 {
    1
}

impl FitConditions {
    /// One phrase for each condition.
    fn words(&self) -> [String; 4] {
        let listed = |names: &[String], none: &str, are: &str| match names {
            [] => none.to_owned(),
            names => format!("{} {are}", names.join(", ")),
        };
        let corrected =
            |hash: &String| format!("depths corrected by the compliance of SHA-256 {hash}");
        [
            listed(&self.fixed, "no parameter fixed", "fixed"),
            listed(&self.free, "the parameters found that are found by default", "found too"),
            self.compliance_sha256.as_ref().map_or_else(|| "raw depths".to_owned(), corrected),
            if self.unload { "loading and unloading" } else { "loading alone" }.to_owned(),
        ]
    }
}

/// The fits of one family in a lake, made with all of its parameters found, of loading alone.
#[derive(Debug)]
pub struct StoredFits<'a> {
    lake: &'a Path,
    model: String,
    wanted: FitConditions,
}

impl<'a> StoredFits<'a> {
    /// Those that a recipe would make.
    pub fn of(lake: &'a Path, recipe: &FitRecipe) -> Result<Self, StoredFitError> {
        let model = lake_model(&recipe.options);
        let compliance = recipe.corrections.file()?.map(|path| {
            sha256_of_file(path).map_err(|source| LakeError::Io { path: path.into(), source })
        });
        let compliance_sha256 = compliance.transpose()?;
        let known = list_models(lake, LakeResult::Fit)?;
        if known.is_empty() {
            return Err(StoredFitError::NoFits);
        }
        if !known.contains(&model) {
            return Err(StoredFitError::OtherModels { model, known });
        }
        let (fixed, free) = (Vec::new(), Vec::new());
        let fit_version = FIT_VERSION;
        let wanted = FitConditions { fit_version, fixed, free, compliance_sha256, unload: false };
        Ok(Self { lake, model, wanted })
    }

    /// The statistics of a session; `None` where the lake has no fit of it.
    pub fn statistics(&self, session: &str) -> Result<Option<LogarithmStatistics>, StoredFitError> {
        #[derive(Deserialize)]
        struct Numbers {
            logarithms: Option<LogarithmStatistics>,
        }
        let Some(stored) = read_fit::<Numbers>(self.lake, &self.model, session)? else {
            return Ok(None);
        };
        let StoredFitFile { settings, fit } = stored;
        let folder = model_folder(self.lake, LakeResult::Fit, &self.model);
        let session = session.to_owned();
        let found: FitConditions = serde_json::from_value(settings).map_err(|err| {
            let (path, reason) = (folder.join(format!("{session}.json")), err.to_string());
            LakeError::BadFit { path, reason }
        })?;
        if found.fit_version > FIT_VERSION {
            return Err(StoredFitError::Newer { session });
        }
        let pairs = found.words().into_iter().zip(self.wanted.words());
        if let Some((found, wanted)) = pairs.into_iter().find(|(found, wanted)| found != wanted) {
            return Err(StoredFitError::Conditions { session, found, wanted, folder });
        }
        fit.logarithms.map(Some).ok_or(StoredFitError::Earlier { folder })
    }
}
