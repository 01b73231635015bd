//! What stands beside a log, carried to a recovered copy: edits, analyses and the original of an import.
//!
//! What would mean something else there is left out and told: a corrected contact where decisions are
//! missing, for contacts are counted, and a mask where the first samples are, for its times count from them.

use super::{RecoverError, Salvage};
use crate::analyses::{ANALYSES_FILE, Analysed, Analyses, Analysis};
use crate::chain::{self, ChainError};
use crate::contacts::contacts;
use crate::edits::{Change, EDITS_FILE, Edit, Edits};
use crate::folder::segment_number;
use crate::imported::ORIGINAL_FOLDER;
use serde::Serialize;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// What goes with a recovered session.
#[derive(Debug, Default)]
pub(super) struct Beside {
    edits: Vec<Edit>,
    analyses: Vec<Analysis>,
    /// Folder with the file an import was made from.
    original: Option<PathBuf>,
    /// What does not go with it, one sentence each.
    pub left_out: Vec<String>,
}

impl Beside {
    /// Looks at what is beside the log of a session, given its folder or a file of it, of which this is left.
    pub fn of(path: &Path, left: &Salvage) -> Self {
        let mut beside = Self::default();
        beside.take_edits(path, left);
        beside.take_analyses(path, left);
        let original = folder_of(path).map(|folder| folder.join(ORIGINAL_FOLDER));
        beside.original = original.filter(|folder| folder.is_dir());
        beside
    }

    fn take_edits(&mut self, path: &Path, left: &Salvage) {
        let edits = match Edits::read(path, &left.manifest.session_id) {
            Ok(edits) => edits,
            Err(err) => {
                self.left_out.push(format!("no verdict, tag or other edit is taken over: {err}"));
                return;
            }
        };
        if edits.is_torn {
            let torn = "the last edit was begun and never finished; it is not taken over";
            self.left_out.push(torn.into());
        }
        let found = contacts(&left.entries).len();
        for edit in edits.all {
            let lost = match &edit.change {
                Change::Contact { number, .. }
                    if !left.has_every_decision || *number as usize > found =>
                {
                    Some((*number, edit.by.clone()))
                }
                _ => None,
            };
            match lost {
                None => self.edits.push(edit),
                Some((number, by)) => self.left_out.push(format!(
                    "the correction of contact {number} by {by} is not taken over, because contacts are counted and decisions are missing; depths count from the contacts that were found"
                )),
            }
        }
    }

    fn take_analyses(&mut self, path: &Path, left: &Salvage) {
        let analyses = match Analyses::read(path, &left.manifest.session_id) {
            Ok(analyses) => analyses,
            Err(err) => {
                self.left_out.push(format!("no analysis is taken over: {err}"));
                return;
            }
        };
        let has_first_sample = left.missing.gaps.iter().all(|gap| gap.after_sample > 0);
        for one in &analyses.all {
            let reason = match one.what {
                Analysed::Mask { .. } if !has_first_sample => {
                    "its times count from the first sample, which is missing"
                }
                Analysed::Recalibration { .. } if !left.has_every_decision => {
                    "tares are decisions, and decisions are missing"
                }
                Analysed::Fit { .. } => "it is a fit of other samples; fit this session again",
                // Of what is left out there is nothing to withdraw.
                Analysed::Withdrawal if self.analyses.iter().all(|it| it.name != one.name) => {
                    continue;
                }
                _ => {
                    self.analyses.push(one.clone());
                    continue;
                }
            };
            if analyses.withdrawal(&one.name).is_none() {
                let (word, name) = (one.what.word(), &one.name);
                self.left_out.push(format!("{word} '{name}' is not taken over: {reason}"));
            }
        }
    }

    /// Writes it into the folder of the copy, each line as it was but of the new session.
    pub fn write(&self, folder: &Path, session_id: &str) -> Result<(), RecoverError> {
        write_lines(&folder.join(EDITS_FILE), session_id, &self.edits)?;
        write_lines(&folder.join(ANALYSES_FILE), session_id, &self.analyses)?;
        let Some(original) = &self.original else {
            return Ok(());
        };
        let copied = copy_files(original, &folder.join(ORIGINAL_FOLDER));
        copied.map_err(|source| RecoverError::Original { path: original.clone(), source })
    }
}

/// The folder of a session, given it or a segment in it. A log file of another name stands alone.
fn folder_of(path: &Path) -> Option<&Path> {
    if path.is_dir() {
        return Some(path);
    }
    segment_number(path.file_name()?.to_str()?)?;
    path.parent()
}

fn write_lines<T: Serialize>(path: &Path, name: &str, lines: &[T]) -> Result<(), ChainError> {
    let mut lines = lines.iter();
    lines.try_for_each(|line| chain::append(path, name, line))
}

/// Copies the files of a folder; on disk when this returns.
fn copy_files(from: &Path, to: &Path) -> io::Result<()> {
    fs::create_dir(to)?;
    for item in fs::read_dir(from)? {
        let item = item?;
        if item.file_type()?.is_file() {
            let copy = to.join(item.file_name());
            fs::copy(item.path(), &copy)?;
            File::open(&copy)?.sync_all()?;
        }
    }
    File::open(to)?.sync_all()
}
