//! What remote support needs, in one zip file: the program's log, versions, settings, rig files
//! without secrets and what the doctor says. Nothing that was measured, unless a session is named.

use crate::build_description::BuildDescription;
use crate::window_requests::SETTINGS_FILE;
use palpate_sessions::SessionSummary;
use palpate_sessions::atomic::{Draft, ExistingFile};
use palpate_sessions::program_log::{log_files, log_folder};
use serde::Serialize;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;
use walkdir::WalkDir;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// Words in the name of a secret value.
const SECRET: &str = "password passwd passphrase secret token credential login api_key private_key";
const REMOVED: &str = "removed";

#[derive(Clone, Debug, Default)]
pub struct BundleRequest {
    /// The file to make. One that is there already is refused.
    pub to: PathBuf,
    /// The library whose log and settings are meant.
    pub library: PathBuf,
    pub rigs: Vec<PathBuf>,
    /// Findings of the doctor on the library.
    pub findings: String,
    /// Parts that the program was built with.
    pub features: Vec<&'static str>,
    /// Whether the manifests of the library's sessions go in: who measured what, without what was measured.
    pub has_manifests: bool,
    /// Sessions that go in as they are, with all that was measured.
    pub sessions: Vec<PathBuf>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct BundledFile {
    /// Its name in the bundle.
    pub name: String,
    /// Its size before it is compressed.
    pub bytes: u64,
    pub what: &'static str,
}

#[derive(Debug, Error)]
pub enum BundleError {
    #[error("cannot read {path} ({source}); check its path and permissions")]
    Read { path: String, source: io::Error },
    #[error("{0}")]
    Session(String),
    #[error("cannot write the bundle {path} ({source}); choose a folder that you may write to")]
    Write { path: String, source: io::Error },
}

/// Writes a bundle and lists its files.
pub fn make_bundle(request: &BundleRequest) -> Result<Vec<BundledFile>, BundleError> {
    let unwritable = |source| BundleError::Write { path: request.to.display().to_string(), source };
    let draft = Draft::new(&request.to).map_err(unwritable)?;
    let files = fill(request, &draft)?;
    draft.persist(ExistingFile::Keep).map_err(unwritable)?;
    Ok(files)
}

fn fill(request: &BundleRequest, draft: &Draft) -> Result<Vec<BundledFile>, BundleError> {
    let mut bundle = BundleWriter {
        zip: ZipWriter::new(draft.writer()).set_auto_large_file(),
        files: Vec::new(),
        to: request.to.display().to_string(),
    };
    bundle.text(
        "versions.txt",
        "versions and parts of the program",
        &format!("{}\n", BuildDescription::of(request.features.clone())),
    )?;
    bundle.text(
        "findings.txt",
        "results of 'palpate doctor' on the sessions",
        &request.findings,
    )?;
    for log in log_files(&log_folder(&request.library)) {
        let name = format!("log/{}", file_name(&log));
        bundle.file(&name, "the program's log", &log)?;
    }
    let settings = request.library.join(SETTINGS_FILE);
    if settings.is_file() {
        let text = read(&settings)?;
        bundle.text(SETTINGS_FILE, "settings of the window", &without_secrets(&text))?;
    }
    for rig in &request.rigs {
        let name = format!("rigs/{}", file_name(rig));
        bundle.text(&name, "a rig file, secrets removed", &without_secrets(&read(rig)?))?;
    }
    if request.has_manifests {
        bundle.manifests(&request.library)?;
    }
    for session in &request.sessions {
        bundle.session(session)?;
    }
    let BundleWriter { zip, files, to } = bundle;
    let written = zip.finish().map_err(io::Error::from);
    written
        .and_then(|mut out| out.flush())
        .map_err(|source| BundleError::Write { path: to, source })?;
    Ok(files)
}

struct BundleWriter<'a> {
    zip: ZipWriter<BufWriter<&'a File>>,
    files: Vec<BundledFile>,
    to: String,
}

impl BundleWriter<'_> {
    fn text(&mut self, name: &str, what: &'static str, text: &str) -> Result<(), BundleError> {
        self.add(name, what, &mut text.as_bytes())
    }

    fn file(&mut self, name: &str, what: &'static str, path: &Path) -> Result<(), BundleError> {
        let mut file = File::open(path).map_err(|err| unreadable(path, err))?;
        self.add(name, what, &mut file)
    }

    fn add(
        &mut self,
        name: &str,
        what: &'static str,
        content: &mut dyn io::Read,
    ) -> Result<(), BundleError> {
        let bytes = self
            .zip
            .start_file(name, SimpleFileOptions::default())
            .map_err(io::Error::from)
            .and_then(|()| io::copy(content, &mut self.zip))
            .map_err(|source| BundleError::Write { path: self.to.clone(), source })?;
        self.files.push(BundledFile { name: name.into(), bytes, what });
        Ok(())
    }

    fn manifests(&mut self, library: &Path) -> Result<(), BundleError> {
        let sessions = library.join("sessions");
        let folders = WalkDir::new(&sessions).min_depth(1).max_depth(1);
        for folder in folders.sort_by_file_name().into_iter().flatten() {
            // One that cannot be read has its line among the findings.
            let Ok(summary) = SessionSummary::read(folder.path()) else { continue };
            let text = serde_json::to_string_pretty(&summary.manifest).unwrap_or_default();
            let name = format!("manifests/{}.json", file_name(folder.path()));
            self.text(&name, "a session's manifest", &text)?;
        }
        Ok(())
    }

    fn session(&mut self, session: &Path) -> Result<(), BundleError> {
        SessionSummary::read(session).map_err(|err| BundleError::Session(err.to_string()))?;
        let base = session.parent().unwrap_or(Path::new(""));
        for entry in WalkDir::new(session).sort_by_file_name() {
            let entry = entry.map_err(|err| unreadable(session, err.into()))?;
            if entry.file_type().is_file() {
                let inside = entry.path().strip_prefix(base).unwrap_or(entry.path());
                let name = format!("sessions/{}", inside.display());
                self.file(&name, "a file of a session, with its measurements", entry.path())?;
            }
        }
        Ok(())
    }
}

fn unreadable(path: &Path, source: io::Error) -> BundleError {
    BundleError::Read { path: path.display().to_string(), source }
}

fn read(path: &Path) -> Result<String, BundleError> {
    let bytes = std::fs::read(path).map_err(|err| unreadable(path, err))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// A text of lines without what a line calls a secret, and without names and passwords before a host.
#[must_use]
pub fn without_secrets(text: &str) -> String {
    let lines = text.lines().map(|line| {
        let small = line.to_lowercase();
        if SECRET.split(' ').any(|word| small.contains(word)) {
            // Without a key the line may be the secret.
            return match line.split_once(['=', ':']) {
                Some((key, _)) => format!("{} = \"{REMOVED}\"\n", key.trim_end()),
                None => format!("# {REMOVED}\n"),
            };
        }
        let words = line.split_inclusive([' ', '"', '\'', ',', '=']);
        let words: String = words.map(without_login).collect();
        words + "\n"
    });
    lines.collect()
}

/// `user:password@host` without what stands before the host.
fn without_login(word: &str) -> String {
    let Some((login, host)) = word.rsplit_once('@') else { return word.to_owned() };
    let scheme = login.find("://").map_or("", |end| &login[..end + 3]);
    format!("{scheme}{REMOVED}@{host}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_of_a_rig_file_are_removed_and_the_rest_stays() {
        let file = "device = \"galil\"\naddress = \"lab:s3same@192.168.1.10:23\"\n\
            Password = \"tulip\"\n# the Token of the gateway is 4711\n\
            port = \"tcp://me:pw@host/a@b\"\nmm_per_pulse = 0.015 # as measured\n";
        let safe = without_secrets(file);
        for secret in ["s3same", "tulip", "4711", "me:", "pw", "lab"] {
            assert!(!safe.contains(secret), "{secret}: {safe}");
        }
        for kept in [
            "device = \"galil\"\n",
            "address = \"removed@192.168.1.10:23\"\n",
            "mm_per_pulse = 0.015 # as measured\n",
        ] {
            assert!(safe.contains(kept), "{kept}: {safe}");
        }
    }
}
