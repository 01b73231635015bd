//! What other tests do in a process of its own, which is this program started again: to kill it, to limit it, or to let
//! two do something at the same time.

use crate::support::{end, entries, manifest, raw_of, rows};
use crate::{foreign_damage, hostile, limits};
use chrono::DateTime;
use palpate_model::Nanos;
use palpate_sessions::atomic::Draft;
use palpate_sessions::journal::Journal;
use palpate_sessions::recover::{RecoverError, recover};
use palpate_sessions::{
    Edit, EditChange, FolderSegments, LogBatch, LogEntry, LogWriter, RecordingPace, SampleRow,
    SessionFolder, SessionWriter, add_edit,
};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Tells a process what to do, as words.
const TASK: &str = "PALPATE_WORKER";

/// What a recording process records.
pub struct Work {
    pub rows: Vec<SampleRow>,
    pub entries: Vec<LogEntry>,
}

impl Work {
    pub fn new(samples: usize) -> Self {
        let rows = rows(samples, 91);
        let entries = entries(&rows, 70);
        Self { rows, entries }
    }
}

/// A command that does a task in a folder, `program` and its arguments before it.
pub fn command(program: &[&str], task: &str, folder: &Path) -> Command {
    let own = std::env::current_exe().expect("a test is a program");
    let mut words: Vec<PathBuf> = program.iter().map(PathBuf::from).collect();
    words.push(own);
    let mut command = Command::new(&words[0]);
    command
        .args(&words[1..])
        .args(["worker::does_its_task", "--exact", "--nocapture"])
        .env(TASK, task)
        .env("PALPATE_WORKER_FOLDER", folder)
        // A second arena for memory would reserve 64 MiB of addresses that a limit counts.
        .env("MALLOC_ARENA_MAX", "1");
    command
}

/// The numbers that a process printed after a word, as in `saved 300`.
pub fn reported_numbers(output: &std::process::Output, word: &str) -> Vec<u64> {
    let text = String::from_utf8_lossy(&output.stderr);
    let numbers = text.lines().filter_map(|line| {
        let number = line.strip_prefix(word)?.strip_prefix(' ')?;
        number.parse().ok()
    });
    numbers.collect()
}

/// Only a process that was given a task has one.
#[test]
fn does_its_task() {
    let Ok(task) = std::env::var(TASK) else {
        return;
    };
    let folder = PathBuf::from(std::env::var_os("PALPATE_WORKER_FOLDER").unwrap());
    let mut words = task.split(' ');
    let what = words.next().unwrap();
    let name = words.next().filter(|word| word.parse::<usize>().is_err());
    let number = task.rsplit(' ').next().and_then(|word| word.parse().ok());
    let number = number.unwrap_or(0);
    match what {
        "log" => write_log(&folder, number),
        "session" => write_session(&folder, number),
        "recover" => recover_session(&folder),
        "edits" => write_edits(&folder, number),
        "journal" => write_journal(&folder, number),
        "spare" => limits::record_with_spare(&folder, number),
        "little" => limits::record_in_little_memory(&folder, number),
        "catalog" => limits::update_catalog(&folder),
        "hold" => hold(&folder),
        "lock" => lock(&folder.join(name.unwrap())),
        "draft" => draft(&folder.join(name.unwrap())),
        "sqlite" => lock_database(&folder.join(name.unwrap())),
        "workbook" => foreign_damage::read_workbook(&folder),
        "damage" => hostile::damage(&folder, name.unwrap(), number),
        "fuzz" => hostile::fuzz(&folder, name.unwrap(), number),
        "greed" => hostile::be_greedy(number),
        other => panic!("no task is called {other}"),
    }
}

/// Writes a log in segments of 30 batches, step by step, and tells what was handed to the system.
fn write_log(folder: &Path, samples: usize) {
    let work = Work::new(samples);
    let _held = SessionFolder::create(folder).unwrap();
    let source = Box::new(FolderSegments::new(folder));
    let mut log = LogWriter::begin_in_segments(source, 30, &manifest()).unwrap();
    let mut rest = &work.entries[..];
    for (number, batch) in work.rows.chunks(20).enumerate() {
        let stop = ((number + 1) * 20) as u64;
        let (due, later) = rest.split_at(rest.partition_point(|entry| entry.after_sample < stop));
        rest = later;
        eprintln!("taken {stop}");
        let parts = LogBatch { rows: batch, entries: due, raw: &raw_of(batch), health: &[] };
        log.append_batch(&parts).unwrap();
        eprintln!("saved {stop}");
        if number % 9 == 8 {
            log.sync().unwrap();
        }
    }
    log.finish(end(Nanos::from_millis(samples as u64))).unwrap();
}

/// Records with the writer thread, and tells what it calls saved.
fn write_session(folder: &Path, samples: usize) {
    let work = Work::new(samples);
    let _held = SessionFolder::create(folder).unwrap();
    let source = FolderSegments::new(folder);
    let mut writer =
        SessionWriter::start_in_segments(source, 40, &manifest(), RecordingPace::Virtual).unwrap();
    let mut pending = work.entries.iter().peekable();
    for (number, row) in work.rows.iter().enumerate() {
        while let Some(entry) = pending.next_if(|entry| entry.after_sample == number as u64) {
            writer.push_entry(entry.clone()).unwrap();
        }
        let raw = raw_of(std::slice::from_ref(row));
        writer.push_raw(row.host, raw).unwrap();
        writer.push_row(*row).unwrap();
        if number % 10 == 9 {
            let saved = writer.saved_through();
            let count = work.rows.partition_point(|one| one.host <= saved);
            let count = if saved == Nanos::ZERO { 0 } else { count };
            eprintln!("taken {}\nsaved {count}", number + 1);
        }
    }
    writer.close(end(Nanos::from_millis(samples as u64))).unwrap();
    eprintln!("saved {samples}");
}

/// Holds a folder until its input ends.
fn hold(folder: &Path) {
    let _held = SessionFolder::create(folder).unwrap();
    eprintln!("saved 0");
    std::io::read_to_string(std::io::stdin()).unwrap();
}

/// Locks a file until its input ends.
fn lock(file: &Path) {
    let file = std::fs::File::open(file).unwrap();
    file.lock().unwrap();
    eprintln!("saved 0");
    std::io::read_to_string(std::io::stdin()).unwrap();
}

/// Begins a file and does not finish it.
fn draft(file: &Path) {
    let draft = Draft::new(file).unwrap();
    draft.writer().write_all(b"half").unwrap();
    eprintln!("saved 0");
    std::io::read_to_string(std::io::stdin()).unwrap();
}

/// Locks a database for itself alone until its input ends.
fn lock_database(file: &Path) {
    let db = rusqlite::Connection::open(file).unwrap();
    db.execute_batch("PRAGMA locking_mode = EXCLUSIVE; BEGIN EXCLUSIVE; DELETE FROM tag;").unwrap();
    eprintln!("saved 0");
    std::io::read_to_string(std::io::stdin()).unwrap();
}

/// Tells 1 if it did it, 0 if another process was at it or had done it.
fn recover_session(folder: &Path) {
    match recover(folder, "1", DateTime::UNIX_EPOCH) {
        Ok(_) => eprintln!("saved 1"),
        Err(RecoverError::InProgress { .. } | RecoverError::Before { .. }) => eprintln!("saved 0"),
        Err(err) => panic!("{err:?}"),
    }
}

/// An edit as the worker makes it.
pub fn edit(number: usize) -> Edit {
    Edit {
        at: DateTime::UNIX_EPOCH,
        by: "Ada".into(),
        reason: format!("number {number}"),
        change: EditChange::Tags { add: vec![format!("tag-{number}")], remove: Vec::new() },
    }
}

fn write_edits(folder: &Path, count: usize) {
    for number in 1..=count {
        add_edit(folder, &manifest().session_id, &edit(number)).unwrap();
        eprintln!("saved {number}");
    }
}

fn write_journal(folder: &Path, count: usize) {
    let (mut journal, _) = Journal::open::<Edit>(folder).unwrap();
    for number in 1..=count {
        journal.push(&edit(number)).unwrap();
        eprintln!("saved {number}");
    }
}
