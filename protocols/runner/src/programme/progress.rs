//! How far a programme is, from its journal alone.

use super::conditions::Conditions;
use super::document::Programme;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use thiserror::Error;

/// Form of a complete run in the journal.
pub const FINISHED: &str = "finish";

/// Form of a run that the rig or its preview refused: it has no session.
pub const REFUSED: &str = "refused";

/// One line of a programme's journal.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "entry", rename_all = "snake_case")]
pub enum ProgrammeEntry {
    Programme {
        name: String,
        /// CRC-32 of its text, eight hexadecimal digits.
        crc32: String,
        /// When, RFC 3339.
        at: String,
        /// None in a journal of an older palpate.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        conditions: Option<Box<Conditions>>,
    },
    /// A run began; without its end it was interrupted.
    Begun {
        place: ProgrammePosition,
        /// Its session folder, from the journal's.
        session: PathBuf,
        /// When, RFC 3339.
        at: String,
    },
    Ended {
        place: ProgrammePosition,
        outcome: String,
        reason: String,
    },
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ProgrammePosition {
    pub task: usize,
    /// Repeat, from 1.
    pub repeat: u32,
    /// From 1: an interrupted repeat is run again, and both sessions stay.
    pub attempt: u32,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ProgrammeProgress {
    /// Runs that began, with their folder and how they ended, if they did.
    pub runs: Vec<(ProgrammePosition, PathBuf, Option<String>)>,
}

/// A journal that does not belong to the programme.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ProgressError {
    #[error("the folder already holds another programme, '{0}'; choose a new folder")]
    Other(String),
    #[error(
        "the programme '{0}' was changed after it was begun in this folder; restore its file, or begin in a new folder"
    )]
    Changed(String),
    /// Rig, limits, calibration or protocols are others.
    #[error(
        "the programme '{programme}' was begun in this folder under other conditions: {}; restore the earlier conditions, or begin in a new folder",
        .changes.join(", ")
    )]
    Conditions { programme: String, changes: Vec<String> },
    #[error("the journal in the folder does not begin with a programme; choose a new folder")]
    Headless,
}

impl ProgrammeProgress {
    /// Reads a journal's entries; `crc32` is that of the programme's text now, `conditions` are those it would go
    /// on under. A journal without conditions is from an older palpate, and nothing is compared.
    pub fn of(
        entries: &[ProgrammeEntry],
        programme: &Programme,
        crc32: &str,
        conditions: &Conditions,
    ) -> Result<Self, ProgressError> {
        let mut progress = Self::default();
        let Some((first, rest)) = entries.split_first() else {
            return Ok(progress);
        };
        match first {
            ProgrammeEntry::Programme { name, .. } if *name != programme.name => {
                return Err(ProgressError::Other(name.clone()));
            }
            ProgrammeEntry::Programme { name, crc32: begun, .. } if begun != crc32 => {
                return Err(ProgressError::Changed(name.clone()));
            }
            ProgrammeEntry::Programme { name, conditions: Some(begun), .. }
                if **begun != *conditions =>
            {
                return Err(ProgressError::Conditions {
                    programme: name.clone(),
                    changes: begun.changes(conditions),
                });
            }
            ProgrammeEntry::Programme { .. } => {}
            _ => return Err(ProgressError::Headless),
        }
        for entry in rest {
            match entry {
                ProgrammeEntry::Programme { .. } => {}
                ProgrammeEntry::Begun { place, session, .. } => {
                    progress.runs.push((place.clone(), session.clone(), None));
                }
                ProgrammeEntry::Ended { place, outcome, .. } => {
                    let own = progress.runs.iter_mut().rev().find(|run| run.0 == *place);
                    if let Some(run) = own {
                        run.2 = Some(outcome.clone());
                    }
                }
            }
        }
        Ok(progress)
    }

    /// The next run: the first repeat that has not finished. None once all have.
    pub fn next(&self, programme: &Programme) -> Option<ProgrammePosition> {
        let tasks = programme.tasks.iter().enumerate();
        let mut repeats =
            tasks.flat_map(|(task, one)| (1..=one.repeats).map(move |repeat| (task, repeat)));
        repeats.find_map(|(task, repeat)| {
            let endings = self.attempts(task, repeat);
            let is_done = endings.contains(&Some(FINISHED));
            (!is_done).then_some(ProgrammePosition {
                task,
                repeat,
                attempt: 1 + endings.len() as u32,
            })
        })
    }

    fn attempts(&self, task: usize, repeat: u32) -> Vec<Option<&str>> {
        let own =
            self.runs.iter().filter(|(place, ..)| (place.task, place.repeat) == (task, repeat));
        own.map(|(_, _, ending)| ending.as_deref()).collect()
    }

    /// Folders of the sessions of a task that finished, in order.
    pub fn finished(&self, task: usize) -> Vec<&PathBuf> {
        let own = self
            .runs
            .iter()
            .filter(|(place, _, ending)| place.task == task && ending.as_deref() == Some(FINISHED));
        own.map(|(_, folder, _)| folder).collect()
    }
}
