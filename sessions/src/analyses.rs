//! Analyses of a finished session: fits, masked stretches, recalibrated forces.
//!
//! Each analysis is a named record in `analyses.jsonl` beside the log: author, time, program version, inputs (SHA-256 of
//! every file), settings and results. A record is never overwritten and a name is never used twice; a further record
//! withdraws an analysis.

use crate::chain::{self, ChainError, ChainHead};
use crate::edits::EDITS_FILE;
use crate::folder::{LOCK_FILE, file_beside, segment_number};
use crate::lock::{HolderLock, LockError};
use crate::log::ReadError;
use crate::log::files::find_files;
use crate::text::{sha256, sha256_of_file};
use chrono::{DateTime, Utc};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Name of the file of analyses in a session folder.
pub const ANALYSES_FILE: &str = "analyses.jsonl";
/// Version of the results of a property of the material; a field that changes its meaning raises it.
pub const MATERIAL_VERSION: u32 = 1;
/// Longest name of an analysis in letters: it has to fit on a line.
const NAME_MAX: usize = 80;

/// One input of an analysis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AnalysisInput {
    /// A file of the session, or `calibration` or `analysis NAME`.
    pub what: String,
    /// Hash of the file's bytes, or of a document's compact JSON with its keys in alphabetical order.
    pub sha256: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "analysis", rename_all = "lowercase")]
pub enum AnalysisContent {
    Fit {
        /// Name of the analysis whose forces were fitted, if any.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        based_on: Option<String>,
        settings: Value,
        /// The report, as `palpate fit --json` prints it.
        results: Value,
    },
    /// A property of the material by a contact law.
    Material {
        /// [`MATERIAL_VERSION`] of the program that wrote it.
        material_version: u32,
        /// Name of the analysis whose forces were fitted, if any.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        based_on: Option<String>,
        settings: Value,
        /// The report, as `palpate material --json` prints it.
        results: Value,
        /// The same, as `palpate material` prints it.
        words: String,
    },
    /// Forces computed from the raw signal with another calibration.
    Recalibration { calibration: Value, results: Value },
    /// Stretches of a session whose forces are ignored.
    Mask {
        /// Start and end of each stretch, session time in s.
        left_out_s: Vec<[f64; 2]>,
    },
    /// The analysis of this name no longer counts.
    Withdrawal,
}

impl AnalysisContent {
    pub const fn word(&self) -> &'static str {
        match self {
            Self::Fit { .. } => "fit",
            Self::Material { .. } => "material",
            Self::Recalibration { .. } => "recalibration",
            Self::Mask { .. } => "mask",
            Self::Withdrawal => "withdrawal",
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Analysis {
    /// Name of the analysis; in a withdrawal, of the withdrawn one.
    pub name: String,
    pub at: DateTime<Utc>,
    pub by: String,
    /// May be empty, except in a withdrawal.
    pub reason: String,
    pub software_version: String,
    /// Version of the decision rules in that program.
    pub engine_version: u32,
    pub inputs: Vec<AnalysisInput>,
    #[serde(flatten)]
    pub what: AnalysisContent,
}

#[derive(Debug, Error)]
pub enum AnalysisError {
    #[error(transparent)]
    Chain(#[from] ChainError),
    #[error(transparent)]
    Lock(#[from] LockError),
    #[error(transparent)]
    Session(#[from] ReadError),
    #[error("{} cannot be read ({source}); check its permissions", path.display())]
    Input { path: PathBuf, source: std::io::Error },
    #[error(
        "'{name}' cannot be the name of an analysis; give 1 to {NAME_MAX} characters on one line"
    )]
    Name { name: String },
    #[error(
        "the session already has an analysis '{name}', and a name is never used twice; choose another name"
    )]
    Taken { name: String },
    #[error("the session has no analysis '{name}'{known}")]
    None { name: String, known: String },
    #[error("a withdrawal needs a reason; give the reason in a few words")]
    NoReason,
    #[error("{} is not a session folder; choose a session folder", path.display())]
    NotAFolder { path: PathBuf },
}

/// All records of a session, in the order of writing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Analyses {
    /// Includes withdrawals and withdrawn analyses.
    pub all: Vec<Analysis>,
    /// SHA-256 of the file; empty if there is none.
    pub sha256: String,
    pub head: ChainHead,
}

impl Analyses {
    /// `session` is the session's folder or a log file in it.
    pub fn read(session: &Path, session_id: &str) -> Result<Self, AnalysisError> {
        Self::read_since(session, session_id, ChainHead::default())
    }

    /// Like [`read`](Self::read), and refuses a file that no longer holds the lines up to `since`.
    pub(crate) fn read_since(
        session: &Path,
        session_id: &str,
        since: ChainHead,
    ) -> Result<Self, AnalysisError> {
        let Some(path) = file_beside(session, ANALYSES_FILE) else {
            return Ok(Self::default());
        };
        let chain = chain::read_since(&path, session_id, since)?;
        let head = chain.head();
        let all: Vec<Analysis> = chain.records(&path, "an analysis")?;
        let sha256 = if all.is_empty() {
            String::new()
        } else {
            sha256_of_file(&path).map_err(|source| AnalysisError::Input { path, source })?
        };
        Ok(Self { all, sha256, head })
    }

    /// The file itself as an input; `None` without any record.
    pub fn input(&self) -> Option<AnalysisInput> {
        (!self.all.is_empty())
            .then(|| AnalysisInput { what: ANALYSES_FILE.to_owned(), sha256: self.sha256.clone() })
    }

    pub fn withdrawal(&self, name: &str) -> Option<&Analysis> {
        let is_it = |one: &&Analysis| one.name == name && one.what == AnalysisContent::Withdrawal;
        self.all.iter().find(is_it)
    }

    /// Analyses that are not withdrawn, in the order of writing.
    pub fn active(&self) -> impl Iterator<Item = &Analysis> {
        let is_open = |one: &&Analysis| {
            one.what != AnalysisContent::Withdrawal && self.withdrawal(&one.name).is_none()
        };
        self.all.iter().filter(is_open)
    }

    /// The analysis of this name that is not withdrawn.
    pub fn get(&self, name: &str) -> Result<&Analysis, AnalysisError> {
        self.active().find(|one| one.name == name).ok_or_else(|| AnalysisError::None {
            name: name.to_owned(),
            known: match self.withdrawal(name) {
                Some(by) => format!(" any more, because {} withdrew it: {}", by.by, by.reason),
                None if self.all.is_empty() => ", nor any other".to_owned(),
                None => String::new(),
            },
        })
    }
}

/// Hashes of the files that every analysis reads: the log and the edits.
pub fn read_session_inputs(session: &Path) -> Result<Vec<AnalysisInput>, AnalysisError> {
    let mut files = find_files(session)?;
    let edits = match session.is_dir() {
        true => session.join(EDITS_FILE),
        false => session.with_file_name(EDITS_FILE),
    };
    files.extend(edits.is_file().then_some(edits));
    let input = |path: PathBuf| match sha256_of_file(&path) {
        Ok(sha256) => Ok(AnalysisInput {
            what: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            sha256,
        }),
        Err(source) => Err(AnalysisError::Input { path, source }),
    };
    files.into_iter().map(input).collect()
}

#[must_use]
pub fn document_input(what: &str, document: &Value) -> AnalysisInput {
    AnalysisInput { what: what.to_owned(), sha256: sha256(document.to_string().as_bytes()) }
}

/// Names of the input files that differ from `now`, which comes from [`read_session_inputs`]; documents are not compared.
#[must_use]
pub fn changed_inputs(analysis: &Analysis, now: &[AnalysisInput]) -> Vec<String> {
    let of = |inputs: &[AnalysisInput], what: &str| {
        let found = inputs.iter().find(|one| one.what == what);
        found.map(|one| one.sha256.clone())
    };
    let is_file =
        |one: &&AnalysisInput| one.what == EDITS_FILE || segment_number(&one.what).is_some();
    let mut names: Vec<&str> =
        analysis.inputs.iter().filter(is_file).chain(now).map(|one| one.what.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let is_other = |name: &&str| of(&analysis.inputs, name) != of(now, name);
    names.into_iter().filter(is_other).map(str::to_owned).collect()
}

/// Appends a record. The recording must have ended.
pub fn add_analysis(
    folder: &Path,
    session_id: &str,
    analysis: &Analysis,
) -> Result<(), AnalysisError> {
    let name = &analysis.name;
    let is_line = !name.trim().is_empty() && !name.chars().any(char::is_control);
    if !is_line || name.chars().count() > NAME_MAX {
        return Err(AnalysisError::Name { name: name.clone() });
    }
    if !folder.is_dir() {
        return Err(AnalysisError::NotAFolder { path: folder.into() });
    }
    let _lock = HolderLock::acquire_waiting(&folder.join(LOCK_FILE))?;
    let there = Analyses::read(folder, session_id)?;
    if analysis.what == AnalysisContent::Withdrawal {
        there.get(name)?;
        if analysis.reason.trim().is_empty() {
            return Err(AnalysisError::NoReason);
        }
    } else if there.all.iter().any(|one| one.name == *name) {
        return Err(AnalysisError::Taken { name: name.clone() });
    }
    let path = folder.join(ANALYSES_FILE);
    Ok(chain::append(&path, session_id, analysis)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use chrono::TimeZone;

    fn analysis(name: &str, reason: &str, what: AnalysisContent) -> Analysis {
        Analysis {
            name: name.into(),
            at: Utc.with_ymd_and_hms(2026, 3, 5, 14, 15, 7).unwrap(),
            by: "Ada".into(),
            reason: reason.into(),
            software_version: "0.1.0".into(),
            engine_version: 1,
            inputs: Vec::new(),
            what,
        }
    }

    fn mask(from: f64) -> AnalysisContent {
        AnalysisContent::Mask { left_out_s: vec![[from, from + 1.0]] }
    }

    #[test]
    fn a_name_is_used_once_and_withdrawn_by_a_record() {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        let add = |one: &Analysis| add_analysis(at, "id", one);
        add(&analysis("bump", "", mask(0.1 + 0.2))).unwrap();
        add(&analysis("µ \"two\"", "", mask(3.0))).unwrap();
        let taken = add(&analysis("bump", "", mask(5.0))).unwrap_err();
        assert!(taken.to_string().contains("never used twice"), "{taken}");
        let withdrawal = |name, reason| analysis(name, reason, AnalysisContent::Withdrawal);
        assert!(matches!(add(&withdrawal("bump", " ")), Err(AnalysisError::NoReason)));
        assert!(matches!(add(&withdrawal("other", "why")), Err(AnalysisError::None { .. })));
        add(&withdrawal("bump", "wrong stretch")).unwrap();
        let again = add(&withdrawal("bump", "again")).unwrap_err().to_string();
        assert!(again.contains("wrong stretch"), "{again}");
        assert!(matches!(add(&analysis("bump", "", mask(5.0))), Err(AnalysisError::Taken { .. })));
        let read = Analyses::read(at, "id").unwrap();
        assert_eq!(read.all.len(), 3);
        assert_eq!(read.all[0].what, mask(0.1 + 0.2));
        let names: Vec<&str> = read.active().map(|one| one.name.as_str()).collect();
        assert_eq!(names, ["µ \"two\""]);
        assert!(read.get("bump").is_err() && read.get("µ \"two\"").is_ok());
        for name in ["", " ", "a\nb", "\u{0}", &"x".repeat(81)] {
            let refused = add(&analysis(name, "", mask(0.0)));
            assert!(matches!(refused, Err(AnalysisError::Name { .. })), "{name:?}");
        }
        // A changed record is noticed.
        let path = at.join(ANALYSES_FILE);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.replacen("3.0", "3.5", 1)).unwrap();
        assert!(Analyses::read(at, "id").is_err());
    }

    #[test]
    fn changed_inputs_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        std::fs::write(at.join("000.mcap"), "log").unwrap();
        let calibration = document_input("calibration", &serde_json::json!({"b": 1, "a": 2}));
        // `printf '{"a":2,"b":1}' | sha256sum`
        let expected = "d3626ac30a87e6f7a6428233b3c68299976865fa5508e4267c5415c76af7a772";
        assert_eq!(calibration.sha256, expected);
        let mut inputs = read_session_inputs(at).unwrap();
        inputs.push(calibration);
        let one = Analysis { inputs, ..analysis("a", "", mask(0.0)) };
        assert!(changed_inputs(&one, &read_session_inputs(at).unwrap()).is_empty());
        std::fs::write(at.join(EDITS_FILE), "edit").unwrap();
        let changed = changed_inputs(&one, &read_session_inputs(at).unwrap());
        assert_eq!(changed, [EDITS_FILE]);
        std::fs::write(at.join("000.mcap"), "lug").unwrap();
        let changed = changed_inputs(&one, &read_session_inputs(at).unwrap());
        assert_eq!(changed, ["000.mcap", EDITS_FILE]);
    }
}
