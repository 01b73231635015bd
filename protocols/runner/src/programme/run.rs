//! Carries a programme out on a runner: every run in its own session folder, every step of the way in the journal.

use super::calibration::{CalibrationSessionError, calibration_from_session};
use super::conditions::Conditions;
use super::document::Programme;
use super::progress::{
    FINISHED, ProgrammeEntry, ProgrammePosition, ProgrammeProgress, ProgressError, REFUSED,
};
use crate::{
    AfterStop, PromptResponder, RunRequest, RunView, Runner, RunnerRequest, StartError, wall_now,
};
use palpate_model::assessment::QualityRank;
use palpate_model::calibration::Calibration;
use palpate_model::rig::{Limits, RigDescription};
use palpate_model::units::Seconds;
use palpate_protocols::engine::{EndingKind, PLAN_COMPLETE, RunOutcome};
use palpate_protocols::plans::Plan;
use palpate_protocols::preview::preview;
use palpate_sessions::journal::{Journal, JournalError, format_time};
use palpate_sessions::{HolderLock, LOCK_FILE, LOG_FILE, ReadError, Session};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Duration;
use thiserror::Error;

/// How long the runner may be silent before its thread is checked.
const SILENCE: Duration = Duration::from_millis(500);

pub struct ProgrammeSetup<'a> {
    pub runner: &'a Runner,
    pub woken: &'a Receiver<()>,
    pub rig: &'a RigDescription,
    /// Its interlock thresholds.
    pub limits: Limits,
    /// Volts to newtons until a task measures it.
    pub calibration: Calibration,
    pub folder: &'a Path,
    pub answers: PromptResponder,
    /// What must be acknowledged before a plan is run, such as a daily check that failed; or why that is unknown.
    pub gate: &'a dyn Fn(&Plan) -> Result<Vec<String>, String>,
}

pub enum ProgrammeEvent<'a> {
    Begun {
        place: &'a ProgrammePosition,
        count: (u32, u32),
    },
    /// A run goes on; with the time left for the whole programme.
    Running(&'a RunView, Seconds),
    Finished(&'a ProgrammePosition, &'a Path),
    Calibrated(&'a Calibration),
}

#[derive(Clone, Debug)]
pub struct ProgrammeResult {
    pub progress: ProgrammeProgress,
    pub calibration: Calibration,
    pub was_continued: bool,
}

#[derive(Debug, Error)]
pub enum ProgrammeRunError {
    /// Another program uses the folder, or it is no folder for a programme.
    #[error("{0}")]
    Folder(String),
    #[error(transparent)]
    Progress(#[from] ProgressError),
    #[error(transparent)]
    Journal(#[from] JournalError),
    #[error("task '{task}': {reason}")]
    Refused { task: String, reason: String },
    /// A run ended before its plan did.
    #[error(
        "task '{task}', repeat {repeat}, ended by {ending}: {reason}; run the programme again to continue from there"
    )]
    Ended { task: String, repeat: u32, ending: String, reason: String },
    #[error("task '{task}': {source}")]
    Calibrating { task: String, source: CalibrationSessionError },
    #[error(
        "task '{task}' measured a calibration that is not good enough: {reason}; change its weights and start the programme in a new folder"
    )]
    PoorCalibration { task: String, reason: String },
    #[error(transparent)]
    Session(#[from] ReadError),
    #[error(
        "the thread that controls the rig ended unexpectedly; the session in progress is incomplete"
    )]
    NoRunner,
}

/// Carries a programme out, or goes on where its journal ends.
pub fn run_programme(
    programme: &Programme,
    crc32: &str,
    laboratory: ProgrammeSetup<'_>,
    tell: &mut dyn FnMut(ProgrammeEvent<'_>),
) -> Result<ProgrammeResult, ProgrammeRunError> {
    let lock = laboratory.folder.join(LOCK_FILE);
    let _lock =
        HolderLock::acquire(&lock).map_err(|err| ProgrammeRunError::Folder(err.to_string()))?;
    if laboratory.folder.join(LOG_FILE).exists() {
        let reason = format!(
            "the folder {} already holds a session; choose a new folder",
            laboratory.folder.display()
        );
        return Err(ProgrammeRunError::Folder(reason));
    }
    let (journal, entries) = Journal::open(laboratory.folder)?;
    let conditions =
        Conditions::of(programme, laboratory.rig, &laboratory.limits, &laboratory.calibration);
    let progress = ProgrammeProgress::of(&entries, programme, crc32, &conditions)?;
    let was_continued = !progress.runs.is_empty();
    let mut work = ProgrammeRun {
        programme,
        journal,
        progress,
        is_remounting: was_continued,
        laboratory,
        tell,
    };
    if entries.is_empty() {
        work.journal.push(&ProgrammeEntry::Programme {
            name: programme.name.clone(),
            crc32: crc32.to_owned(),
            at: format_time(wall_now()),
            conditions: Some(Box::new(conditions)),
        })?;
    }
    work.complete_journal()?;
    for task in 0..programme.tasks.len() {
        if let Some(folder) = work.progress.finished(task).last() {
            work.calibrate(task, &work.laboratory.folder.join(folder))?;
        }
    }
    while let Some(place) = work.progress.next(programme) {
        work.run_once(place)?;
    }
    Ok(ProgrammeResult {
        progress: work.progress,
        calibration: work.laboratory.calibration,
        was_continued,
    })
}

struct ProgrammeRun<'a> {
    programme: &'a Programme,
    journal: Journal,
    progress: ProgrammeProgress,
    /// The rig was unattended: the operator must check that the specimen is still the right one.
    is_remounting: bool,
    laboratory: ProgrammeSetup<'a>,
    tell: &'a mut dyn FnMut(ProgrammeEvent<'_>),
}

impl ProgrammeRun<'_> {
    /// Adds the last run's missing line to the journal after a crash between the end of its log and that line: the session
    /// has its ending. A session that cannot be read, or has no end, was interrupted.
    fn complete_journal(&mut self) -> Result<(), ProgrammeRunError> {
        let Some((place, session, None)) = self.progress.runs.last().cloned() else {
            return Ok(());
        };
        let session = Session::open(&self.laboratory.folder.join(session));
        let Some(end) = session.ok().and_then(|session| session.end) else {
            return Ok(());
        };
        self.end(place, final_outcome(&end.outcome, &end.reason), end.reason)
    }

    fn end(
        &mut self,
        place: ProgrammePosition,
        outcome: String,
        reason: String,
    ) -> Result<(), ProgrammeRunError> {
        if let Some(run) = self.progress.runs.last_mut() {
            run.2 = Some(outcome.clone());
        }
        Ok(self.journal.push(&ProgrammeEntry::Ended { place, outcome, reason })?)
    }

    /// One run, from its entry in the journal to the next.
    fn run_once(&mut self, mut place: ProgrammePosition) -> Result<(), ProgrammeRunError> {
        let programme = self.programme;
        let task = &programme.tasks[place.task];
        // A folder that is there without its line in the journal is what a crash left of an attempt.
        while self.laboratory.folder.join(session_folder(&task.name, &place)).exists() {
            place.attempt += 1;
        }
        let refused =
            |reason: String| ProgrammeRunError::Refused { task: task.name.clone(), reason };
        let specimen = programme.specimen_at(place.task);
        let remount = specimen.filter(|_| std::mem::take(&mut self.is_remounting));
        let plan = task.plan(place.repeat, remount).ok_or_else(|| {
            refused(
                "its protocol gives no plan with these values; check the values under 'set'".into(),
            )
        })?;
        let to_acknowledge = (self.laboratory.gate)(&plan).map_err(refused)?;
        let session = session_folder(&task.name, &place);
        let folder = self.laboratory.folder.join(&session);
        let request = RunRequest {
            plan,
            calibration: self.laboratory.calibration.clone(),
            limits: self.laboratory.limits,
            out: Some(folder.clone()),
            labels: programme
                .labels(place.task, place.repeat)
                .map_err(|err| refused(err.to_string()))?,
            is_acknowledged: programme.is_acknowledged,
            to_acknowledge,
            after_stop: match self.laboratory.answers {
                PromptResponder::Operator => AfterStop::Ask,
                PromptResponder::Confirm => AfterStop::Close,
            },
            answers: self.laboratory.answers,
            leader: None,
        };
        let later = self.time_after(&place).map_err(refused)?;
        if let Some(reason) = self.begin(&place, session, request)? {
            return Err(refused(reason));
        }
        let finished = |run: &&(ProgrammePosition, PathBuf, Option<String>)| {
            run.2.as_deref() == Some(FINISHED)
        };
        let done = self.progress.runs.iter().filter(finished).count() as u32;
        (self.tell)(ProgrammeEvent::Begun {
            place: &place,
            count: (done, programme.session_count()),
        });
        let (ending, reason) = self.wait(&folder, later)?;
        self.end(place.clone(), ending.clone(), reason.clone())?;
        if ending != FINISHED {
            let (task, repeat) = (task.name.clone(), place.repeat);
            return Err(ProgrammeRunError::Ended { task, repeat, ending, reason });
        }
        (self.tell)(ProgrammeEvent::Finished(&place, &folder));
        self.calibrate(place.task, &folder)
    }

    /// Begins a run; or why it is refused.
    fn begin(
        &mut self,
        place: &ProgrammePosition,
        session: PathBuf,
        request: RunRequest,
    ) -> Result<Option<String>, ProgrammeRunError> {
        self.journal.push(&ProgrammeEntry::Begun {
            place: place.clone(),
            session: session.clone(),
            at: format_time(wall_now()),
        })?;
        self.progress.runs.push((place.clone(), session, None));
        let (reply, answer) = sync_channel(1);
        let request = RunnerRequest::Run(Box::new(request), reply);
        let sent = self.laboratory.runner.request(request);
        sent.map_err(|_| ProgrammeRunError::NoRunner)?;
        match answer.recv() {
            Ok(Ok(())) => Ok(None),
            Ok(Err(StartError::Refused(reason) | StartError::Failed(reason))) => {
                let (place, outcome) = (place.clone(), REFUSED.into());
                self.journal.push(&ProgrammeEntry::Ended {
                    place,
                    outcome,
                    reason: reason.clone(),
                })?;
                Ok(Some(reason))
            }
            Err(_) => Err(ProgrammeRunError::NoRunner),
        }
    }

    /// Waits until the run in a folder has ended and its log is closed.
    fn wait(
        &mut self,
        folder: &Path,
        later: Seconds,
    ) -> Result<(String, String), ProgrammeRunError> {
        loop {
            let is_woken = self.laboratory.woken.recv_timeout(SILENCE).is_ok();
            let snapshot = self.laboratory.runner.snapshot();
            let own = snapshot.run.as_ref().filter(|run| run.folder == folder);
            if let Some(view) = own {
                let remaining = Seconds(view.time_left.0 + later.0);
                (self.tell)(ProgrammeEvent::Running(view, remaining));
                if let Some(RunOutcome { ending, reason }) = &view.outcome {
                    // What is not on disk did not happen.
                    let broken = view.log_error.as_ref().map(|err| ("abort".into(), err.clone()));
                    return Ok(broken.unwrap_or_else(|| {
                        (final_outcome(ending.name(), reason), reason.clone())
                    }));
                }
            }
            if !is_woken && !self.laboratory.runner.is_alive() {
                return Err(ProgrammeRunError::NoRunner);
            }
        }
    }

    /// The calibration that a finished task measured, if it is one that calibrates.
    fn calibrate(&mut self, task: usize, folder: &Path) -> Result<(), ProgrammeRunError> {
        let task = &self.programme.tasks[task];
        if !task.calibrates {
            return Ok(());
        }
        let session = Session::open(folder)?;
        let calibration = calibration_from_session(&session, &task.name)
            .map_err(|source| ProgrammeRunError::Calibrating { task: task.name.clone(), source })?;
        let assessed = calibration.assess(None).map_err(|err| ProgrammeRunError::Calibrating {
            task: task.name.clone(),
            source: err.into(),
        })?;
        if let Some(check) = assessed.worst().filter(|one| one.rank == QualityRank::Bad) {
            let (task, reason) = (task.name.clone(), check.sentence.clone());
            return Err(ProgrammeRunError::PoorCalibration { task, reason });
        }
        (self.tell)(ProgrammeEvent::Calibrated(&calibration));
        self.laboratory.calibration = calibration;
        Ok(())
    }

    fn time_after(&self, place: &ProgrammePosition) -> Result<Seconds, String> {
        let curve = self.laboratory.calibration.curve();
        let curve = curve.map_err(|err| err.to_string())?;
        let (rig, limits) = (self.laboratory.rig, &self.laboratory.limits);
        let tasks = self.programme.tasks.iter().enumerate().skip(place.task);
        let plans = tasks.flat_map(|(index, task)| {
            let first = if index == place.task { place.repeat + 1 } else { 1 };
            (first..=task.repeats).filter_map(|repeat| task.plan(repeat, None))
        });
        let expected = plans.map(|plan| preview(&plan, rig, limits, &curve, true).expected.0);
        Ok(Seconds(expected.sum()))
    }
}

/// A run that skipped measurements did not finish.
fn final_outcome(outcome: &str, reason: &str) -> String {
    match outcome {
        FINISHED if reason != PLAN_COMPLETE => EndingKind::Stop.name().into(),
        outcome => outcome.into(),
    }
}

/// Where a run's session goes: `TASK/REPEAT`, and `TASK/REPEAT-ATTEMPT` where it is made again.
fn session_folder(task: &str, place: &ProgrammePosition) -> PathBuf {
    let name = match place.attempt {
        1 => format!("{:02}", place.repeat),
        attempt => format!("{:02}-{attempt}", place.repeat),
    };
    Path::new(task).join(name)
}
