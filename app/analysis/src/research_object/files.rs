//! Files of a crate: their names, their copies, and the list of their hashes.

use super::error::CrateError;
use palpate_sessions::text::sha256_of_file;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;
use walkdir::WalkDir;

/// The list of hashes, as `sha256sum --check` reads it.
pub const SUMS_FILE: &str = "SHA256SUMS";

/// Names of all files below a folder, with `/` between folders, in alphabetical order.
///
/// # Errors
/// A link or a device among them: it leads elsewhere, and another computer lacks it.
pub(super) fn list(folder: &Path) -> Result<Vec<String>, CrateError> {
    let mut names = Vec::new();
    for entry in WalkDir::new(folder).min_depth(1) {
        let entry = entry.map_err(|err| CrateError::read(folder, err.into()))?;
        let kind = entry.file_type();
        if kind.is_dir() {
            continue;
        }
        let inside = entry.path().strip_prefix(folder).unwrap_or(entry.path());
        let parts: Option<Vec<&str>> =
            inside.components().map(|part| part.as_os_str().to_str()).collect();
        match parts {
            Some(parts) if kind.is_file() => names.push(parts.join("/")),
            _ => return Err(CrateError::NoPlainFile(entry.path().to_owned())),
        }
    }
    names.sort();
    Ok(names)
}

/// The path of a name of [`list`].
pub(super) fn path_of(folder: &Path, name: &str) -> PathBuf {
    name.split('/').fold(folder.to_owned(), |path, part| path.join(part))
}

/// Copies a file, and makes its folder.
pub(super) fn copy(from: &Path, to: &Path) -> Result<(), CrateError> {
    make_folder_of(to)?;
    fs::copy(from, to).map(|_| ()).map_err(|err| CrateError::read(from, err))
}

/// Writes a new file, and makes its folder.
pub(super) fn write(to: &Path, bytes: &[u8]) -> Result<(), CrateError> {
    make_folder_of(to)?;
    fs::write(to, bytes).map_err(|err| CrateError::write(to, err))
}

fn make_folder_of(file: &Path) -> Result<(), CrateError> {
    let folder = file.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder).map_err(|err| CrateError::write(folder, err))
}

/// Hash of every file, by name.
pub(super) type Sums = BTreeMap<String, String>;

/// Hashes all files of a folder but the list itself.
pub(super) fn hash(folder: &Path) -> Result<Sums, CrateError> {
    let names = list(folder)?.into_iter().filter(|name| name != SUMS_FILE);
    let hashed = names.map(|name| {
        let path = path_of(folder, &name);
        let sum = sha256_of_file(&path).map_err(|err| CrateError::read(&path, err))?;
        Ok((name, sum))
    });
    hashed.collect()
}

/// The list in the form of `sha256sum`.
pub(super) fn sums_text(sums: &Sums) -> String {
    sums.iter().map(|(name, sum)| format!("{sum}  {name}\n")).collect()
}

/// What is wrong with the files of a crate.
#[derive(Clone, Debug, PartialEq, Eq, Error, Serialize)]
#[serde(tag = "fault", rename_all = "kebab-case")]
pub enum FileFault {
    #[error(
        "{file} is not the file that the crate was made with; its SHA-256 differs from the one in {SUMS_FILE}"
    )]
    Differs { file: String },
    #[error("{file} is missing")]
    Missing { file: String },
    #[error("{file} is not listed in {SUMS_FILE}")]
    Extra { file: String },
    #[error("line {line} of {SUMS_FILE} is not in the form that it was written in")]
    List { line: usize },
    #[error("the bytes of {file} were changed after it was made; its seal differs")]
    Seal { file: String },
}

/// Compares all files of a crate with the list.
pub(super) fn check(folder: &Path) -> Result<Vec<FileFault>, CrateError> {
    let list_file = folder.join(SUMS_FILE);
    let text = match fs::read(&list_file) {
        Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
        Err(err) if err.kind() == io::ErrorKind::NotFound => {
            return Err(CrateError::NoCrate(folder.to_owned()));
        }
        Err(err) => return Err(CrateError::read(&list_file, err)),
    };
    let mut stated = Sums::new();
    let mut faults = Vec::new();
    for (index, line) in text.split_inclusive('\n').enumerate() {
        match line.strip_suffix('\n').and_then(|line| line.split_once("  ")) {
            Some((sum, name)) => drop(stated.insert(name.to_owned(), sum.to_owned())),
            None => faults.push(FileFault::List { line: index + 1 }),
        }
    }
    let found = hash(folder)?;
    let names: BTreeSet<&String> = stated.keys().chain(found.keys()).collect();
    faults.extend(names.into_iter().filter_map(|name| {
        let file = name.clone();
        match (stated.get(name), found.get(name)) {
            (Some(a), Some(b)) if a == b => None,
            (Some(_), Some(_)) => Some(FileFault::Differs { file }),
            (Some(_), None) => Some(FileFault::Missing { file }),
            (None, _) => Some(FileFault::Extra { file }),
        }
    }));
    // Lines in another order, or twice, have all hashes and are still not what was written.
    if faults.is_empty() && text != sums_text(&stated) {
        let written = sums_text(&stated);
        let same = text.lines().zip(written.lines()).take_while(|(a, b)| a == b).count();
        faults.push(FileFault::List { line: same + 1 });
    }
    Ok(faults)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flipped_bit_of_every_file_is_found_and_the_list_itself() {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        write(&at.join("a/b.txt"), b"one").unwrap();
        write(&at.join("c.txt"), b"two\n").unwrap();
        let sums = sums_text(&hash(at).unwrap());
        write(&at.join(SUMS_FILE), sums.as_bytes()).unwrap();
        assert_eq!(check(at).unwrap(), []);
        for name in ["a/b.txt", "c.txt", SUMS_FILE] {
            let path = path_of(at, name);
            let whole = fs::read(&path).unwrap();
            for bit in 0..8 * whole.len() {
                let mut flipped = whole.clone();
                flipped[bit / 8] ^= 1 << (bit % 8);
                fs::write(&path, flipped).unwrap();
                assert_ne!(check(at).unwrap(), [], "bit {bit} of {name}");
            }
            fs::write(&path, whole).unwrap();
        }
        fs::write(at.join("d"), "").unwrap();
        assert_eq!(check(at).unwrap(), [FileFault::Extra { file: "d".into() }]);
        fs::remove_file(at.join("d")).unwrap();
        fs::remove_file(at.join("c.txt")).unwrap();
        assert_eq!(check(at).unwrap(), [FileFault::Missing { file: "c.txt".into() }]);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_no_file_of_a_crate() {
        let folder = tempfile::tempdir().unwrap();
        std::os::unix::fs::symlink("/etc/hostname", folder.path().join("x")).unwrap();
        assert!(matches!(list(folder.path()), Err(CrateError::NoPlainFile(_))));
    }
}
