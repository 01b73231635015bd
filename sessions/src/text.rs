//! Small text files beside a session.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

/// The text of a file, or one sentence that names it.
pub fn read(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|err| format!("cannot read {} ({err})", path.display()))
}

/// Writes a text over what may be there; the file is the old or the new one, never half of it.
pub fn write(path: &Path, text: &str) -> Result<(), String> {
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".tmp");
    let hidden = path.with_file_name(name);
    File::create(&hidden)
        .and_then(|mut file| {
            file.write_all(text.as_bytes())
                .and_then(|()| file.sync_all())
        })
        .and_then(|()| fs::rename(&hidden, path))
        .map_err(|err| format!("cannot write {} ({err})", path.display()))
}

/// CRC-32 of a text as eight hexadecimal digits (ISO-HDLC, as in zip files).
#[must_use]
pub fn checksum(text: &str) -> String {
    format!("{:08x}", crc32fast::hash(text.as_bytes()))
}

/// The text of a file, `None` if there is no such file.
pub fn read_if_present(path: &Path) -> io::Result<Option<String>> {
    match fs::read_to_string(path) {
        Ok(text) => Ok(Some(text)),
        Err(err) if err.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(err) => Err(err),
    }
}
