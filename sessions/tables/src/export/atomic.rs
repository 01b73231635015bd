//! Exports as files that appear whole under their names or not at all.

use super::ExportError;
use palpate_sessions::atomic::{Draft, Existing};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// What became of a file that may be there already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// It is new.
    Written,
    /// It was there with the same content.
    Same,
}

pub(crate) fn io_error(path: &Path) -> impl Fn(io::Error) -> ExportError {
    move |source| ExportError::Io { path: path.to_owned(), source }
}

/// Refuses a file that is there.
pub(super) fn check_new(path: &Path) -> Result<(), ExportError> {
    match path.exists() {
        true => Err(ExportError::Exists { path: path.into() }),
        false => Ok(()),
    }
}

/// Writes a new file.
pub(super) fn write<T>(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> Result<T, ExportError>,
) -> Result<T, ExportError> {
    check_new(path)?;
    let (draft, told) = filled(path, fill)?;
    match draft.persist(Existing::Keep) {
        Err(err) if err.kind() == io::ErrorKind::AlreadyExists => {
            Err(ExportError::Exists { path: path.into() })
        }
        done => done.map(|()| told).map_err(io_error(path)),
    }
}

/// As [`write`], but a file that is there may stay if its content is the same to the byte.
pub(crate) fn write_or_same(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> Result<(), ExportError>,
) -> Result<Kept, ExportError> {
    let (draft, ()) = filled(path, fill)?;
    let written = File::open(draft.hidden_path()).map_err(io_error(path))?;
    match draft.persist(Existing::Keep) {
        Err(err) if err.kind() == io::ErrorKind::AlreadyExists => {}
        done => return done.map(|()| Kept::Written).map_err(io_error(path)),
    }
    match same_content(&written, &File::open(path).map_err(io_error(path))?)
        .map_err(io_error(path))?
    {
        true => Ok(Kept::Same),
        false => Err(ExportError::Different { path: path.into() }),
    }
}

fn filled<T>(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> Result<T, ExportError>,
) -> Result<(Draft, T), ExportError> {
    let draft = Draft::new(path).map_err(io_error(path))?;
    let mut out = draft.writer();
    let told = fill(&mut out)?;
    out.flush().map_err(io_error(path))?;
    drop(out);
    Ok((draft, told))
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
