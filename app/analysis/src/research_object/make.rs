//! Makes a crate: copies the sessions, runs the steps, describes what is there.

use super::archive;
use super::completeness::{self, Finding};
use super::contents::{CrateSession, copy_compliances, copy_files, copy_sessions, read_sessions};
use super::error::CrateError;
use super::files::{self, SUMS_FILE, Sums};
use super::metadata::{
    self, CrateDescription, CrateOrigin, FileDescriptions, METADATA_FILE, PAGE_FILE,
};
use super::page;
use super::run_steps::{FailedStep, StepsRun, run_steps};
use super::steps::{CrateStep, RESULTS, StepRunner};
use super::study_file::{CrateStudy, STUDY_FILE};
use crate::progress::Progress;
use crate::report::text::counted;
use chrono::{DateTime, Utc};
use palpate_protocols::file::ProtocolProblem;
use palpate_sessions::text::sha256;
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};

/// What goes into a crate, and where it is made.
#[derive(Clone, Copy, Debug)]
pub struct CrateRequest<'a> {
    /// A new folder, or a new file whose name ends in `.zip`.
    pub to: &'a Path,
    /// Sessions, and folders of sessions.
    pub sessions: &'a [PathBuf],
    /// The study file; `None` makes a page of all sessions and a fit of each.
    pub study: Option<&'a Path>,
    /// Where machine compliances are looked up.
    pub library: Option<&'a Path>,
    /// When the crate is made.
    pub made_at: DateTime<Utc>,
}

/// A crate that was made.
#[derive(Clone, Debug, Serialize)]
pub struct MadeCrate {
    #[serde(rename = "crate")]
    pub path: PathBuf,
    pub title: String,
    /// Names of its sessions.
    pub sessions: Vec<String>,
    /// Names of its steps.
    pub steps: Vec<String>,
    pub files: usize,
    /// Of all files, before they are packed.
    pub bytes: u64,
    /// What a reader will miss.
    pub findings: Vec<Finding>,
    /// Steps that were chosen by the program and could not be run, with the reason.
    pub left_out: Vec<String>,
    pub computer: super::computer::ComputerClass,
}

/// Makes a crate.
///
/// # Errors
/// The study file is wrong, a session cannot be read, a step of the study file fails, or a file cannot be written. What was
/// begun is deleted.
pub fn make_crate(
    request: &CrateRequest<'_>,
    runner: &dyn StepRunner,
    progress: &dyn Progress,
) -> Result<MadeCrate, CrateError> {
    if request.to.exists() {
        return Err(CrateError::Exists(request.to.to_owned()));
    }
    let study = request.study.map(|path| read_study(path, runner)).transpose()?;
    // Beside the crate, so that a large one is moved by its name alone.
    let beside = request.to.parent().filter(|folder| !folder.as_os_str().is_empty());
    let beside = beside.unwrap_or(Path::new("."));
    let draft = tempfile::Builder::new().prefix(".crate-").tempdir_in(beside);
    let draft = draft.map_err(|err| CrateError::write(beside, err))?;
    let folder = draft.path().join("crate");
    let made = fill(request, &folder, (study, runner), progress)?;
    match request.to.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("zip")) {
        true => archive::pack(&folder, request.to)?,
        false => {
            fs::rename(&folder, request.to).map_err(|err| CrateError::write(request.to, err))?
        }
    }
    Ok(made)
}

fn fill(
    request: &CrateRequest<'_>,
    folder: &Path,
    (study, runner): (Option<(CrateStudy, String)>, &dyn StepRunner),
    progress: &dyn Progress,
) -> Result<MadeCrate, CrateError> {
    copy_sessions(request.sessions, folder)?;
    let sessions = read_sessions(folder)?;
    copy_compliances(request.library, &sessions, folder)?;
    let (study, text, failed) = match study {
        Some((study, text)) => (study, Some(text), FailedStep::Refused),
        None => (default_study(&sessions), None, FailedStep::LeftOut),
    };
    copy_files(&study.files, request.study, folder)?;
    let before = files::hash(folder)?;
    let origin = CrateOrigin::here(request.made_at);
    let run = run_steps(&study.steps, folder, origin.made_at, (runner, failed), progress)?;
    let StepsRun { records, left_out } = run;
    let study = CrateStudy { steps: records.iter().map(|one| one.step.clone()).collect(), ..study };
    let text = text.unwrap_or_else(|| study.text());
    files::write(&folder.join(STUDY_FILE), text.as_bytes())?;
    let mut described = describe_files(folder)?;
    check_unchanged(&described, &before)?;
    let findings = completeness::check(&study, &sessions);
    let none = FileDescriptions::new();
    let about = CrateDescription {
        study: &study,
        sessions: &sessions,
        steps: &records,
        findings: &findings,
        origin: &origin,
        files: &none,
    };
    // The page lists the files before it, and the metadata those and the page.
    let page = page::page(&CrateDescription { files: &described, ..about });
    add_file(folder, PAGE_FILE, &page, &mut described)?;
    let metadata = metadata::text(&CrateDescription { files: &described, ..about });
    add_file(folder, METADATA_FILE, &metadata, &mut described)?;
    let sums = described.iter().map(|(name, (_, sum))| (name.clone(), sum.clone())).collect();
    files::write(&folder.join(SUMS_FILE), files::sums_text(&sums).as_bytes())?;
    Ok(MadeCrate {
        path: request.to.to_owned(),
        title: study.title.clone(),
        sessions: sessions.iter().map(|one| one.name.clone()).collect(),
        steps: study.steps.iter().map(|one| one.name.clone()).collect(),
        files: described.len() + 1,
        bytes: described.values().map(|(bytes, _)| bytes).sum(),
        findings,
        left_out,
        computer: origin.computer,
    })
}

/// Reads the file, with its text.
pub(super) fn read_study(
    path: &Path,
    runner: &dyn StepRunner,
) -> Result<(CrateStudy, String), CrateError> {
    let text = fs::read_to_string(path).map_err(|err| CrateError::read(path, err))?;
    let wrong =
        |problems: Vec<ProtocolProblem>| CrateError::Study { path: path.to_owned(), problems };
    let study = CrateStudy::parse(&text, &|words| runner.check(words)).map_err(wrong)?;
    Ok((study, text))
}

/// A page on all sessions, and a fit of each session that counts.
fn default_study(sessions: &[CrateSession]) -> CrateStudy {
    let words = |line: &[&str]| line.iter().map(|word| (*word).to_owned()).collect::<Vec<String>>();
    let folders: Vec<String> = sessions.iter().map(CrateSession::folder).collect();
    let mut report = words(&["report"]);
    report.extend(folders.iter().cloned());
    report.extend(words(&["--html", &format!("{RESULTS}/report/report.html")]));
    let mut steps = vec![CrateStep { name: "report".to_owned(), words: report }];
    let counted_sessions = sessions.iter().filter(|one| one.rejection().is_none());
    steps.extend(counted_sessions.enumerate().map(|(index, one)| {
        let name = format!("fit-{}", index + 1);
        let picture = format!("{RESULTS}/{name}/fit.svg");
        CrateStep { words: words(&["fit", &one.folder(), "--json", "--picture", &picture]), name }
    }));
    let title = match sessions {
        [one] => format!("Session {}", one.name),
        several => counted(several.len(), "session"),
    };
    CrateStudy { title, steps, ..CrateStudy::default() }
}

/// Steps only read what was there before them.
fn check_unchanged(now: &FileDescriptions, before: &Sums) -> Result<(), CrateError> {
    let is_changed =
        |(name, sum): &(&String, &String)| now.get(*name).is_none_or(|(_, after)| after != *sum);
    match before.iter().find(is_changed) {
        Some((name, _)) => Err(CrateError::Changed { file: name.clone() }),
        None => Ok(()),
    }
}

fn describe_files(folder: &Path) -> Result<FileDescriptions, CrateError> {
    let sums = files::hash(folder)?.into_iter();
    let sized = sums.map(|(name, sum)| {
        let path = files::path_of(folder, &name);
        let about = fs::metadata(&path).map_err(|err| CrateError::read(&path, err))?;
        Ok((name, (about.len(), sum)))
    });
    sized.collect()
}

/// Writes a file of the crate, and adds it to the others.
fn add_file(
    folder: &Path,
    name: &str,
    text: &str,
    described: &mut FileDescriptions,
) -> Result<(), CrateError> {
    files::write(&folder.join(name), text.as_bytes())?;
    described.insert(name.to_owned(), (text.len() as u64, sha256(text.as_bytes())));
    Ok(())
}
