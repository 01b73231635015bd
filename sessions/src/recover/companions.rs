//! The files beside a log: edits, analyses and the original of an import. They are verified, and copied with a recovery.
//!
//! An edit or analysis whose meaning would change is left out and reported: a corrected contact if decisions are missing,
//! because contacts are counted, and a mask if the first samples are missing, because its times count from them.

use super::{RecoverError, Salvage};
use crate::analyses::{ANALYSES_FILE, Analyses, Analysis, AnalysisContent};
use crate::chain::{self, ChainError};
use crate::contacts::contacts;
use crate::edits::{EDITS_FILE, Edit, EditChange, Edits};
use crate::folder::{file_beside, sync_folder};
use crate::import_origin::{ImportOrigin, ORIGINAL_FOLDER};
use crate::manifest::Manifest;
use crate::text::crc32_of_file;
use serde::Serialize;
use std::fs::{self, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

/// What a recovered copy takes over.
#[derive(Debug, Default)]
pub(super) struct CompanionFiles {
    edits: Vec<Edit>,
    analyses: Vec<Analysis>,
    /// Folder with the original of an import.
    original: Option<PathBuf>,
    /// What it does not take over, one sentence each.
    pub left_out: Vec<String>,
}

impl CompanionFiles {
    /// `path` is the session's folder or a file of it.
    pub fn read(path: &Path, salvage: &Salvage) -> Self {
        let mut companions = Self::default();
        companions.take_edits(path, salvage);
        companions.take_analyses(path, salvage);
        companions.original = file_beside(path, ORIGINAL_FOLDER).filter(|folder| folder.is_dir());
        companions
    }

    fn take_edits(&mut self, path: &Path, salvage: &Salvage) {
        let edits = match Edits::read(path, &salvage.manifest.session_id) {
            Ok(edits) => edits,
            Err(err) => {
                self.left_out.push(format!("no edit is copied: {err}"));
                return;
            }
        };
        if edits.is_torn {
            let torn = "the last edit is incomplete and is not copied";
            self.left_out.push(torn.into());
        }
        let found = contacts(&salvage.entries).len();
        for edit in edits.all {
            match &edit.change {
                EditChange::Contact { number, .. }
                    if !salvage.has_every_decision || *number as usize > found =>
                {
                    self.left_out.push(format!(
                        "the correction of contact {number}, made by {}, is not copied, because missing decisions may change the numbers of the contacts; depths are measured from the recorded contact points",
                        edit.by
                    ));
                }
                _ => self.edits.push(edit),
            }
        }
    }

    fn take_analyses(&mut self, path: &Path, salvage: &Salvage) {
        let analyses = match Analyses::read(path, &salvage.manifest.session_id) {
            Ok(analyses) => analyses,
            Err(err) => {
                self.left_out.push(format!("no analysis is copied: {err}"));
                return;
            }
        };
        let has_first_sample = salvage.missing.gaps.iter().all(|gap| gap.after_sample > 0);
        for one in &analyses.all {
            let reason = match one.what {
                AnalysisContent::Mask { .. } if !has_first_sample => {
                    "its times count from the first sample, which is missing"
                }
                AnalysisContent::Recalibration { .. } if !salvage.has_every_decision => {
                    "tares that it needs may be among the missing decisions"
                }
                AnalysisContent::Fit { .. } | AnalysisContent::Material { .. } => {
                    "it was made from the samples of the original session; fit the recovered session again"
                }
                // The withdrawn analysis is not in the copy.
                AnalysisContent::Withdrawal
                    if self.analyses.iter().all(|it| it.name != one.name) =>
                {
                    continue;
                }
                _ => {
                    self.analyses.push(one.clone());
                    continue;
                }
            };
            if analyses.withdrawal(&one.name).is_none() {
                let (word, name) = (one.what.word(), &one.name);
                self.left_out.push(format!("{word} '{name}' is not copied: {reason}"));
            }
        }
    }

    /// Writes into the copy's folder; the checksums of the lines belong to the new session.
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

fn write_lines<T: Serialize>(path: &Path, name: &str, lines: &[T]) -> Result<(), ChainError> {
    let mut lines = lines.iter();
    lines.try_for_each(|line| chain::append(path, name, line))
}

/// Copies the files of a folder and synchronises them with the disk.
fn copy_files(from: &Path, to: &Path) -> io::Result<()> {
    fs::create_dir(to)?;
    for item in fs::read_dir(from)? {
        let item = item?;
        if item.file_type()?.is_file() {
            let copy = to.join(item.file_name());
            fs::copy(item.path(), &copy)?;
            // Windows synchronises only what may be written.
            OpenOptions::new().append(true).open(&copy)?.sync_all()?;
        }
    }
    sync_folder(to)
}

/// One sentence for each damaged file.
pub(super) fn find_damaged(path: &Path, manifest: &Manifest) -> Vec<String> {
    let id = &manifest.session_id;
    let edits = Edits::read(path, id).err().map(|err| err.to_string());
    let analyses = Analyses::read(path, id).err().map(|err| err.to_string());
    // A file stands for its folder.
    let folder = if path.is_file() { path.parent().unwrap_or(path) } else { path };
    let original = manifest.imported.as_ref().and_then(|from| check_original(folder, from));
    [edits, analyses, original].into_iter().flatten().collect()
}

/// Reads the original only if it is a file of the recorded size below the folder, so that a damaged name, a device or a link
/// causes no harm.
fn check_original(folder: &Path, from: &ImportOrigin) -> Option<String> {
    const REMEDY: &str =
        "put back the imported file, or continue without it: the samples are in the log";
    let name = Path::new(&from.file);
    if name.file_name() != Some(name.as_os_str()) {
        return Some(format!("the imported file has the invalid name {:?}; {REMEDY}", from.file));
    }
    let path = folder.join(ORIGINAL_FOLDER).join(name);
    let shown = path.display();
    let is_there = std::fs::symlink_metadata(&path)
        .is_ok_and(|found| found.is_file() && found.len() == from.bytes);
    if !is_there {
        return Some(format!(
            "the imported file {shown} of {} bytes is missing; {REMEDY}",
            from.bytes
        ));
    }
    match crc32_of_file(&path) {
        Err(err) => Some(format!("the imported file {shown} cannot be read ({err}); {REMEDY}")),
        Ok(sum) if format!("{sum:08x}") != from.checksum => {
            Some(format!("the imported file {shown} was changed; {REMEDY}"))
        }
        Ok(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn name_of_the_original_never_leads_out_of_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        let original = folder.path().join(ORIGINAL_FOLDER);
        std::fs::create_dir(&original).unwrap();
        std::fs::write(original.join("table.csv"), b"t_s").unwrap();
        // Outside the folder, with the right size and checksum.
        std::fs::write(folder.path().join("secret"), b"t_s").unwrap();
        let of = |file: &str| ImportOrigin {
            file: file.into(),
            bytes: 3,
            checksum: format!("{:08x}", crc32fast::hash(b"t_s")),
            format: String::new(),
            part: String::new(),
            first_time_s: 0.0,
            readings: Vec::new(),
            facts: Vec::new(),
            remarks: Vec::new(),
        };
        assert_eq!(check_original(folder.path(), &of("table.csv")), None);
        let outside = folder.path().join("secret");
        for file in ["../secret", outside.to_str().unwrap(), "", "..", "gone.csv"] {
            assert!(check_original(folder.path(), &of(file)).is_some(), "{file}");
        }
        std::os::unix::fs::symlink("/dev/zero", original.join("endless")).unwrap();
        assert!(check_original(folder.path(), &of("endless")).is_some());
        std::fs::write(original.join("table.csv"), b"t_m").unwrap();
        assert!(check_original(folder.path(), &of("table.csv")).is_some());
    }
}
