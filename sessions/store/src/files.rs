//! The files of a session as objects: each cut into pieces that are named by their SHA-256, and a list of them.
//!
//! An upload that was cut off goes on with the first piece that is missing, and a file to which lines were added shares
//! all its earlier whole pieces.

use crate::error::StoreError;
use crate::location::{REQUESTS, Store};
use crate::part::OTHER_BYTES;
use bytes::Bytes;
use futures_util::stream::{self, StreamExt, TryStreamExt};
use object_store::path::Path as ObjectPath;
use palpate_sessions::atomic::is_draft_name;
use palpate_sessions::text::sha256;
use palpate_sessions::{LOCK_FILE, SPARE_FILE};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use walkdir::WalkDir;

/// Version of the list of files.
const LIST_VERSION: u32 = 1;
/// Most bytes of a piece. Sixteen of them under way need 128 MiB.
pub(crate) const PIECE_BYTES: u64 = 8 << 20;
/// A piece of at least so many bytes is looked up before it is sent: looking takes as long as sending this much.
const LOOK_BYTES: u64 = 1 << 20;

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
    pub bytes: u64,
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
    let failed = |err: walkdir::Error| {
        let path = err.path().unwrap_or(session).to_owned();
        FolderFault::Unreadable(StoreError::File { path, source: err.into() })
    };
    for entry in entries {
        let entry = entry.map_err(failed)?;
        let name = entry.file_name().to_string_lossy();
        if entry.depth() == 1 && name == SPARE_FILE {
            return Err(FolderFault::Spare);
        }
        let is_lock = entry.depth() == 1 && name == LOCK_FILE;
        if entry.file_type().is_file() && !is_lock && !is_draft_name(&name) {
            let below = entry.path().strip_prefix(session).unwrap_or(entry.path());
            let parts = below.iter().map(|part| part.to_string_lossy());
            let name = parts.collect::<Vec<_>>().join("/");
            let bytes = entry.metadata().map_err(failed)?.len();
            files.push(LocalFile { name, path: entry.into_path(), bytes });
        }
    }
    files.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(files)
}

impl FileList {
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
        let failed = StoreError::file(path);
        let mut file = File::open(path).map_err(&failed)?.take(self.bytes);
        for sum in &self.pieces {
            let mut piece = Vec::new();
            (&mut file).take(PIECE_BYTES).read_to_end(&mut piece).map_err(&failed)?;
            if sha256(&piece) != *sum {
                return Ok(false);
            }
        }
        // A list whose pieces are fewer than its bytes says nothing of the rest.
        Ok(file.limit() == 0)
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

/// A piece of a local file, read.
struct Piece {
    bytes: Bytes,
    sum: String,
}

impl LocalFile {
    /// Where the file's pieces begin, by its length when it was found. An empty file has one piece, so that it is stored too.
    fn offsets(&self) -> impl Iterator<Item = u64> + use<> {
        (0..self.bytes.max(1)).step_by(PIECE_BYTES as usize)
    }

    fn read_piece(&self, at: u64) -> Result<Piece, StoreError> {
        let read = || -> io::Result<Vec<u8>> {
            let mut file = File::open(&self.path)?;
            file.seek(SeekFrom::Start(at))?;
            let mut bytes = Vec::new();
            file.take(PIECE_BYTES).read_to_end(&mut bytes)?;
            Ok(bytes)
        };
        let bytes = read().map_err(StoreError::file(&self.path))?;
        Ok(Piece { sum: sha256(&bytes), bytes: bytes.into() })
    }
}

struct StoredPiece {
    sum: String,
    bytes: u64,
    sent: u64,
}

/// A session whose files are to be stored.
#[derive(Debug)]
pub(crate) struct LocalFiles {
    pub session_id: String,
    pub files: Vec<LocalFile>,
}

/// A session whose files are stored.
pub(crate) struct StoredFiles {
    pub list: FileList,
    /// SHA-256 of the list.
    pub content: String,
    /// Bytes that were sent.
    pub sent: u64,
}

impl Store {
    /// Stores the pieces of sessions' files and then the lists of them. Every piece is read once, so that its object has its
    /// SHA-256 whatever happens to the file. `hear` is called with the number of finished sessions; after a break only these
    /// are in the answer.
    pub(crate) async fn put_sessions(
        &self,
        sessions: &[LocalFiles],
        hear: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Vec<StoredFiles>, StoreError> {
        // Pieces of one session and of several are under way at a time.
        let pieces = sessions.iter().flat_map(|session| {
            session.files.iter().flat_map(|file| file.offsets().map(move |at| (file, at)))
        });
        let mut sent = stream::iter(pieces)
            .map(|(file, at)| self.put_piece(file.clone(), at))
            .buffered(REQUESTS);
        let mut lists = Vec::new();
        for (done, session) in sessions.iter().enumerate() {
            let (mut files, mut bytes_sent) = (Vec::new(), 0);
            for file in &session.files {
                let (mut bytes, mut pieces) = (0, Vec::new());
                for _ in file.offsets() {
                    let Some(piece) = sent.try_next().await? else { break };
                    bytes += piece.bytes;
                    bytes_sent += piece.sent;
                    pieces.push(piece.sum);
                }
                files.push(StoredFile { name: file.name.clone(), bytes, pieces });
            }
            let session_id = session.session_id.clone();
            lists.push((FileList { list_version: LIST_VERSION, session_id, files }, bytes_sent));
            if hear(done + 1).is_break() {
                break;
            }
        }
        let stored = stream::iter(lists).map(|(list, sent)| async move {
            let encoded = list.encode();
            let content = sha256(&encoded);
            self.put_new(&object_path(&content), encoded).await?;
            Ok(StoredFiles { list, content, sent })
        });
        stored.buffered(REQUESTS).try_collect().await
    }

    async fn put_piece(&self, file: LocalFile, at: u64) -> Result<StoredPiece, StoreError> {
        // Reading and hashing on other threads leaves this one to the requests.
        let read = tokio::task::spawn_blocking(move || file.read_piece(at)).await;
        let Piece { bytes, sum } =
            read.map_err(|err| StoreError::Runtime(io::Error::other(err)))??;
        let (object, count) = (object_path(&sum), bytes.len() as u64);
        let is_known = count >= LOOK_BYTES && self.size(&object).await? == Some(count);
        let is_sent = !is_known && self.put_new(&object, bytes).await?;
        Ok(StoredPiece { sum, bytes: count, sent: if is_sent { count } else { 0 } })
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
            return Err(StoreError::bad(&path, OTHER_BYTES));
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
    use crate::StoreUrl;
    use object_store::memory::InMemory;
    use std::sync::Arc;

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
        let session = LocalFiles { session_id: "s".into(), files };
        let store = Store::of(StoreUrl::parse("s3://lab").unwrap(), Arc::new(InMemory::new()));
        let store = store.unwrap();
        let stored = store.wait(store.put_sessions(&[session], &mut |_| ControlFlow::Continue(())));
        let list = stored.unwrap().remove(0).list;
        assert_eq!(list.first_not_continued(folder.path()).unwrap(), None);
        write("edits.jsonl", "{}\n{}\n");
        write("edits.jsonl.head", "2");
        write("analyses.jsonl", "{}\n");
        assert_eq!(list.first_not_continued(folder.path()).unwrap(), None);
        let mut short = list.clone();
        for file in &mut short.files {
            file.pieces.clear();
        }
        assert_eq!(short.first_not_continued(folder.path()).unwrap().unwrap(), "000.mcap");
        write("edits.jsonl", "[]\n{}\n");
        assert_eq!(list.first_not_continued(folder.path()).unwrap().unwrap(), "edits.jsonl");
        write("000.mcap", "log and more");
        assert_eq!(list.first_not_continued(folder.path()).unwrap().unwrap(), "000.mcap");
    }
}
