//! Pushing sessions: their objects first, then one change of the table for several sessions.

use crate::error::StoreError;
use crate::files::{FileList, FolderFault, LocalFile, LocalFiles, StoredFiles, local_files};
use crate::location::Store;
use crate::mirror::{Hear, Mirror};
use crate::rows::{SessionRow, part};
use chrono::{DateTime, SecondsFormat, Utc};
use palpate_sessions::catalog::LocalSession;
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Sessions in one change of the table. More at once are fewer files of rows; fewer are sooner in the table.
const BATCH: usize = 64;
/// How often another writer may be faster before a push gives up: with sixteen writers each is first in time.
pub(crate) const TRIES_MAX: usize = 200;

/// Sessions to push.
#[derive(Clone, Copy, Debug)]
pub struct PushRequest<'a> {
    /// Below which each session has the folder of its entry.
    pub library: &'a Path,
    pub sessions: &'a [LocalSession],
    /// Whether sessions that were pushed as they are are looked at again, for objects that the store has lost.
    pub are_checked: bool,
}

/// Why a session was not pushed, although it could be.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PushRefusal {
    pub session: String,
    pub reason: String,
}

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PushOutcome {
    /// Sessions of which the store has a new version.
    pub pushed: Vec<String>,
    /// Sessions that the store has as they are.
    pub known: usize,
    /// Sessions that are being recorded, or whose recording was interrupted.
    pub unfinished: Vec<String>,
    pub refused: Vec<PushRefusal>,
    /// Bytes that were sent.
    pub bytes: u64,
}

/// A session whose objects are stored.
struct Stored<'a> {
    folder: PathBuf,
    local: &'a LocalSession,
    list: FileList,
    /// SHA-256 of the list.
    content: String,
}

/// What becomes of a session.
enum Verdict {
    Push { version: u64 },
    Known,
    Refused(String),
}

/// The files of a session, if it is one to push.
fn choose(
    mirror: &Mirror,
    folder: &Path,
    (local, are_checked): (&LocalSession, bool),
    outcome: &mut PushOutcome,
) -> Result<Option<Vec<LocalFile>>, StoreError> {
    let entry = &local.entry;
    let mut refuse = |reason: String| {
        outcome.refused.push(PushRefusal { session: entry.folder.clone(), reason });
    };
    if let Some(trouble) = &entry.trouble {
        refuse(trouble.clone());
        return Ok(None);
    }
    if entry.ending.is_none() {
        outcome.unfinished.push(entry.folder.clone());
        return Ok(None);
    }
    if !are_checked
        && mirror.catalog.is_pushed(folder, &local.fingerprint)?
        && mirror.catalog.mirrored_content(&entry.session_id)?.is_some()
    {
        outcome.known += 1;
        return Ok(None);
    }
    match local_files(folder) {
        Ok(files) => Ok(Some(files)),
        Err(FolderFault::Unreadable(err)) => Err(err),
        Err(FolderFault::Spare) => {
            refuse("a part of it is in a spare folder; recover it to one folder first".into());
            Ok(None)
        }
    }
}

impl Store {
    /// Pushes finished sessions. What the store has already is not
    /// sent again, and an upload that was cut off goes on.
    pub fn push(
        &self,
        mirror: &mut Mirror,
        request: PushRequest<'_>,
        now: fn() -> DateTime<Utc>,
        hear: Hear<'_>,
    ) -> Result<PushOutcome, StoreError> {
        let PushRequest { library, sessions, are_checked } = request;
        self.wait(self.probe(now()))?;
        self.wait(self.sessions().ensure(now()))?;
        mirror.update(self, &mut |_, _| ControlFlow::Continue(()))?;
        let mut outcome = PushOutcome::default();
        for (batch, first) in sessions.chunks(BATCH).zip((0..).step_by(BATCH)) {
            let mut chosen = Vec::new();
            for local in batch {
                let folder = library.join(&local.entry.folder);
                if let Some(files) = choose(mirror, &folder, (local, are_checked), &mut outcome)? {
                    let session_id = local.entry.session_id.clone();
                    chosen.push((folder, local, LocalFiles { session_id, files }));
                }
            }
            let known = first + batch.len() - chosen.len();
            let mut is_ended = hear(known, sessions.len()).is_break();
            let mut hear_batch = |done| {
                let flow = hear(known + done, sessions.len());
                is_ended |= flow.is_break();
                flow
            };
            let stored = self.put_chosen(chosen, &mut hear_batch, &mut outcome)?;
            self.list(mirror, stored, now, &mut outcome)?;
            if is_ended {
                return Err(StoreError::Ended);
            }
        }
        Ok(outcome)
    }

    /// Stores the files of sessions, all or until `hear` breaks.
    fn put_chosen<'a>(
        &self,
        chosen: Vec<(PathBuf, &'a LocalSession, LocalFiles)>,
        hear: &mut dyn FnMut(usize) -> ControlFlow<()>,
        outcome: &mut PushOutcome,
    ) -> Result<Vec<Stored<'a>>, StoreError> {
        let (places, files): (Vec<_>, Vec<_>) =
            chosen.into_iter().map(|(folder, local, files)| ((folder, local), files)).unzip();
        let put = self.wait(self.put_sessions(&files, hear))?;
        let mut stored = Vec::new();
        for ((folder, local), StoredFiles { list, content, sent }) in places.into_iter().zip(put) {
            outcome.bytes += sent;
            if local.is_unchanged(&folder) {
                stored.push(Stored { folder, local, list, content });
            } else {
                let reason = "it changed while it was read; push it once more".into();
                outcome.refused.push(PushRefusal { session: local.entry.folder.clone(), reason });
            }
        }
        Ok(stored)
    }

    /// Writes the rows of sessions whose files are stored. Of several writers one is first; the others read what it wrote.
    fn list(
        &self,
        mirror: &mut Mirror,
        stored: Vec<Stored<'_>>,
        now: fn() -> DateTime<Utc>,
        outcome: &mut PushOutcome,
    ) -> Result<(), StoreError> {
        for _ in 0..TRIES_MAX {
            let Some(table) = mirror.table()? else {
                return Err(self.sessions().gone());
            };
            let mut rows = Vec::new();
            let (mut refused, mut known) = (Vec::new(), 0);
            let at = now();
            for one in &stored {
                match self.verdict(mirror, one, &rows)? {
                    Verdict::Known => known += 1,
                    Verdict::Refused(reason) => {
                        let session = one.local.entry.folder.clone();
                        refused.push(PushRefusal { session, reason });
                    }
                    Verdict::Push { version } => {
                        let pushed_at = at.to_rfc3339_opts(SecondsFormat::Millis, true);
                        let (content, entry) = (one.content.clone(), one.local.entry.clone());
                        rows.push(SessionRow { version, content, pushed_at, entry });
                    }
                }
            }
            let is_there = rows.is_empty() || {
                let part = part(&rows, at)?;
                self.wait(self.sessions().append(table.version + 1, &table.schema, part, at))?
            };
            mirror.update(self, &mut |_, _| ControlFlow::Continue(()))?;
            if is_there {
                let is_refused = |one: &&Stored<'_>| {
                    refused.iter().any(|refusal| refusal.session == one.local.entry.folder)
                };
                let pushed = stored.iter().filter(|one| !is_refused(one));
                let pushed: Vec<_> = pushed
                    .map(|one| (one.folder.as_path(), one.local.fingerprint.as_str()))
                    .collect();
                mirror.catalog.set_pushed(&pushed)?;
                outcome.pushed.extend(rows.into_iter().map(|row| row.entry.session_id));
                outcome.known += known;
                outcome.refused.extend(refused);
                return Ok(());
            }
        }
        Err(StoreError::Crowded { tries: TRIES_MAX })
    }

    /// What becomes of a session after `rows` of the same change.
    fn verdict(
        &self,
        mirror: &Mirror,
        one: &Stored<'_>,
        rows: &[SessionRow],
    ) -> Result<Verdict, StoreError> {
        let id = &one.local.entry.session_id;
        if rows.iter().any(|row| row.entry.session_id == *id) {
            return Ok(Verdict::Refused(format!("another folder has session {id} too")));
        }
        let Some((version, content)) = mirror.catalog.mirrored_content(id)? else {
            return Ok(Verdict::Push { version: 1 });
        };
        if content == one.content {
            return Ok(Verdict::Known);
        }
        let theirs = self.wait(self.file_list(&content))?;
        Ok(match theirs.first_not_continued(&one.folder)? {
            None => Verdict::Push { version: version + 1 },
            Some(_) if self.wait(self.continues(&theirs, &one.list, &one.folder))? => {
                Verdict::Known
            }
            Some(file) => Verdict::Refused(format!(
                "version {version} in the store has another {file}; pull the session, and make the edits of this folder there"
            )),
        })
    }
}
