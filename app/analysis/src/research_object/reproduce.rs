//! Computes every number and figure of a crate again, and compares.

use super::archive::{self, SealState};
use super::changes::{ChangelogEntry, changes_since, version_numbers};
use super::compare::{FileResult, Tolerance, compare};
use super::contents::read_sessions;
use super::error::CrateError;
use super::files::{self, FileFault};
use super::make::read_study;
use super::metadata::{self, CrateOrigin, METADATA_FILE};
use super::run_steps::{FailedStep, run_steps};
use super::steps::{CrateStep, RESULTS, StepRunner};
use super::study_file::STUDY_FILE;
use crate::progress::Progress;
use chrono::{DateTime, Utc};
use serde::Serialize;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// A crate to compute again.
#[derive(Clone, Copy, Debug)]
pub struct ReproduceRequest<'a> {
    /// Its folder or zip file.
    pub from: &'a Path,
    /// A new folder for what is computed; without it nothing is kept.
    pub to: Option<&'a Path>,
    pub now: DateTime<Utc>,
}

/// A file of a step beside the same computed again.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComparedFile {
    /// From the crate's folder.
    pub file: String,
    #[serde(flatten)]
    pub result: FileResult,
}

/// All files of a step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepComparison {
    pub step: String,
    /// As it is typed.
    pub line: String,
    pub files: Vec<ComparedFile>,
}

impl StepComparison {
    /// The first file that differs.
    #[must_use]
    pub fn first_difference(&self) -> Option<&ComparedFile> {
        self.files.iter().find(|one| !one.result.is_equal())
    }
}

/// Which program made a crate, beside this one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProgramAge {
    Same,
    Older,
    Newer,
    /// The same version of another state of the source.
    OtherBuild,
}

/// How a crate compares with what is computed from it.
#[derive(Clone, Debug, Serialize)]
pub struct Reproduction {
    pub title: String,
    pub made_with: CrateOrigin,
    pub computed_with: CrateOrigin,
    /// The program that made the crate, as seen from this one.
    pub made_by: ProgramAge,
    pub is_same_computer: bool,
    /// Files of the crate that were compared with their hashes.
    pub files: usize,
    /// Files that are not as the crate was made; where there are any, nothing is computed.
    pub faults: Vec<FileFault>,
    pub steps: Vec<StepComparison>,
    /// Changes since the crate was made that may explain the differences; none where nothing differs.
    pub changes: Vec<ChangelogEntry>,
    /// Whether another program packed the zip file, which then has no seal.
    pub is_repacked: bool,
}

impl Reproduction {
    /// Whether all files are as they were made and all numbers the same, to the bit or within the bounds.
    #[must_use]
    pub fn is_equal(&self) -> bool {
        self.faults.is_empty() && self.first_difference().is_none()
    }

    /// The first difference of all steps.
    #[must_use]
    pub fn first_difference(&self) -> Option<(&StepComparison, &ComparedFile)> {
        self.steps.iter().find_map(|step| Some((step, step.first_difference()?)))
    }

    /// Whether every byte has to be the same.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        self.made_by == ProgramAge::Same && self.is_same_computer
    }
}

/// Compares the files of a crate with their hashes, runs every step in a fresh folder and compares the results.
///
/// # Errors
/// It is no crate, or a step cannot be run at all.
pub fn reproduce(
    request: &ReproduceRequest<'_>,
    runner: &dyn StepRunner,
    progress: &dyn Progress,
) -> Result<Reproduction, CrateError> {
    if let Some(to) = request.to.filter(|to| to.exists()) {
        return Err(CrateError::Exists(to.to_owned()));
    }
    let opened = OpenedCrate::open(request.from)?;
    let folder = &opened.folder;
    let mut faults = files::check(folder)?;
    if opened.seal == Some(SealState::Broken) {
        // What the list finds is inside, and says more.
        let file = request.from.display().to_string();
        faults.push(FileFault::Seal { file });
    }
    let named = |name: &str| files::path_of(folder, name);
    let not_ours = |reason: String| CrateError::NotOurs { path: request.from.to_owned(), reason };
    let text = fs::read_to_string(named(METADATA_FILE));
    let made_with =
        text.map_err(|err| err.to_string()).and_then(|text| metadata::read_origin(&text));
    let computed_with = CrateOrigin::here(request.now);
    let mut found = Reproduction {
        title: String::new(),
        made_by: ProgramAge::Same,
        is_same_computer: true,
        files: files::list(folder)?.len(),
        is_repacked: opened.seal == Some(SealState::None),
        steps: Vec::new(),
        changes: Vec::new(),
        // A damaged crate may state nothing any more; its faults say why.
        made_with: match made_with {
            Ok(made_with) => made_with,
            Err(_) if !faults.is_empty() => computed_with.clone(),
            Err(reason) => return Err(not_ours(format!("{METADATA_FILE}: {reason}"))),
        },
        computed_with,
        faults,
    };
    if !found.faults.is_empty() {
        return Ok(found);
    }
    let (study, _) = read_study(&named(STUDY_FILE), runner)?;
    found.title = study.title;
    found.made_by = age_of(&found.made_with, &found.computed_with);
    found.is_same_computer = found.made_with.computer == found.computed_with.computer;
    let fresh = Fresh::new(request.to)?;
    copy_inputs(folder, fresh.path())?;
    let made_at = found.made_with.made_at;
    // Calibrations and protocols are taken out of the sessions again.
    read_sessions(fresh.path())?;
    run_steps(&study.steps, fresh.path(), made_at, (runner, FailedStep::Kept), progress)?;
    let tolerance = match found.is_exact() {
        true => Tolerance::Exact,
        false => Tolerance::Bounded { made_by: &found.made_with.version },
    };
    found.steps = compare_steps(&study.steps, (folder, fresh.path()), tolerance)?;
    if found.first_difference().is_some() && found.made_by != ProgramAge::Same {
        found.changes = explanations(&found);
    }
    Ok(found)
}

fn age_of(made: &CrateOrigin, here: &CrateOrigin) -> ProgramAge {
    if made.is_same_program(here) {
        return ProgramAge::Same;
    }
    match version_numbers(&made.version).cmp(&version_numbers(&here.version)) {
        std::cmp::Ordering::Less => ProgramAge::Older,
        std::cmp::Ordering::Equal => ProgramAge::OtherBuild,
        std::cmp::Ordering::Greater => ProgramAge::Newer,
    }
}

/// Entries of the changelog that name a command whose results differ; all entries where none does.
fn explanations(found: &Reproduction) -> Vec<ChangelogEntry> {
    let differing = found.steps.iter().filter(|step| step.first_difference().is_some());
    let commands: BTreeSet<&str> =
        differing.filter_map(|step| step.line.split(' ').nth(1)).collect();
    let all = changes_since(&found.made_with.version);
    let words = |text: &str| -> BTreeSet<String> {
        let words = text.split(|letter: char| !letter.is_alphanumeric());
        words.map(str::to_lowercase).collect()
    };
    let names = |entry: &&ChangelogEntry| {
        let words = words(&entry.text);
        commands
            .iter()
            .any(|command| words.contains(*command) || words.contains(&format!("{command}s")))
    };
    let named: Vec<ChangelogEntry> = all.iter().filter(names).cloned().collect();
    if named.is_empty() { all } else { named }
}

fn compare_steps(
    steps: &[CrateStep],
    (before, after): (&Path, &Path),
    tolerance: Tolerance<'_>,
) -> Result<Vec<StepComparison>, CrateError> {
    let mut compared = Vec::new();
    for step in steps {
        let listed = |at: &Path| match at.join(step.folder()).is_dir() {
            true => files::list(&at.join(step.folder())),
            false => Ok(Vec::new()),
        };
        let (ours, theirs) = (listed(before)?, listed(after)?);
        let names: BTreeSet<String> = ours.iter().chain(&theirs).cloned().collect();
        let mut of_step = Vec::new();
        for name in names {
            let file = format!("{}/{name}", step.folder());
            let read = |at: &Path| {
                let path = files::path_of(at, &file);
                fs::read(&path).map_err(|err| CrateError::read(&path, err))
            };
            let result = match (ours.contains(&name), theirs.contains(&name)) {
                (true, true) => compare(&read(before)?, &read(after)?, tolerance),
                (true, false) => FileResult::NotComputed,
                _ => FileResult::NotInCrate,
            };
            of_step.push(ComparedFile { file, result });
        }
        compared.push(StepComparison {
            step: step.name.clone(),
            line: step.line(),
            files: of_step,
        });
    }
    Ok(compared)
}

/// Everything but the results and what describes them.
fn copy_inputs(from: &Path, to: &Path) -> Result<(), CrateError> {
    let is_input = |name: &String| {
        !name.starts_with(&format!("{RESULTS}/")) && (name.contains('/') || name == STUDY_FILE)
    };
    for name in files::list(from)?.iter().filter(|name| is_input(name)) {
        files::copy(&files::path_of(from, name), &files::path_of(to, name))?;
    }
    Ok(())
}

/// A crate as a folder.
struct OpenedCrate {
    folder: PathBuf,
    /// Of a zip file.
    seal: Option<SealState>,
    _unpacked: Option<tempfile::TempDir>,
}

impl OpenedCrate {
    fn open(from: &Path) -> Result<Self, CrateError> {
        let about = fs::metadata(from).map_err(|err| CrateError::read(from, err))?;
        if about.is_dir() {
            return Ok(Self { folder: from.to_owned(), seal: None, _unpacked: None });
        }
        let unpacked = temporary()?;
        let seal = archive::unpack(from, unpacked.path())?;
        let folder = unpacked.path().to_owned();
        Ok(Self { folder, seal: Some(seal), _unpacked: Some(unpacked) })
    }
}

fn temporary() -> Result<tempfile::TempDir, CrateError> {
    tempfile::tempdir().map_err(|err| CrateError::write(&std::env::temp_dir(), err))
}

/// The folder in which a crate is computed again.
enum Fresh {
    Kept(PathBuf),
    Temporary(tempfile::TempDir),
}

impl Fresh {
    fn new(to: Option<&Path>) -> Result<Self, CrateError> {
        let Some(to) = to else { return temporary().map(Self::Temporary) };
        fs::create_dir(to).map_err(|err| CrateError::write(to, err))?;
        Ok(Self::Kept(to.to_owned()))
    }

    fn path(&self) -> &Path {
        match self {
            Self::Kept(path) => path,
            Self::Temporary(folder) => folder.path(),
        }
    }
}
