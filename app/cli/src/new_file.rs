//! Files that a command writes: never over another file, and checked before hours of work.

use super::Failure;
use palpate_sessions::atomic;
use std::path::Path;

/// Refuses a file that exists, or whose folder does not. `what` names it in the message.
pub(super) fn check(what: &str, to: Option<&Path>) -> Result<(), Failure> {
    let Some(to) = to else {
        return Ok(());
    };
    if to.exists() {
        return Err(Failure::usage(format!(
            "{} exists already; give the {what} another name",
            to.display()
        )));
    }
    let folder = to.parent().filter(|folder| !folder.as_os_str().is_empty());
    match folder.filter(|folder| !folder.is_dir()) {
        Some(folder) => Err(Failure::usage(format!(
            "the folder {} for the {what} does not exist; create the folder or choose another",
            folder.display()
        ))),
        None => Ok(()),
    }
}

/// Writes the file if a path is given.
pub(super) fn write(
    what: &str,
    to: Option<&Path>,
    content: impl FnOnce() -> String,
) -> Result<(), Failure> {
    to.map_or(Ok(()), |to| write_bytes(what, to, content().as_bytes()))
}

/// Writes a binary file.
pub(super) fn write_bytes(what: &str, to: &Path, bytes: &[u8]) -> Result<(), Failure> {
    atomic::create(to, bytes).map_err(|err| {
        Failure::failed(format!(
            "the {what} {} cannot be written ({err}); choose a folder that you may write to",
            to.display()
        ))
    })
}
