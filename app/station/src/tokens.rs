//! Tokens: who may do what over the network. Only their SHA-256 is stored.

use palpate_analysis::station_settings::{TOKENS_FILE, TOKENS_FORMAT};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fmt;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use thiserror::Error;

/// A file of more is not one of ours: a laboratory has some tens of tokens.
const BYTES_MAX: u64 = 256 * 1024;

/// Bytes of a token: no one guesses 256 bits.
const SECRET_BYTES: usize = 32;

/// What a token allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scope {
    /// Read state, curves, sessions, queue and events.
    Watch,
    /// Stop the rig.
    Stop,
    /// Ask for runs of a queue that a person at the rig has armed.
    Run,
}

impl Scope {
    pub const ALL: [Self; 3] = [Self::Watch, Self::Stop, Self::Run];

    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Watch => "watch",
            Self::Stop => "stop",
            Self::Run => "run",
        }
    }
}

impl fmt::Display for Scope {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Scope {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|scope| scope.name() == text);
        found.ok_or_else(|| format!("'{text}' is not a scope; give watch, stop or run"))
    }
}

/// A token as it is stored.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredToken {
    /// Who or what uses it, as in `office phone`.
    pub name: String,
    pub scopes: Vec<Scope>,
    /// Day on which it was made.
    pub made_at: String,
    /// SHA-256 of the token, in hexadecimal digits.
    sha256: String,
}

#[derive(Debug, Serialize, Deserialize)]
struct TokensDocument {
    format: u32,
    tokens: Vec<StoredToken>,
}

#[derive(Debug, Error)]
pub enum TokensError {
    #[error(
        "the file of tokens {path} cannot be read ({detail}); correct it, or delete it and make new tokens"
    )]
    Unreadable { path: PathBuf, detail: String },
    #[error("the file of tokens {path} is of a newer palpate; use that version")]
    Newer { path: PathBuf },
    #[error(
        "the file of tokens {path} cannot be written ({detail}); check the folder's permissions and free space"
    )]
    Unwritable { path: PathBuf, detail: String },
    #[error("a token '{0}' is there already; remove it first, or choose another name")]
    Taken(String),
    #[error("no token is called '{0}'; look at the list of tokens")]
    Unknown(String),
    #[error(
        "a name of a token has 1 to 60 letters, digits, spaces, '-', '_' or '.'; '{0}' is none"
    )]
    Name(String),
    #[error("the system gives no random numbers ({0}), so no token can be made")]
    NoRandom(String),
}

/// The tokens of a library.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tokens(Vec<StoredToken>);

impl Tokens {
    /// Reads them; none where there is no file.
    pub fn read(library: &Path) -> Result<Self, TokensError> {
        let path = library.join(TOKENS_FILE);
        let unreadable = |detail: String| TokensError::Unreadable { path: path.clone(), detail };
        match path.metadata() {
            Err(err) if err.kind() == std::io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(err) => return Err(unreadable(err.to_string())),
            Ok(found) if found.len() > BYTES_MAX => {
                return Err(unreadable("it is too long".into()));
            }
            Ok(_) => {}
        }
        let text = std::fs::read_to_string(&path).map_err(|err| unreadable(err.to_string()))?;
        #[derive(Deserialize)]
        struct Head {
            format: u32,
        }
        let head: Head = serde_json::from_str(&text).map_err(|err| unreadable(err.to_string()))?;
        if head.format > TOKENS_FORMAT {
            return Err(TokensError::Newer { path });
        }
        let document: TokensDocument =
            serde_json::from_str(&text).map_err(|err| unreadable(err.to_string()))?;
        Ok(Self(document.tokens))
    }

    pub fn all(&self) -> &[StoredToken] {
        &self.0
    }

    /// The stored token of a secret. Digests are compared, so the time of the comparison says nothing of a secret.
    #[must_use]
    pub fn find(&self, secret: &str) -> Option<&StoredToken> {
        let digest = digest(secret);
        self.0.iter().find(|token| token.sha256 == digest)
    }

    /// Makes a token and returns its secret, which is stored nowhere.
    pub fn add(
        library: &Path,
        name: &str,
        scopes: &[Scope],
        made_at: String,
    ) -> Result<String, TokensError> {
        let is_plain = |c: char| c.is_alphanumeric() || " -_.".contains(c);
        let count = name.chars().count();
        if !(1..=60).contains(&count) || name.trim() != name || !name.chars().all(is_plain) {
            return Err(TokensError::Name(name.to_owned()));
        }
        let mut tokens = Self::read(library)?;
        if tokens.0.iter().any(|token| token.name == name) {
            return Err(TokensError::Taken(name.to_owned()));
        }
        let mut bytes = [0; SECRET_BYTES];
        getrandom::fill(&mut bytes).map_err(|err| TokensError::NoRandom(err.to_string()))?;
        let secret = hex(&bytes);
        let mut scopes = scopes.to_vec();
        scopes.sort_unstable();
        scopes.dedup();
        let sha256 = digest(&secret);
        tokens.0.push(StoredToken { name: name.to_owned(), scopes, made_at, sha256 });
        tokens.write(library)?;
        Ok(secret)
    }

    /// Removes a token; whoever uses it is cut off within a second.
    pub fn remove(library: &Path, name: &str) -> Result<(), TokensError> {
        let mut tokens = Self::read(library)?;
        let before = tokens.0.len();
        tokens.0.retain(|token| token.name != name);
        if tokens.0.len() == before {
            return Err(TokensError::Unknown(name.to_owned()));
        }
        tokens.write(library)
    }

    /// Replaces the file as a whole; only its owner may read it.
    fn write(self, library: &Path) -> Result<(), TokensError> {
        let path = library.join(TOKENS_FILE);
        let document = TokensDocument { format: TOKENS_FORMAT, tokens: self.0 };
        let write = || -> std::io::Result<()> {
            std::fs::create_dir_all(library)?;
            let mut file = tempfile::NamedTempFile::new_in(library)?;
            serde_json::to_writer_pretty(&mut file, &document)?;
            file.write_all(b"\n")?;
            file.as_file().sync_all()?;
            file.persist(&path)?;
            Ok(())
        };
        write().map_err(|err| TokensError::Unwritable { path, detail: err.to_string() })
    }
}

fn digest(secret: &str) -> String {
    hex(&Sha256::digest(secret.as_bytes()))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_found_by_its_secret_until_it_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let library = folder.path();
        assert_eq!(Tokens::read(library).unwrap(), Tokens::default());
        let add =
            |name: &str, scopes: &[Scope]| Tokens::add(library, name, scopes, "2026-11-29".into());
        let phone = add("office phone", &[Scope::Stop, Scope::Watch, Scope::Stop]).unwrap();
        let script = add("search", &[Scope::Run]).unwrap();
        assert_eq!(phone.len(), 2 * SECRET_BYTES);
        assert_ne!(phone, script);
        let tokens = Tokens::read(library).unwrap();
        let found = tokens.find(&phone).unwrap();
        assert_eq!(
            (found.name.as_str(), &*found.scopes),
            ("office phone", &[Scope::Watch, Scope::Stop][..])
        );
        assert_eq!(tokens.find(&phone[1..]), None);
        assert_eq!(tokens.find(""), None);
        let stored = std::fs::read_to_string(library.join(TOKENS_FILE)).unwrap();
        assert!(!stored.contains(&phone), "a secret is never stored");
        assert!(matches!(add("search", &[]), Err(TokensError::Taken(_))));
        for name in ["", " x", "a\nb", "<b>", &"n".repeat(61)] {
            assert!(matches!(add(name, &[]), Err(TokensError::Name(_))), "{name}");
        }
        Tokens::remove(library, "office phone").unwrap();
        assert!(matches!(Tokens::remove(library, "office phone"), Err(TokensError::Unknown(_))));
        let tokens = Tokens::read(library).unwrap();
        assert_eq!(tokens.find(&phone), None);
        assert!(tokens.find(&script).is_some());
    }

    #[test]
    fn a_damaged_or_newer_file_is_refused_and_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(TOKENS_FILE);
        for (text, words) in [("{", "cannot be read"), ("{\"format\": 2}", "newer")] {
            std::fs::write(&path, text).unwrap();
            let refusal = Tokens::add(folder.path(), "a", &[], String::new()).unwrap_err();
            assert!(refusal.to_string().contains(words), "{refusal}");
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        }
    }

    #[cfg(unix)]
    #[test]
    fn only_its_owner_may_read_the_file() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        Tokens::add(folder.path(), "a", &Scope::ALL, String::new()).unwrap();
        let mode = folder.path().join(TOKENS_FILE).metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o077, 0);
    }
}
