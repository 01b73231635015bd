//! Atomic writing of exports.

use super::ExportError;
use palpate_sessions::atomic::{Draft, ExistingFile};
use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;

/// Result of writing a file that may exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WriteOutcome {
    Written,
    /// The file existed with the same content.
    Unchanged,
}

pub(crate) fn io_error(path: &Path) -> impl Fn(io::Error) -> ExportError {
    move |source| ExportError::Io { path: path.to_owned(), source }
}

pub(super) fn check_new(path: &Path) -> Result<(), ExportError> {
    match path.exists() {
        true => Err(ExportError::Exists { path: path.into() }),
        false => Ok(()),
    }
}

pub(super) fn write<T>(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> Result<T, ExportError>,
) -> Result<T, ExportError> {
    check_new(path)?;
    let (draft, value) = fill_draft(path, fill)?;
    match draft.persist(ExistingFile::Keep) {
        Err(err) if err.kind() == io::ErrorKind::AlreadyExists => {
            Err(ExportError::Exists { path: path.into() })
        }
        outcome => outcome.map(|()| value).map_err(io_error(path)),
    }
}

/// Like [`write`], but accepts an existing file with exactly the same content.
pub(crate) fn write_or_same(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> Result<(), ExportError>,
) -> Result<WriteOutcome, ExportError> {
    let (draft, ()) = fill_draft(path, fill)?;
    let mut written = draft.reader().map_err(io_error(path))?;
    match draft.persist(ExistingFile::Keep) {
        Err(err) if err.kind() == io::ErrorKind::AlreadyExists => {}
        outcome => return outcome.map(|()| WriteOutcome::Written).map_err(io_error(path)),
    }
    written.rewind().map_err(io_error(path))?;
    match same_content(&written, &File::open(path).map_err(io_error(path))?)
        .map_err(io_error(path))?
    {
        true => Ok(WriteOutcome::Unchanged),
        false => Err(ExportError::Different { path: path.into() }),
    }
}

fn fill_draft<T>(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> Result<T, ExportError>,
) -> Result<(Draft, T), ExportError> {
    let draft = Draft::new(path).map_err(io_error(path))?;
    let mut out = draft.writer();
    let value = fill(&mut out)?;
    out.flush().map_err(io_error(path))?;
    drop(out);
    Ok((draft, value))
}

fn same_content(one: &File, other: &File) -> io::Result<bool> {
    use std::io::{BufRead, BufReader};
    if one.metadata()?.len() != other.metadata()?.len() {
        return Ok(false);
    }
    let mut one = BufReader::with_capacity(1 << 16, one);
    let mut other = BufReader::with_capacity(1 << 16, other);
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
