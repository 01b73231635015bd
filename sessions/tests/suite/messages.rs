//! Wording of the errors of sessions, folders and tables.

use palpate_sessions::catalog::ConditionError;
use palpate_sessions::{FolderError, LockError, LogError, ReadError};
use palpate_tables::import::WeightsError;
use palpate_test_support::assert_messages;
use std::io::ErrorKind;
use std::path::PathBuf;

fn path() -> PathBuf {
    "/data/one".into()
}

#[test]
fn read_errors_are_worded() {
    assert_messages! {
        ReadError::Missing { path: path() } => ["/data/one"],
        ReadError::NotASession { path: path(), reason: "it holds no log".into() } => ["/data/one", "it holds no log"],
        ReadError::Newer { path: path(), software_version: "3.1.4".into(), record_version: 9 } => ["/data/one", "3.1.4", "9", "update palpate"],
        ReadError::Damaged { path: path(), offset: 77, reason: "a wrong checksum".into() } => ["/data/one", "byte 77", "a wrong checksum"],
        ReadError::Io { path: path(), source: ErrorKind::PermissionDenied.into() } => ["/data/one", "permission denied"],
    }
    // The front end adds the remedy.
    let damaged = ReadError::Damaged { path: path(), offset: 77, reason: "torn".into() };
    assert!(!damaged.to_string().contains("palpate"), "{damaged}");
}

#[test]
fn write_errors_are_worded() {
    let path = || "/data/000.mcap".to_owned();
    assert_messages! {
        LogError::Disk { reason: "no room".into(), path: path() } => ["no room", "/data/000.mcap"],
        LogError::TooSlow { seconds: 20, path: path() } => ["20 s", "/data/000.mcap"],
        LogError::NotFinite { what: "force".into() } => ["force"],
        LogError::OutOfOrder { order: 3, previous: 5 } => ["3", "5"],
        LogError::Encode { what: "manifest", reason: "too long".into() } => ["manifest", "too long"],
        LogError::Closed => ["closed"],
    }
}

#[test]
fn folder_and_condition_errors_are_worded() {
    assert_messages! {
        FolderError::NotEmpty { path: path() } => ["/data/one"],
        FolderError::NotAFolder { path: path() } => ["/data/one"],
        FolderError::Io { path: path(), source: ErrorKind::PermissionDenied.into() } => ["/data/one", "permission denied"],
        FolderError::Lock(LockError::Held { path: path(), holder: "4711".into() }) => ["/data/one", "4711"],
        FolderError::NoSpace { path: path(), free_bytes: 1_000_000, needed_bytes: 9_000_000 } => ["/data/one", "1", "9"],
        FolderError::NoLibrary => ["PALPATE_HOME"],
    }
    let text = || "depth=x".to_owned();
    assert_messages! {
        ConditionError::Form { text: text() } => ["'depth=x'"],
        ConditionError::Words { text: text(), value: "slow".into() } => ["'depth=x'", "'slow'"],
        ConditionError::Field { text: text(), name: "depht".into(), known: "tag, rig".into() } => ["'depth=x'", "'depht'", "tag, rig"],
        ConditionError::NoWords { text: text() } => ["'depth=x'"],
        ConditionError::Units { text: text(), name: "mm".into(), value: "cm".into() } => ["'depth=x'", "mm", "cm"],
    }
}

#[test]
fn weights_errors_are_worded() {
    let cell = || "one".to_owned();
    assert_messages! {
        WeightsError::NoColumn { expected: "mass_g" } => ["mass_g"],
        WeightsError::Cell { line: 3, column: "volts", cell: cell(), expected: "a number" } => ["line 3", "\"one\"", "volts", "a number"],
        WeightsError::Comma { line: 3, cell: cell() } => ["line 3", "\"one\""],
        WeightsError::Falling { line: 4, mass_g: 50.0, before_g: 100.0 } => ["line 4", "50 g", "100 g"],
    }
}
