//! A file appears whole under its name or not at all.

use super::ExportError;
use polars::prelude::PolarsError;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes through a temporary neighbour, synchronises it and gives it its name.
pub(super) fn write(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> Result<(), PolarsError>,
) -> Result<(), ExportError> {
    if path.exists() {
        return Err(ExportError::Exists {
            path: path.to_owned(),
        });
    }
    let io_error = |source: io::Error| ExportError::Io {
        path: path.to_owned(),
        source,
    };
    let name = path
        .file_name()
        .ok_or_else(|| io_error(io::Error::from(io::ErrorKind::InvalidInput)))?;
    let hidden = path.with_file_name(format!(".{}.tmp", name.to_string_lossy()));
    let mut file = BufWriter::new(File::create(&hidden).map_err(io_error)?);
    let result = fill(&mut file)
        .map_err(|source| ExportError::Table {
            path: path.to_owned(),
            source,
        })
        .and_then(|()| file.flush().map_err(io_error))
        .and_then(|()| file.get_ref().sync_all().map_err(io_error))
        .and_then(|()| give_name(&hidden, path).map_err(io_error));
    if result.is_err() {
        // Half a table under a hidden name helps nobody; the error already says what happened.
        let _ = fs::remove_file(&hidden);
    }
    result
}

/// Renames, but never onto a file that appeared in the meantime.
fn give_name(hidden: &Path, path: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    use rustix::io::Errno;
    match renameat_with(CWD, hidden, CWD, path, RenameFlags::NOREPLACE) {
        // Some file systems cannot promise this; the check at the start has to do there.
        Err(Errno::INVAL | Errno::NOSYS | Errno::OPNOTSUPP) => fs::rename(hidden, path),
        outcome => Ok(outcome?),
    }
}
