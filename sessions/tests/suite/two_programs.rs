//! Two programs at once: waits are limited, one of several wins, and nothing remains.

use crate::support::{count_from, end, log_bytes, manifest, rows};
use crate::worker::{command, edit, reported_numbers};
use palpate_model::Nanos;
use palpate_sessions::atomic::{find_leftovers, remove_leftovers};
use palpate_sessions::catalog::{CATALOG_FILE, Catalog, CatalogError};
use palpate_sessions::folder::LockTimeout;
use palpate_sessions::recover::{RecoverError, recover, recovered_folder};
use palpate_sessions::{
    ChainError, EDITS_FILE, EditError, LOG_FILE, Session, SessionFolder, add_edit,
};
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Stdio};

/// A process that has begun its task and does it until it is let go.
struct OtherProgram(Child);

impl OtherProgram {
    fn start(task: &str, folder: &Path) -> Self {
        let mut command = command(&[], task, folder);
        let piped = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = piped.spawn().expect("a test is a program");
        let mut errors = BufReader::new(child.stderr.take().expect("it is piped"));
        let mut line = String::new();
        errors.read_line(&mut line).expect("it says so");
        assert_eq!(line, "saved 0\n");
        Self(child)
    }

    /// Whether this process is reported as the holder, if the system shows one.
    fn is(&self, busy: &LockTimeout) -> bool {
        busy.holder.is_none_or(|number| number == self.0.id())
    }
}

impl Drop for OtherProgram {
    fn drop(&mut self) {
        drop(self.0.stdin.take());
        let _ = self.0.wait();
    }
}

#[test]
fn lock_on_edits_by_another_program_is_waited_for_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let id = manifest().session_id;
    add_edit(at, &id, &edit(1)).unwrap();
    let stranger = OtherProgram::start(&format!("lock {EDITS_FILE}"), at);
    match add_edit(at, &id, &edit(2)) {
        Err(EditError::Chain(ChainError::LockTimeout(busy))) => {
            assert!(stranger.is(&busy), "{busy}");
            assert!(busy.path.ends_with(EDITS_FILE), "{busy}");
        }
        other => panic!("{other:?}"),
    }
    drop(stranger);
    add_edit(at, &id, &edit(2)).unwrap();
}

#[test]
fn lock_on_the_catalog_by_another_program_is_waited_for_and_reported() {
    let library = tempfile::tempdir().unwrap();
    let at = library.path();
    let session = at.join("sessions/one");
    fs::create_dir_all(&session).unwrap();
    fs::write(session.join(LOG_FILE), log_bytes(&rows(100, 1), &[], Some(end(Nanos(0))))).unwrap();
    let count = || Catalog::with(at, |catalog| Ok(catalog.update(&mut |_, _| {})?.sessions));
    assert_eq!(count().unwrap(), 1);
    for task in ["lock catalog.lock".to_owned(), format!("sqlite {CATALOG_FILE}")] {
        let stranger = OtherProgram::start(&task, at);
        match count() {
            Err(CatalogError::LockTimeout(busy)) => assert!(stranger.is(&busy), "{busy}"),
            other => panic!("{task}: {other:?}"),
        }
        drop(stranger);
        assert_eq!(count().unwrap(), 1, "{task}");
    }
}

#[test]
fn drafts_of_a_killed_process_are_found_and_removed() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut killed = OtherProgram::start("draft killed.csv", at);
    let _going_on = OtherProgram::start("draft written.csv", at);
    assert!(find_leftovers(at, 1).is_empty());
    killed.0.kill().unwrap();
    killed.0.wait().unwrap();
    let abandoned = find_leftovers(at, 1);
    assert!(
        abandoned.len() == 1 && abandoned[0].to_string_lossy().contains("killed.csv"),
        "{abandoned:?}"
    );
    assert_eq!(remove_leftovers(at, 1), abandoned);
    assert_eq!(fs::read_dir(at).unwrap().count(), 1);
}

#[test]
fn of_many_recoveries_at_once_one_wins_and_nothing_is_left_over() {
    let parent = tempfile::tempdir().unwrap();
    for round in 0..count_from("PALPATE_ROUNDS", 3) {
        let folder = parent.path().join(format!("cut-{round}"));
        fs::create_dir(&folder).unwrap();
        let all = rows(20_000, 3);
        fs::write(folder.join(LOG_FILE), log_bytes(&all, &[], None)).unwrap();
        let children: Vec<Child> = (0..10)
            .map(|_| {
                let mut command = command(&[], "recover", &folder);
                let quiet = command.stdout(Stdio::null()).stderr(Stdio::piped());
                quiet.spawn().unwrap()
            })
            .collect();
        let outputs: Vec<_> =
            children.into_iter().map(|it| it.wait_with_output().unwrap()).collect();
        let won: u64 = outputs.iter().flat_map(|output| reported_numbers(output, "saved")).sum();
        assert_eq!(won, 1, "{outputs:?}");
        assert!(outputs.iter().all(|output| output.status.success()), "{outputs:?}");
        assert_eq!(Session::open(&recovered_folder(&folder)).unwrap().rows.len(), all.len());
        let again = recover(&folder, "1", chrono::DateTime::UNIX_EPOCH).unwrap_err();
        assert!(matches!(again, RecoverError::Before { .. }), "{again}");
        // The session and its copy, of each round so far.
        assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 2 * (round + 1));
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
    }
}

#[test]
fn a_session_named_by_its_log_is_the_same_session() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("cut");
    let held = SessionFolder::create(&folder).unwrap();
    let log = held.log_path();
    fs::write(&log, log_bytes(&rows(100, 3), &[], None)).unwrap();
    let refusal = || recover(&log, "1", chrono::DateTime::UNIX_EPOCH).unwrap_err();
    assert!(matches!(refusal(), RecoverError::InUse { .. }));
    drop(held);
    let another = fs::File::open(&folder).unwrap();
    another.lock().unwrap();
    assert!(matches!(refusal(), RecoverError::InProgress { path, .. } if path == log));
    drop(another);
    recover(&log, "1", chrono::DateTime::UNIX_EPOCH).unwrap();
}
