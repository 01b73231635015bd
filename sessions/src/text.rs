//! Text files, and checksums of files and texts.

use crate::atomic;
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// The error is a sentence that names the file.
pub fn read(path: &Path) -> Result<String, String> {
    fs::read_to_string(path)
        .map_err(|err| format!("cannot read {} ({err}); check the path", path.display()))
}

/// Writes or replaces a file atomically.
pub fn write(path: &Path, text: &str) -> Result<(), String> {
    atomic::replace(path, text.as_bytes())
        .map_err(|err| format!("cannot write {} ({err}); choose a writable folder", path.display()))
}

/// The JSON files of a folder, hidden ones excepted, sorted by name; a missing folder has none.
#[must_use]
pub fn json_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_whole = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.ends_with(".json") && !name.starts_with('.')
    };
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(is_whole).collect();
    files.sort();
    files
}

/// SHA-256 of some bytes (FIPS 180-4) as 64 hexadecimal digits.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// SHA-256 of a file, which is read in pieces.
pub fn sha256_of_file(path: &Path) -> io::Result<String> {
    sha256_of(File::open(path)?)
}

/// SHA-256 of the rest of a stream.
pub fn sha256_of(from: impl Read) -> io::Result<String> {
    let mut hasher = Sha256::new();
    read_pieces(from, |piece| hasher.update(piece))?;
    Ok(hex(&hasher.finalize()))
}

/// CRC-32 of a file, which is read in pieces.
pub fn crc32_of_file(path: &Path) -> io::Result<u32> {
    crc32_of(File::open(path)?)
}

/// CRC-32 of the rest of a stream.
pub fn crc32_of(from: impl Read) -> io::Result<u32> {
    let mut hasher = crc32fast::Hasher::new();
    read_pieces(from, |piece| hasher.update(piece))?;
    Ok(hasher.finalize())
}

fn read_pieces(mut from: impl Read, mut take: impl FnMut(&[u8])) -> io::Result<()> {
    let mut piece = vec![0; 1 << 18];
    loop {
        match from.read(&mut piece)? {
            0 => return Ok(()),
            count => take(&piece[..count]),
        }
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// CRC-32 of a text as eight hexadecimal digits (ISO-HDLC, as in zip files).
#[must_use]
pub fn checksum(text: &str) -> String {
    format!("{:08x}", crc32fast::hash(text.as_bytes()))
}

/// `None` if there is no such file.
pub fn read_if_present(path: &Path) -> io::Result<Option<String>> {
    match fs::read_to_string(path) {
        Ok(text) => Ok(Some(text)),
        Err(err) if err.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(err) => Err(err),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sha_256_matches_the_standard_example() {
        // The example of one block in FIPS 180-4's examples.
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256(b"abc"), expected);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("abc");
        fs::write(&path, "abc").unwrap();
        assert_eq!(sha256_of_file(&path).unwrap(), expected);
    }
}
