//! A file appears whole under its name or not at all.

use super::ExportError;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// What became of a file that may be there already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// It is new.
    Written,
    /// It was there with the same content.
    Same,
}

pub(crate) fn io_error(path: &Path) -> impl Fn(io::Error) -> ExportError {
    move |source| ExportError::Io {
        path: path.to_owned(),
        source,
    }
}

/// Refuses a file that is there.
pub(super) fn check_new(path: &Path) -> Result<(), ExportError> {
    match path.exists() {
        true => Err(ExportError::Exists { path: path.into() }),
        false => Ok(()),
    }
}

/// Writes through a temporary neighbour, synchronises it and gives it its name.
pub(super) fn write<T>(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> Result<T, ExportError>,
) -> Result<T, ExportError> {
    check_new(path)?;
    let hidden = Hidden::create(path)?;
    let told = hidden.fill(path, fill)?;
    hidden.give_name(path)?;
    Ok(told)
}

/// As [`write`], but a file that is there may stay if its content is the same to the byte.
pub(crate) fn write_or_same(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> Result<(), ExportError>,
) -> Result<Kept, ExportError> {
    let hidden = Hidden::create(path)?;
    hidden.fill(path, fill)?;
    if path.exists() {
        let is_same = same_content(&hidden.path, path).map_err(io_error(path))?;
        return match is_same {
            true => Ok(Kept::Same),
            false => Err(ExportError::Different { path: path.into() }),
        };
    }
    hidden.give_name(path)?;
    Ok(Kept::Written)
}

/// The temporary neighbour. It is removed when this goes, unless it got its name. What a killed process
/// left of it is written over by the next.
struct Hidden {
    path: PathBuf,
    /// Locked, so that two processes never write the same.
    file: File,
}

impl Hidden {
    fn create(path: &Path) -> Result<Self, ExportError> {
        let failed = io_error(path);
        let name = path
            .file_name()
            .ok_or_else(|| failed(io::ErrorKind::InvalidInput.into()))?;
        let hidden = path.with_file_name(format!(".{}.tmp", name.to_string_lossy()));
        loop {
            let file = OpenOptions::new()
                .create(true)
                .write(true)
                .truncate(false)
                .open(&hidden)
                .map_err(&failed)?;
            file.lock().map_err(&failed)?;
            // While we waited the one before us may have given the file its name or removed it.
            let ours = file.metadata().map_err(&failed)?.ino();
            if fs::metadata(&hidden).is_ok_and(|there| there.ino() == ours) {
                file.set_len(0).map_err(&failed)?;
                return Ok(Self { path: hidden, file });
            }
        }
    }

    fn fill<T>(
        &self,
        path: &Path,
        fill: impl FnOnce(&mut BufWriter<File>) -> Result<T, ExportError>,
    ) -> Result<T, ExportError> {
        let failed = io_error(path);
        let mut out = BufWriter::new(self.file.try_clone().map_err(&failed)?);
        let told = fill(&mut out)?;
        out.flush().map_err(&failed)?;
        self.file.sync_all().map_err(&failed)?;
        Ok(told)
    }

    /// Renames, but never onto a file that appeared in the meantime.
    fn give_name(&self, path: &Path) -> Result<(), ExportError> {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        use rustix::io::Errno;
        match renameat_with(CWD, &self.path, CWD, path, RenameFlags::NOREPLACE) {
            // Some file systems cannot promise this; the check before has to do there.
            Err(Errno::INVAL | Errno::NOSYS | Errno::OPNOTSUPP) => fs::rename(&self.path, path),
            outcome => outcome.map_err(io::Error::from),
        }
        .map_err(io_error(path))?;
        // The name itself is safe once its folder is; one that cannot be opened for that is no loss.
        if let Some(Ok(folder)) = path.parent().map(File::open) {
            folder.sync_all().map_err(io_error(path))?;
        }
        Ok(())
    }
}

impl Drop for Hidden {
    fn drop(&mut self) {
        // Half a table under a hidden name helps nobody. One that got its name is not there any more, and
        // the next process waits for our lock, so this is not its file.
        let ours = self.file.metadata().map(|ours| ours.ino()).ok();
        let there = fs::metadata(&self.path).map(|there| there.ino()).ok();
        if ours.is_some() && ours == there {
            let _ = fs::remove_file(&self.path);
        }
    }
}

fn same_content(one: &Path, other: &Path) -> io::Result<bool> {
    use std::io::{BufRead, BufReader};
    if fs::metadata(one)?.len() != fs::metadata(other)?.len() {
        return Ok(false);
    }
    let mut one = BufReader::with_capacity(1 << 16, File::open(one)?);
    let mut other = BufReader::with_capacity(1 << 16, File::open(other)?);
    loop {
        let (left, right) = (one.fill_buf()?, other.fill_buf()?);
        let count = left.len().min(right.len());
        if left[..count] != right[..count] {
            return Ok(false);
        }
        if count == 0 {
            return Ok(left.len() == right.len());
        }
        one.consume(count);
        other.consume(count);
    }
}
