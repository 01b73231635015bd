//! A crate as one zip file, whose last bytes are a seal: a hash of all bytes before it.
//!
//! The list of hashes covers what is in the files. The seal covers what a zip file has around them: names, times,
//! lengths. A repository may pack the files into a zip file of its own, which has no seal and is read all the same.

use super::error::CrateError;
use super::files;
use super::steps::leads_out;
use palpate_sessions::atomic::{Draft, ExistingFile};
use palpate_sessions::folder::free_bytes;
use palpate_sessions::text::sha256_of;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

/// The comment of the zip file, before the 64 digits of the hash.
const SEAL: &str = "SHA-256 of this file without these last 64 digits: ";
const DIGITS: usize = 64;
/// Above this size a file needs the longer records of a zip file (APPNOTE 6.3.9, 4.3.9.2).
const LARGE: u64 = u32::MAX as u64;

/// Packs all files of a folder, in alphabetical order, without their times.
pub(super) fn pack(folder: &Path, to: &Path) -> Result<(), CrateError> {
    let failed = |err: io::Error| CrateError::write(to, err);
    let draft = Draft::new(to).map_err(failed)?;
    let mut zip = ZipWriter::new(draft.writer());
    let options = SimpleFileOptions::default().last_modified_time(zip::DateTime::default());
    let names = files::list(folder)?;
    // The metadata describe folders too, and readers look for them.
    for name in folders_of(&names) {
        let options = options.unix_permissions(0o755);
        zip.add_directory(name, options).map_err(io::Error::from).map_err(failed)?;
    }
    for name in names {
        let path = files::path_of(folder, &name);
        let mut file = File::open(&path).map_err(|err| CrateError::read(&path, err))?;
        let length = file.metadata().map_err(|err| CrateError::read(&path, err))?.len();
        let options = options.unix_permissions(0o644).large_file(length > LARGE);
        zip.start_file(name, options).map_err(io::Error::from).map_err(failed)?;
        io::copy(&mut file, &mut zip).map_err(failed)?;
    }
    zip.set_comment(format!("{SEAL}{}", "0".repeat(DIGITS)))
        .map_err(io::Error::from)
        .map_err(failed)?;
    let mut out = zip.finish().map_err(io::Error::from).map_err(failed)?;
    out.flush().map_err(failed)?;
    drop(out);
    seal(&draft).map_err(failed)?;
    draft.persist(ExistingFile::Keep).map_err(failed)
}

/// All folders in which files are.
fn folders_of(names: &[String]) -> BTreeSet<&str> {
    let ends = |name: &'_ str| name.match_indices('/').map(|(end, _)| end).collect::<Vec<_>>();
    names.iter().flat_map(|name| ends(name).into_iter().map(|end| &name[..end])).collect()
}

fn seal(draft: &Draft) -> io::Result<()> {
    let mut file = draft.reader()?;
    let digits = hash_before_digits(&mut file)?;
    file.seek(SeekFrom::End(-(DIGITS as i64)))?;
    file.write_all(digits.as_bytes())
}

fn hash_before_digits(file: &mut File) -> io::Result<String> {
    let length = file.seek(SeekFrom::End(0))?;
    file.seek(SeekFrom::Start(0))?;
    sha256_of(BufReader::new(file).take(length.saturating_sub(DIGITS as u64)))
}

/// The seal of a zip file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SealState {
    Whole,
    /// Another program packed it.
    None,
    Broken,
}

fn read_seal(file: &mut File, comment: &[u8]) -> io::Result<SealState> {
    let length = file.seek(SeekFrom::End(0))?;
    let tail = length.min((SEAL.len() + DIGITS) as u64);
    file.seek(SeekFrom::End(-(tail as i64)))?;
    let mut last = Vec::new();
    file.read_to_end(&mut last)?;
    match last.strip_prefix(SEAL.as_bytes()) {
        Some(digits) if digits == hash_before_digits(file)?.as_bytes() => Ok(SealState::Whole),
        Some(_) => Ok(SealState::Broken),
        // A comment that is nearly a seal was one.
        None if comment.is_empty() => Ok(SealState::None),
        None => Ok(SealState::Broken),
    }
}

/// Unpacks a zip file into an empty folder. No name leads out of it, and there is space for all.
pub(super) fn unpack(from: &Path, folder: &Path) -> Result<SealState, CrateError> {
    let failed = |err: io::Error| CrateError::read(from, err);
    let damaged = |reason: String| CrateError::Zip { path: from.to_owned(), reason };
    let mut file = File::open(from).map_err(failed)?;
    let reader = BufReader::new(file.try_clone().map_err(failed)?);
    let mut zip = ZipArchive::new(reader).map_err(|err| damaged(err.to_string()))?;
    let mut entries = Vec::new();
    let mut needed_bytes: u64 = 0;
    for index in 0..zip.len() {
        let entry = zip.by_index(index).map_err(|err| damaged(err.to_string()))?;
        let name = entry.name().map_err(|err| damaged(err.to_string()))?.into_owned();
        if leads_out(&name) || name.contains('\\') || entry.is_symlink() {
            return Err(CrateError::Escapes { path: from.to_owned(), name });
        }
        needed_bytes = needed_bytes.saturating_add(entry.size());
        if !entry.is_dir() {
            entries.push((index, name, entry.size()));
        }
    }
    let free_bytes = free_bytes(folder).unwrap_or(u64::MAX);
    if needed_bytes > free_bytes {
        return Err(CrateError::NoSpace { needed_bytes, free_bytes });
    }
    for (index, name, size) in entries {
        let to = files::path_of(folder, &name);
        if to.exists() {
            return Err(damaged(format!("{name} is in it twice")));
        }
        let entry = zip.by_index(index).map_err(|err| damaged(err.to_string()))?;
        files::write(&to, b"")?;
        let mut out = File::create(&to).map_err(|err| CrateError::write(&to, err))?;
        // A file that unpacks to more than it says fills no disk.
        let copied = io::copy(&mut entry.take(size + 1), &mut out);
        match copied {
            Ok(length) if length == size => {}
            Ok(_) => return Err(damaged(format!("{name} has another length than it says"))),
            Err(err) => return Err(damaged(format!("{name}: {err}"))),
        }
    }
    let comment = zip.comment().to_vec();
    read_seal(&mut file, &comment).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn packed() -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        files::write(&folder.path().join("crate/a/b.txt"), b"one one one one").unwrap();
        files::write(&folder.path().join("crate/c.txt"), b"two").unwrap();
        let zip = folder.path().join("crate.zip");
        pack(&folder.path().join("crate"), &zip).unwrap();
        (folder, zip)
    }

    #[test]
    fn a_zip_file_comes_back_and_every_flipped_byte_is_found() {
        let (folder, zip) = packed();
        let out = folder.path().join("out");
        fs::create_dir(&out).unwrap();
        assert_eq!(unpack(&zip, &out).unwrap(), SealState::Whole);
        assert_eq!(fs::read(out.join("a/b.txt")).unwrap(), b"one one one one");
        let whole = fs::read(&zip).unwrap();
        let again = folder.path().join("again.zip");
        pack(&folder.path().join("crate"), &again).unwrap();
        assert_eq!(fs::read(&again).unwrap(), whole);
        for place in 0..whole.len() {
            let mut flipped = whole.clone();
            flipped[place] ^= 1;
            fs::write(&zip, flipped).unwrap();
            let out = tempfile::tempdir().unwrap();
            let found = unpack(&zip, out.path());
            assert!(!matches!(found, Ok(SealState::Whole | SealState::None)), "byte {place}");
        }
    }

    #[test]
    fn a_name_that_leads_out_unpacks_nothing() {
        for name in ["../x", "/x", "a/../../x", "C:\\x", "a\\..\\x"] {
            let folder = tempfile::tempdir().unwrap();
            let zip = folder.path().join("hostile.zip");
            let mut writer = ZipWriter::new(File::create(&zip).unwrap());
            writer.start_file("fine", SimpleFileOptions::default()).unwrap();
            writer.start_file(name, SimpleFileOptions::default()).unwrap();
            writer.finish().unwrap();
            let out = folder.path().join("out");
            fs::create_dir(&out).unwrap();
            let refused = unpack(&zip, &out).unwrap_err();
            assert!(matches!(refused, CrateError::Escapes { .. }), "{name}: {refused}");
            assert!(fs::read_dir(&out).unwrap().next().is_none(), "{name}");
        }
    }
}
