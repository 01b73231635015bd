//! A store under writers that race, connections that break and bytes that flip.

mod many;
mod results;

use crate::files::object_path;
use crate::part::row_count;
use crate::{Mirror, PushOutcome, PushRequest, Store, StoreError, StoreUrl};
use bytes::Bytes;
use chrono::{DateTime, Utc};
use futures_util::stream::BoxStream;
use object_store::memory::InMemory;
use object_store::path::Path as ObjectPath;
use object_store::{
    CopyOptions, GetOptions, GetResult, ListResult, MultipartUpload, ObjectMeta, ObjectStore,
    ObjectStoreExt, PutMode, PutMultipartOptions, PutOptions, PutPayload, PutResult, Result,
};
use palpate_sessions::catalog::{CatalogEntry, CatalogQuery, LocalSession};
use std::collections::BTreeMap;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Objects in memory behind a connection that breaks at drawn requests, before the store acts or before its answer arrives.
#[derive(Debug, Default)]
struct Faulty {
    objects: Arc<InMemory>,
    /// One request of so many breaks; none where zero.
    one_of: u64,
    requests: AtomicU64,
    seed: u64,
    /// Whether a name that is taken is overwritten.
    ignores_conditions: bool,
    /// Whether the name is looked for before the bytes have arrived.
    looks_early: bool,
    /// Whether another writer, who looked at the name in the same moment, overwrites every change of the table.
    overwrites_changes: bool,
    /// Whether the first answer to every request is lost and the request is sent again, as the library of the store does.
    sends_twice: bool,
}

impl std::fmt::Display for Faulty {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "a faulty store")
    }
}

impl Faulty {
    /// Whether this request breaks, and whether before the store acts.
    fn draw(&self) -> (bool, bool) {
        // SplitMix64 (Steele, Lea & Flood, OOPSLA 2014).
        let count = self.requests.fetch_add(1, Ordering::Relaxed) + 1;
        let mut z = (self.seed << 32).wrapping_add(count.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        (z.is_multiple_of(self.one_of), z & (1 << 40) == 0)
    }

    async fn with_faults<T>(&self, work: impl Future<Output = Result<T>>) -> Result<T> {
        let broken = || {
            Err(object_store::Error::Generic { store: "faulty", source: "connection reset".into() })
        };
        match self.draw() {
            (true, true) => broken(),
            (true, false) => {
                let _ = work.await;
                broken()
            }
            _ => work.await,
        }
    }
}

#[async_trait::async_trait]
impl ObjectStore for Faulty {
    async fn put_opts(
        &self,
        location: &ObjectPath,
        payload: PutPayload,
        mut options: PutOptions,
    ) -> Result<PutResult> {
        if self.looks_early && self.objects.head(location).await.is_err() {
            // The other requests that are under way go on.
            tokio::task::yield_now().await;
            options.mode = PutMode::Overwrite;
        }
        if self.ignores_conditions {
            options.mode = PutMode::Overwrite;
        }
        if self.sends_twice {
            let _ = self.objects.put_opts(location, payload.clone(), options.clone()).await;
        }
        let put = self.with_faults(self.objects.put_opts(location, payload, options)).await?;
        if self.overwrites_changes && location.as_ref().ends_with("1.json") {
            self.objects.put(location, "{}\n".into()).await?;
        }
        Ok(put)
    }

    async fn put_multipart_opts(
        &self,
        location: &ObjectPath,
        options: PutMultipartOptions,
    ) -> Result<Box<dyn MultipartUpload>> {
        self.objects.put_multipart_opts(location, options).await
    }

    async fn get_opts(&self, location: &ObjectPath, options: GetOptions) -> Result<GetResult> {
        self.with_faults(self.objects.get_opts(location, options)).await
    }

    fn delete_stream(
        &self,
        locations: BoxStream<'static, Result<ObjectPath>>,
    ) -> BoxStream<'static, Result<ObjectPath>> {
        self.objects.delete_stream(locations)
    }

    fn list(&self, prefix: Option<&ObjectPath>) -> BoxStream<'static, Result<ObjectMeta>> {
        self.objects.list(prefix)
    }

    async fn list_with_delimiter(&self, prefix: Option<&ObjectPath>) -> Result<ListResult> {
        self.objects.list_with_delimiter(prefix).await
    }

    async fn copy_opts(
        &self,
        from: &ObjectPath,
        to: &ObjectPath,
        options: CopyOptions,
    ) -> Result<()> {
        self.objects.copy_opts(from, to, options).await
    }
}

/// A rig with a library of sessions and a catalog of the store, in a folder of its own.
struct Rig {
    folder: tempfile::TempDir,
    store: Store,
    mirror: Mirror,
}

impl Rig {
    fn of(faulty: Faulty) -> Self {
        let url = StoreUrl::parse("s3://tests/lab").unwrap();
        let folder = tempfile::tempdir().unwrap();
        let mirror = Mirror::open(&folder.path().join("mirror")).unwrap();
        Self { store: Store::of(url, Arc::new(faulty)).unwrap(), mirror, folder }
    }

    fn with(objects: &Arc<InMemory>) -> Self {
        Self::of(Faulty { objects: objects.clone(), ..Faulty::default() })
    }

    fn library(&self) -> PathBuf {
        self.folder.path().join("library")
    }

    fn write(&self, session: &str, file: &str, text: &str) {
        let path = self.library().join(session).join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    /// A small session, finished.
    fn record(&self, session: &str) {
        self.write(session, "000.mcap", &format!("log of {session}"));
        self.write(session, "original/curve 1.txt", "1 2 3");
        self.write(session, "lock", "");
    }

    fn local(&self, session: &str) -> LocalSession {
        let read = LocalSession::read(&self.library().join(session));
        let entry = CatalogEntry {
            folder: session.into(),
            session_id: session.into(),
            specimen: format!("specimen of {session}"),
            ending: Some("completed".into()),
            ..CatalogEntry::default()
        };
        LocalSession { entry, ..read }
    }

    fn push(&mut self, sessions: &[&str]) -> Result<PushOutcome, StoreError> {
        let local: Vec<LocalSession> = sessions.iter().map(|one| self.local(one)).collect();
        self.push_local(&local, false)
    }

    fn push_local(
        &mut self,
        sessions: &[LocalSession],
        are_checked: bool,
    ) -> Result<PushOutcome, StoreError> {
        let request = PushRequest { library: &self.library(), sessions, are_checked };
        self.store.push(&mut self.mirror, request, now, &mut go_on)
    }

    fn pull(&mut self, session: &str) -> Result<PathBuf, StoreError> {
        let out = self.folder.path().join("pulled");
        self.mirror.update(&self.store, &mut go_on)?;
        let pulled = self.store.pull(&self.mirror, &[session.into()], &out, &mut go_on)?;
        Ok(pulled[0].folder.clone())
    }

    /// Version of each session in the table; panics on any fault.
    fn table(&self) -> BTreeMap<String, u64> {
        let faults = self.store.verify(true, &mut go_on).unwrap().faults;
        assert_eq!(faults, []);
        let mut fresh = Mirror::open(&self.folder.path().join("fresh")).unwrap();
        fresh.update(&self.store, &mut go_on).unwrap();
        let ids = fresh.catalog().mirrored_ids().unwrap();
        let version = |id: &String| fresh.catalog().mirrored_content(id).unwrap().unwrap().0;
        ids.iter().map(|id| (id.clone(), version(id))).collect()
    }
}

#[expect(clippy::disallowed_methods, reason = "names of files of rows have the time")]
fn now() -> DateTime<Utc> {
    Utc::now()
}

fn go_on(_: usize, _: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let entries = walkdir::WalkDir::new(folder).into_iter().map(Result::unwrap);
    let is_lock = |one: &walkdir::DirEntry| one.depth() == 1 && one.file_name() == "lock";
    let files = entries.filter(|one| one.file_type().is_file() && !is_lock(one));
    files
        .map(|one| {
            let name = one.path().strip_prefix(folder).unwrap().to_owned();
            (name, fs::read(one.path()).unwrap())
        })
        .collect()
}

#[test]
fn a_pulled_session_is_the_pushed_one_and_nothing_is_sent_twice() {
    let mut rig = Rig::with(&Arc::default());
    rig.record("a");
    rig.write("a", "empty", "");
    rig.write("a", "original/.hidden", "of another tester");
    rig.write("a", "original/lock", "not ours");
    // More than two pieces.
    let large: String = (0..1_300_000).map(|k| format!("{k:014}")).collect();
    rig.write("a", "001.mcap", &large);
    let pushed = rig.push(&["a"]).unwrap();
    assert_eq!(pushed.pushed, ["a"]);
    let folder = rig.pull("a").unwrap();
    assert_eq!(files(&folder), files(&rig.library().join("a")));
    assert!(!folder.join("lock").exists());
    let again = rig.push(&["a"]).unwrap();
    assert_eq!((again.known, again.bytes, again.pushed.len()), (1, 0, 0));
    // Another computer has the same session and knows nothing of the first.
    rig.mirror = Mirror::open(&rig.folder.path().join("other")).unwrap();
    let again = rig.push(&["a"]).unwrap();
    assert_eq!((again.known, again.bytes, again.pushed.len()), (1, 0, 0));
    assert_eq!(rig.table(), [("a".to_owned(), 1)].into());
    let found = rig
        .mirror
        .catalog()
        .find(&CatalogQuery { words: "specimen".into(), ..CatalogQuery::default() });
    assert_eq!(found.unwrap().count, 1);
}

#[test]
fn a_table_that_names_a_folder_elsewhere_pulls_nothing() {
    for name in ["../outside", "a/../../outside", "/outside", "..", "C:outside"] {
        let mut rig = Rig::with(&Arc::default());
        rig.record("a");
        let mut local = rig.local("a");
        local.entry.session_id = name.into();
        rig.push_local(&[local], false).unwrap();
        let before = files(rig.folder.path()).len();
        let refused = rig.pull(name).unwrap_err();
        assert!(matches!(refused, StoreError::Bad { .. }), "{name}: {refused}");
        assert_eq!(files(rig.folder.path()).len(), before, "{name}");
    }
}

#[test]
fn unfinished_sessions_and_spare_folders_are_not_pushed() {
    let mut rig = Rig::with(&Arc::default());
    rig.record("a");
    rig.record("b");
    rig.write("b", "spare", "/elsewhere");
    let mut unfinished = rig.local("a");
    unfinished.entry.ending = None;
    let mut damaged = rig.local("a");
    damaged.entry.trouble = Some("its log is damaged".into());
    let all = [unfinished, damaged, rig.local("b")];
    let outcome = rig.push_local(&all, false).unwrap();
    assert_eq!((outcome.unfinished.len(), outcome.refused.len(), outcome.pushed.len()), (1, 2, 0));
    assert!(outcome.refused[0].reason.contains("damaged"));
    assert!(outcome.refused[1].reason.contains("spare folder"));
    assert!(rig.table().is_empty());
}

#[test]
fn lines_that_two_people_add_meet_and_never_overwrite_each_other() {
    let objects = Arc::default();
    let (mut ada, mut bob) = (Rig::with(&objects), Rig::with(&objects));
    for rig in [&ada, &bob] {
        rig.record("a");
        rig.write("a", "edits.jsonl", "{1}\n");
    }
    ada.push(&["a"]).unwrap();
    ada.write("a", "edits.jsonl", "{1}\n{2}\n");
    assert_eq!(ada.push(&["a"]).unwrap().pushed, ["a"]);
    // Bob has only what was there before.
    let old = bob.push(&["a"]).unwrap();
    assert_eq!((old.known, old.pushed.len(), old.refused.len()), (1, 0, 0));
    bob.write("a", "edits.jsonl", "{1}\n{other}\n");
    let apart = bob.push(&["a"]).unwrap();
    assert_eq!((apart.known, apart.pushed.len()), (0, 0));
    assert!(apart.refused[0].reason.contains("another edits.jsonl"), "{:?}", apart.refused);
    assert_eq!(ada.table(), [("a".to_owned(), 2)].into());
    let folder = bob.pull("a").unwrap();
    assert_eq!(fs::read_to_string(folder.join("edits.jsonl")).unwrap(), "{1}\n{2}\n");
    assert!(matches!(bob.pull("b"), Err(StoreError::NoSession { .. })));
    fs::write(folder.join("000.mcap"), "mine").unwrap();
    assert!(matches!(bob.pull("a"), Err(StoreError::Different { .. })));
    assert_eq!(fs::read_to_string(folder.join("000.mcap")).unwrap(), "mine");
}

#[test]
fn of_racing_writers_every_session_is_listed_once() {
    let objects: Arc<InMemory> = Arc::default();
    let names: Vec<Vec<String>> = (0..8)
        .map(|rig| {
            let own = (0..6).map(move |k| format!("rig{rig}-{k}"));
            own.chain((0..3).map(|k| format!("shared-{k}"))).collect()
        })
        .collect();
    std::thread::scope(|scope| {
        for names in &names {
            let objects = &objects;
            scope.spawn(move || {
                let mut rig = Rig::with(objects);
                for name in names {
                    rig.record(name);
                    let outcome = rig.push(&[name]).unwrap();
                    assert_eq!(outcome.pushed.len() + outcome.known, 1, "{outcome:?}");
                }
            });
        }
        scope.spawn(|| {
            let rig = Rig::with(&objects);
            for _ in 0..5 {
                match rig.store.compact(now) {
                    // The writers may have made no table yet.
                    Ok(_) | Err(StoreError::NoTable { .. } | StoreError::Crowded { .. }) => {}
                    Err(err) => panic!("{err}"),
                }
                std::thread::sleep(Duration::from_millis(20));
            }
        });
    });
    let rig = Rig::with(&objects);
    let expected: BTreeMap<String, u64> =
        names.concat().into_iter().map(|name| (name, 1)).collect();
    assert_eq!(rig.table(), expected);
    let before = rig.store.compact(now).unwrap();
    assert_eq!((before.after, before.rows), (1, expected.len()));
    assert_eq!(rig.table(), expected);
    // The checkpoint says the same as all changes.
    let whole = rig.store.wait(async {
        let mut whole = crate::delta::Snapshot::default();
        for commit in rig.store.sessions().commits_from(0).await.unwrap() {
            whole.apply(&commit);
        }
        let known = rig.store.sessions().read_checkpoint().await.unwrap().unwrap();
        assert_eq!(known.parts, whole.parts);
        assert_eq!(known.metadata, whole.metadata);
        whole
    });
    assert_eq!(whole.parts.values().map(row_count).sum::<usize>(), expected.len());
}

#[test]
fn broken_connections_lose_nothing_and_list_nothing_twice() {
    for seed in 0..60 {
        let objects: Arc<InMemory> = Arc::default();
        let mut rig =
            Rig::of(Faulty { objects: objects.clone(), one_of: 6, seed, ..Faulty::default() });
        let names = ["a", "b", "c"];
        names.iter().for_each(|name| rig.record(name));
        let mut tries = 0;
        while rig.push(&names).is_err() {
            tries += 1;
            // A push of three sessions has some 25 requests, of which each breaks with 1/6: one in a hundred succeeds.
            assert!(tries < 5000, "seed {seed}");
        }
        let table = Rig::with(&objects).table();
        assert_eq!(table, names.map(|name| (name.to_owned(), 1)).into(), "seed {seed}");
    }
}

#[test]
fn a_change_that_arrived_without_its_answer_keeps_its_rows() {
    let objects: Arc<InMemory> = Arc::default();
    let faulty = Faulty { objects: objects.clone(), sends_twice: true, ..Faulty::default() };
    let mut rig = Rig::of(faulty);
    for name in ["a", "b", "c"] {
        rig.record(name);
        assert_eq!(rig.push(&[name]).unwrap().pushed, [name]);
    }
    assert_eq!(rig.store.compact(now).unwrap().after, 1);
    assert_eq!(Rig::with(&objects).table().len(), 3);
}

#[test]
fn a_store_that_overwrites_names_is_refused_before_anything_is_sent() {
    let objects: Arc<InMemory> = Arc::default();
    let mut rig =
        Rig::of(Faulty { objects: objects.clone(), ignores_conditions: true, ..Faulty::default() });
    rig.record("a");
    let refused = rig.push(&["a"]).unwrap_err().to_string();
    assert!(refused.contains("If-None-Match"), "{refused}");
    let rig = Rig::with(&objects);
    assert!(rig.store.wait(rig.store.sessions().snapshot()).unwrap().is_none());
}

#[test]
fn a_change_that_another_writer_overwrote_is_no_push() {
    let objects: Arc<InMemory> = Arc::default();
    let mut rig =
        Rig::of(Faulty { objects: objects.clone(), overwrites_changes: true, ..Faulty::default() });
    rig.record("a");
    let refused = rig.push(&["a"]).unwrap_err().to_string();
    assert!(refused.contains("If-None-Match"), "{refused}");
    // Nothing says that it was pushed, so that a better store gets it.
    rig.store = Rig::with(&objects).store;
    assert_eq!(rig.push(&["a"]).unwrap().pushed, ["a"]);
    assert_eq!(rig.table(), [("a".to_owned(), 1)].into());
}

#[test]
fn a_flipped_byte_anywhere_is_found() {
    let objects: Arc<InMemory> = Arc::default();
    let mut rig = Rig::with(&objects);
    rig.record("a");
    rig.push(&["a"]).unwrap();
    let (_, content) = rig.mirror.catalog().mirrored_content("a").unwrap().unwrap();
    let list = rig.store.wait(rig.store.file_list(&content)).unwrap();
    let sums = list.files.iter().flat_map(|file| file.pieces.clone()).chain([content]);
    let commit = rig.store.wait(rig.store.sessions().read_commit(1)).unwrap().unwrap();
    let part = commit.actions.iter().find_map(|one| one.add.clone()).unwrap().path;
    let paths = sums.map(|sum| object_path(&sum)).chain([rig.store.sessions().path(&part)]);
    for path in paths {
        let whole: Bytes = rig.store.wait(rig.store.read(&path)).unwrap().unwrap();
        for at in 0..whole.len() {
            let mut bytes = whole.to_vec();
            bytes[at] ^= 0x10;
            rig.store.wait(objects.put(&path, bytes.into())).unwrap();
            let found = rig.store.verify(true, &mut go_on);
            assert!(!found.unwrap().faults.is_empty(), "byte {at} of {path}");
        }
        rig.store.wait(objects.put(&path, whole.into())).unwrap();
    }
    assert_eq!(rig.table(), [("a".to_owned(), 1)].into());
    let path = rig.store.sessions().commit_path(1);
    rig.store.wait(objects.put(&path, "{".into())).unwrap();
    assert!(matches!(rig.store.verify(true, &mut go_on), Err(StoreError::Bad { .. })));
}

#[test]
fn another_table_at_the_same_place_is_read_from_its_start() {
    let objects: Arc<InMemory> = Arc::default();
    let mut rig = Rig::with(&objects);
    rig.record("a");
    rig.push(&["a"]).unwrap();
    let mut other = Rig::with(&Arc::default());
    other.record("b");
    other.push(&["b"]).unwrap();
    std::mem::swap(&mut rig.store, &mut other.store);
    rig.mirror.update(&rig.store, &mut go_on).unwrap();
    assert_eq!(rig.mirror.catalog().mirrored_ids().unwrap(), ["b"]);
}

#[test]
fn a_lost_object_is_sent_again_where_its_session_is_checked() {
    let objects: Arc<InMemory> = Arc::default();
    let mut rig = Rig::with(&objects);
    rig.record("a");
    rig.push(&["a"]).unwrap();
    let (_, content) = rig.mirror.catalog().mirrored_content("a").unwrap().unwrap();
    let list = rig.store.wait(rig.store.file_list(&content)).unwrap();
    for lost in [content, list.files[0].pieces[0].clone()] {
        rig.store.wait(objects.delete(&object_path(&lost))).unwrap();
        // Without a look at the store the session is as it was pushed.
        assert_eq!(rig.push(&["a"]).unwrap().known, 1);
        assert!(!rig.store.verify(false, &mut go_on).unwrap().faults.is_empty());
        let local = rig.local("a");
        let again = rig.push_local(&[local], true).unwrap();
        assert_eq!((again.known, again.pushed.len()), (1, 0));
        assert_eq!(rig.store.verify(true, &mut go_on).unwrap().faults, []);
    }
    assert_eq!(rig.table(), [("a".to_owned(), 1)].into());
}
