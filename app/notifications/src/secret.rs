//! Files with secrets: read only where no other user of the computer can read them.

use std::fmt;
use std::path::Path;
use thiserror::Error;

/// A password or a token. It has no text that a log or a message could show.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret(String);

impl Secret {
    #[must_use]
    pub fn new(text: impl Into<String>) -> Self {
        Self(text.into())
    }

    /// The secret, for the server that it is meant for.
    pub(crate) fn reveal(&self) -> &str {
        &self.0
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret")
    }
}

/// Most bytes of a secret: far more than any password or token.
const SECRET_BYTES_MAX: u64 = 16 * 1024;

#[derive(Debug, Error)]
pub enum SecretError {
    #[error("{path} cannot be read ({reason}); check the path and its permissions")]
    Unreadable { path: String, reason: String },
    #[error("other users of this computer can read {path}; run 'chmod 600 {path}'")]
    Shared { path: String },
    #[error("{path} has no text; write the secret on its first line")]
    Empty { path: String },
    #[error("{path} is not a secret on one line; write only the secret into it")]
    Long { path: String },
}

/// Refuses a file that the group or others may read or write. Windows gives a file in the own profile to its owner alone.
pub(crate) fn check_private(path: &Path) -> Result<(), SecretError> {
    let name = path.display().to_string();
    let facts = std::fs::metadata(path)
        .map_err(|err| SecretError::Unreadable { path: name.clone(), reason: err.to_string() })?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        if facts.permissions().mode() & 0o077 != 0 {
            return Err(SecretError::Shared { path: name });
        }
    }
    if facts.len() > SECRET_BYTES_MAX {
        return Err(SecretError::Long { path: name });
    }
    Ok(())
}

/// Reads the secret of a file: its one line.
pub(crate) fn read_secret(path: &Path) -> Result<Secret, SecretError> {
    check_private(path)?;
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|err| SecretError::Unreadable { path: name.clone(), reason: err.to_string() })?;
    let line = text.trim_end_matches(['\r', '\n']);
    if line.is_empty() {
        return Err(SecretError::Empty { path: name });
    }
    if line.contains(char::is_control) {
        return Err(SecretError::Long { path: name });
    }
    Ok(Secret::new(line))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_secret_is_one_line_of_a_file_that_only_its_owner_reads() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("token");
        let write = |text: &str, mode: u32| {
            std::fs::write(&path, text).unwrap();
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
            read_secret(&path)
        };
        assert_eq!(write("xyzzy\n", 0o600).unwrap().reveal(), "xyzzy");
        assert_eq!(write("with space \r\n", 0o400).unwrap().reveal(), "with space ");
        for mode in [0o640, 0o604, 0o620, 0o644] {
            assert!(matches!(write("xyzzy", mode), Err(SecretError::Shared { .. })), "{mode:o}");
        }
        assert!(matches!(write("\n", 0o600), Err(SecretError::Empty { .. })));
        assert!(matches!(write("two\nlines\n", 0o600), Err(SecretError::Long { .. })));
        let gone = read_secret(&folder.path().join("gone"));
        assert!(matches!(gone, Err(SecretError::Unreadable { .. })));
        assert_eq!(format!("{:?}", Secret::new("xyzzy")), "Secret");
    }
}
