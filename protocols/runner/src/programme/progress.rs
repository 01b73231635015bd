//! How far a programme is, from its journal alone.

use super::conditions::Conditions;
use super::document::Programme;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use thiserror::Error;

/// How a run ended that did all of its plan, as the journal has it.
pub const FINISHED: &str = "finish";

/// How a run ended that the rig or its preview refused: it left no session.
pub const REFUSED: &str = "refused";

/// One line of a programme's journal.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "entry", rename_all = "snake_case")]
pub enum Entry {
    /// The programme began.
    Programme {
        /// Its name.
        name: String,
        /// CRC-32 of its text, eight hexadecimal digits.
        crc32: String,
        /// When, RFC 3339.
        at: String,
        /// Under which conditions; none in a journal of a palpate that did not write them down.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        conditions: Option<Box<Conditions>>,
    },
    /// A run began; without its end it was interrupted.
    Begun {
        /// Which.
        place: Place,
        /// Its session folder, from the journal's.
        session: PathBuf,
        /// When, RFC 3339.
        at: String,
    },
    /// A run ended.
    Ended {
        /// Which.
        place: Place,
        /// How.
        outcome: String,
        /// Why.
        reason: String,
    },
}

/// A place in a programme.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Place {
    /// Index of the task.
    pub task: usize,
    /// Repeat, from 1.
    pub repeat: u32,
    /// Attempt at it, from 1: an interrupted repeat is made again, and both stay.
    pub attempt: u32,
}

/// How far a programme is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Runs that began, with their folder and how they ended, if they did.
    pub runs: Vec<(Place, PathBuf, Option<String>)>,
}

/// A journal that does not belong to the programme.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ProgressError {
    /// Another one.
    #[error("the folder holds the programme '{0}'; choose a new folder")]
    Other(String),
    /// It was changed since.
    #[error(
        "the programme '{0}' was changed since it was begun here; restore it, or begin in a new folder"
    )]
    Changed(String),
    /// Rig, limits, calibration or protocols are others.
    #[error(
        "the programme '{programme}' was begun here under other conditions: {}; go on under those it was begun under, or begin in a new folder",
        .changes.join(", ")
    )]
    Conditions {
        /// Its name.
        programme: String,
        /// What changed, each with what it was.
        changes: Vec<String>,
    },
    /// No sense in it.
    #[error("the journal does not begin with its programme; choose a new folder")]
    Headless,
}

impl Progress {
    /// Reads a journal's entries; `crc32` is that of the programme's text now, `conditions` are those it would go
    /// on under. A journal without conditions is from an older palpate, and nothing is compared.
    pub fn of(
        entries: &[Entry],
        programme: &Programme,
        crc32: &str,
        conditions: &Conditions,
    ) -> Result<Self, ProgressError> {
        let mut progress = Self::default();
        let Some((first, rest)) = entries.split_first() else {
            return Ok(progress);
        };
        match first {
            Entry::Programme { name, .. } if *name != programme.name => {
                return Err(ProgressError::Other(name.clone()));
            }
            Entry::Programme { name, crc32: begun, .. } if begun != crc32 => {
                return Err(ProgressError::Changed(name.clone()));
            }
            Entry::Programme { name, conditions: Some(begun), .. } if **begun != *conditions => {
                return Err(ProgressError::Conditions {
                    programme: name.clone(),
                    changes: begun.changes(conditions),
                });
            }
            Entry::Programme { .. } => {}
            _ => return Err(ProgressError::Headless),
        }
        for entry in rest {
            match entry {
                Entry::Programme { .. } => {}
                Entry::Begun { place, session, .. } => {
                    progress.runs.push((place.clone(), session.clone(), None));
                }
                Entry::Ended { place, outcome, .. } => {
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
    pub fn next(&self, programme: &Programme) -> Option<Place> {
        let places = programme
            .tasks
            .iter()
            .enumerate()
            .flat_map(|(task, one)| (1..=one.repeats).map(move |repeat| (task, repeat)));
        places
            .map(|(task, repeat)| {
                let own = self.attempts(task, repeat);
                (task, repeat, own)
            })
            .find(|(_, _, own)| !own.contains(&Some(FINISHED)))
            .map(|(task, repeat, own)| Place { task, repeat, attempt: 1 + own.len() as u32 })
    }

    /// How the attempts at one repeat ended.
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
