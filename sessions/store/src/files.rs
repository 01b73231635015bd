//! The files of a session as objects: each cut into pieces that are named by their SHA-256, and a list of them.
//!
//! An upload that was cut off goes on with the first piece that is missing, and a file to which lines were added shares
//! all its earlier whole pieces.

use crate::error::StoreError;
use crate::location::{REQUESTS, Store};
use bytes::Bytes;
use futures_util::stream::{self, StreamExt, TryStreamExt};
use object_store::path::Path as ObjectPath;
use palpate_sessions::atomic::is_draft_name;
use palpate_sessions::text::sha256;
use palpate_sessions::{LOCK_FILE, SPARE_FILE};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use walkdir::WalkDir;

/// Version of the list of files.
const LIST_VERSION: u32 = 1;
/// Most bytes of a piece. Sixteen of them under way need 128 MiB.
pub(crate) const PIECE_BYTES: u64 = 8 << 20;
/// A piece of at least so many bytes is looked up before it is sent: looking takes as long as sending this much.
const LOOK_BYTES: usize = 1 << 20;

/// One file of a session.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct StoredFile {
    /// Path below the session's folder, separated by `/`.
    pub name: String,
    pub bytes: u64,
    /// SHA-256 of each piece, all but the last of 8 MiB.
    pub pieces: Vec<String>,
}

/// All files of one version of a session, by name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct FileList {
    pub list_version: u32,
    pub session_id: String,
    pub files: Vec<StoredFile>,
}

/// A file that is to be stored.
#[derive(Clone, Debug)]
pub(crate) struct LocalFile {
    pub name: String,
    pub path: PathBuf,
}

/// Why a folder is not pushed whole.
pub(crate) enum FolderFault {
    /// Segments lie in a spare folder.
    Spare,
    Unreadable(StoreError),
}

/// The files of a session's folder, by name, without its lock and without drafts.
pub(crate) fn local_files(session: &Path) -> Result<Vec<LocalFile>, FolderFault> {
    let mut files = Vec::new();
    // What a link leads to is a part of the session.
    let entries = WalkDir::new(session).follow_links(true).min_depth(1).sort_by_file_name();
    for entry in entries {
        let entry = entry.map_err(|err| {
            let path = err.path().unwrap_or(session).to_owned();
            FolderFault::Unreadable(StoreError::File { path, source: err.into() })
        })?;
        let name = entry.file_name().to_string_lossy();
        if entry.depth() == 1 && name == SPARE_FILE {
            return Err(FolderFault::Spare);
        }
        let is_lock = entry.depth() == 1 && name == LOCK_FILE;
        if entry.file_type().is_file() && !is_lock && !is_draft_name(&name) {
            let below = entry.path().strip_prefix(session).unwrap_or(entry.path());
            let parts = below.iter().map(|part| part.to_string_lossy());
            let name = parts.collect::<Vec<_>>().join("/");
            files.push(LocalFile { name, path: entry.into_path() });
        }
    }
    files.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(files)
}

/// Calls `take` with every piece of the first bytes of a file; no bytes for all.
fn read_pieces(
    path: &Path,
    bytes: Option<u64>,
    mut take: impl FnMut(u64, &[u8]),
) -> Result<(), StoreError> {
    let failed = StoreError::file(path);
    let mut file = File::open(path).map_err(&failed)?.take(bytes.unwrap_or(u64::MAX));
    let mut at = 0;
    loop {
        let mut piece = Vec::new();
        let read = (&mut file).take(PIECE_BYTES).read_to_end(&mut piece).map_err(&failed)?;
        // An empty file has one empty piece, so that it is stored too.
        if read == 0 && at > 0 {
            return Ok(());
        }
        take(at, &piece);
        at += read as u64;
        if (read as u64) < PIECE_BYTES {
            return Ok(());
        }
    }
}

impl FileList {
    /// The list of a session's files, each read once.
    pub fn of(session_id: &str, files: &[LocalFile]) -> Result<Self, StoreError> {
        let one = |file: &LocalFile| {
            let (mut bytes, mut pieces) = (0, Vec::new());
            read_pieces(&file.path, None, |_, piece| {
                bytes += piece.len() as u64;
                pieces.push(sha256(piece));
            })?;
            Ok(StoredFile { name: file.name.clone(), bytes, pieces })
        };
        let files = files.iter().map(one).collect::<Result<_, StoreError>>()?;
        Ok(Self { list_version: LIST_VERSION, session_id: session_id.to_owned(), files })
    }

    pub fn encode(&self) -> Bytes {
        // Texts and numbers always have a JSON.
        serde_json::to_vec(self).unwrap_or_default().into()
    }

    pub fn bytes(&self) -> u64 {
        self.files.iter().map(|file| file.bytes).sum()
    }

    fn decode(path: &ObjectPath, bytes: &[u8]) -> Result<Self, StoreError> {
        let list: Self = serde_json::from_slice(bytes).map_err(|err| StoreError::bad(path, err))?;
        if list.list_version > LIST_VERSION {
            return Err(StoreError::Newer { version: list.list_version.to_string() });
        }
        match list.files.iter().find(|file| !is_below(&file.name)) {
            Some(file) => {
                Err(StoreError::bad(path, format!("{:?} is no name of a file", file.name)))
            }
            None => Ok(list),
        }
    }

    /// The first file of an earlier version that the folder does not continue: of logs and other files every byte is the
    /// same, a file of lines may have more.
    pub fn first_not_continued(&self, folder: &Path) -> Result<Option<String>, StoreError> {
        for file in &self.files {
            let path = folder.join(&file.name);
            let is_head = file.name.ends_with(HEAD_ENDING);
            let is_lines = file.name.ends_with(LINES_ENDING);
            let known = match std::fs::metadata(&path) {
                Ok(facts) if is_lines => facts.len() >= file.bytes,
                Ok(facts) => is_head || facts.len() == file.bytes,
                Err(_) => false,
            };
            if !known || !is_head && !file.begins(&path)? {
                return Ok(Some(file.name.clone()));
            }
        }
        Ok(None)
    }
}

/// Files that grow by lines, and the file beside one that counts them.
const LINES_ENDING: &str = ".jsonl";
const HEAD_ENDING: &str = ".head";

impl StoredFile {
    /// Whether a file begins with the bytes of this one.
    fn begins(&self, path: &Path) -> Result<bool, StoreError> {
        let mut pieces = Vec::new();
        read_pieces(path, Some(self.bytes), |_, piece| pieces.push(sha256(piece)))?;
        Ok(pieces == self.pieces)
    }
}

/// Whether a name stays below its folder on every system.
pub(crate) fn is_below(name: &str) -> bool {
    let is_plain =
        |part: &str| !matches!(part, "" | "." | "..") && !part.contains(['\\', ':', '\0']);
    name.split('/').all(is_plain)
}

/// The object of some bytes.
pub(crate) fn object_path(sha256: &str) -> ObjectPath {
    let (first, rest) = sha256.split_at_checked(2).unwrap_or((sha256, ""));
    ObjectPath::from(format!("objects/{first}/{rest}"))
}

impl Store {
    /// Stores all pieces of the files and then their list; the SHA-256 of the list and the bytes that were sent.
    pub(crate) async fn put_files(
        &self,
        folder: &Path,
        list: &FileList,
    ) -> Result<(String, u64), StoreError> {
        let pieces = list.files.iter().flat_map(|file| {
            let offsets = (0..).map(|k| k * PIECE_BYTES);
            let path = folder.join(&file.name);
            file.pieces.iter().zip(offsets).map(move |(sum, at)| (path.clone(), sum, at))
        });
        let sent = stream::iter(pieces).map(|(path, sum, at)| self.put_piece(path, sum, at));
        let sent: Vec<u64> = sent.buffer_unordered(REQUESTS).try_collect().await?;
        let listed = list.encode();
        let sum = sha256(&listed);
        self.put_new(&object_path(&sum), listed).await?;
        Ok((sum, sent.iter().sum()))
    }

    async fn put_piece(&self, path: PathBuf, sum: &str, at: u64) -> Result<u64, StoreError> {
        let failed = StoreError::file(&path);
        let mut file = File::open(&path).map_err(&failed)?;
        file.seek(SeekFrom::Start(at)).map_err(&failed)?;
        let mut piece = Vec::new();
        file.take(PIECE_BYTES).read_to_end(&mut piece).map_err(&failed)?;
        if sha256(&piece) != sum {
            let changed = io::Error::other("it changed while it was read");
            return Err(failed(changed));
        }
        let (object, bytes) = (object_path(sum), piece.len());
        if bytes >= LOOK_BYTES && self.size(&object).await? == Some(bytes as u64) {
            return Ok(0);
        }
        let is_new = self.put_new(&object, piece.into()).await?;
        Ok(if is_new { bytes as u64 } else { 0 })
    }

    /// The list of files of a version, whose bytes must have its SHA-256.
    pub(crate) async fn file_list(&self, sum: &str) -> Result<FileList, StoreError> {
        let path = object_path(sum);
        FileList::decode(&path, &self.checked(sum).await?)
    }

    /// The bytes of an object, which must have its SHA-256.
    pub(crate) async fn checked(&self, sum: &str) -> Result<Bytes, StoreError> {
        let path = object_path(sum);
        let bytes =
            self.read(&path).await?.ok_or_else(|| StoreError::bad(&path, "it is missing"))?;
        if sha256(&bytes) != sum {
            return Err(StoreError::bad(&path, "its bytes have another SHA-256 than its name"));
        }
        Ok(bytes)
    }

    /// Whether a version in the store continues the files of a folder: it has them all, and some of them with more lines.
    pub(crate) async fn continues(
        &self,
        theirs: &FileList,
        ours: &FileList,
        folder: &Path,
    ) -> Result<bool, StoreError> {
        for file in &ours.files {
            let Some(other) = theirs.files.iter().find(|other| other.name == file.name) else {
                return Ok(false);
            };
            if other.pieces == file.pieces || file.name.ends_with(HEAD_ENDING) {
                continue;
            }
            if !file.name.ends_with(LINES_ENDING) {
                return Ok(false);
            }
            let path = folder.join(&file.name);
            let own = std::fs::read(&path).map_err(StoreError::file(&path))?;
            let pieces = stream::iter(&other.pieces).map(|sum| self.checked(sum));
            let pieces: Vec<Bytes> = pieces.buffered(REQUESTS).try_collect().await?;
            if !pieces.concat().starts_with(&own) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Writes all files of a list below a folder.
    pub(crate) async fn fetch_files(
        &self,
        list: &FileList,
        folder: &Path,
    ) -> Result<(), StoreError> {
        for file in &list.files {
            let path = folder.join(&file.name);
            let failed = StoreError::file(&path);
            if let Some(parent) = path.parent() {
                std::fs::create_dir_all(parent).map_err(&failed)?;
            }
            let mut out = File::create(&path).map_err(&failed)?;
            let pieces = stream::iter(&file.pieces).map(|sum| self.checked(sum));
            let mut pieces = pieces.buffered(REQUESTS);
            while let Some(piece) = pieces.try_next().await? {
                out.write_all(&piece).map_err(&failed)?;
            }
            out.sync_all().map_err(&failed)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_never_lead_out_of_the_folder() {
        for bad in ["", "..", "../x", "a/../b", "/etc/passwd", "a//b", "C:x", "a\\b", "."] {
            assert!(!is_below(bad), "{bad}");
        }
        assert!(is_below("original/curve 1.tdms") && is_below("000.mcap"));
    }

    #[test]
    fn a_file_of_lines_may_grow_and_any_other_may_not() {
        let folder = tempfile::tempdir().unwrap();
        let write =
            |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("000.mcap", "log");
        write("edits.jsonl", "{}\n");
        write("edits.jsonl.head", "1");
        let Ok(files) = local_files(folder.path()) else { panic!("files") };
        let list = FileList::of("s", &files).unwrap();
        assert_eq!(list.first_not_continued(folder.path()).unwrap(), None);
        write("edits.jsonl", "{}\n{}\n");
        write("edits.jsonl.head", "2");
        write("analyses.jsonl", "{}\n");
        assert_eq!(list.first_not_continued(folder.path()).unwrap(), None);
        write("edits.jsonl", "[]\n{}\n");
        assert_eq!(list.first_not_continued(folder.path()).unwrap().unwrap(), "edits.jsonl");
        write("000.mcap", "log and more");
        assert_eq!(list.first_not_continued(folder.path()).unwrap().unwrap(), "000.mcap");
    }
}
