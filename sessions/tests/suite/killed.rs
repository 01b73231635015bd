//! Processes that are killed at a chosen system call. What they called saved is there afterwards.
//!
//! `strace` does the killing: it counts the calls on the files of the test alone, thread by thread, and sends
//! SIGKILL at the one that is asked for.

use crate::support::{check_raw, count_from, log_bytes, manifest, read_raw, same_bits};
use crate::worker::{Work, command, edit, reported_numbers};
use palpate_sessions::journal::{JOURNAL_FILE, Journal};
use palpate_sessions::recover::{recover, recovered_folder, salvage};
use palpate_sessions::{EDITS_FILE, Edit, Edits, LOG_FILE, Session, SessionFolder, segment_file};
use palpate_test_support::skip;
use std::fs;
use std::path::{Path, PathBuf};

/// Whether processes cannot be killed at a system call here; if so the test is skipped.
pub fn is_hindered() -> bool {
    skip::lacks_program("strace")
        || skip::lacks_command("strace -f -qq -o /dev/null -e trace=write true")
}

/// What a killed process left.
struct KillOutcome {
    /// What it called saved last.
    saved: u64,
    /// What it had taken by then.
    taken: u64,
    was_killed: bool,
}

/// Does a task and kills it at the `number`-th call of a kind on the files named.
fn kill(task: &str, folder: &Path, files: &[PathBuf], call: &str, number: u32) -> KillOutcome {
    let inject = format!("inject={call}:signal=SIGKILL:when={number}");
    let trace = format!("trace={call}");
    let mut program = vec!["strace", "-f", "-qq", "-o", "/dev/null"];
    for file in files {
        program.extend(["-P", file.to_str().expect("a temporary folder has a plain name")]);
    }
    program.extend(["-e", &trace, "-e", &inject]);
    let output = command(&program, task, folder).output().expect("strace is there");
    let last = |word| reported_numbers(&output, word).last().copied().unwrap_or(0);
    KillOutcome { saved: last("saved"), taken: last("taken"), was_killed: !output.status.success() }
}

/// Calls that change what is on the disk.
const CALLS: [&str; 7] = ["write", "openat", "fdatasync", "fsync", "rename", "ftruncate", "mkdir"];

/// Kills a task at every call of every kind, or at so many evenly spread ones; `check` looks at what is left.
fn sweep(
    task: &str,
    points: usize,
    prepare: &dyn Fn(&Path) -> Vec<PathBuf>,
    check: &mut dyn FnMut(&Path, &KillOutcome, &str),
) -> usize {
    let mut killed = 0;
    for call in CALLS {
        // In the gate only the first, the third, the ninth and so on of each kind.
        let mut number = 1;
        let mut of_kind = 0;
        while of_kind < points {
            let parent = tempfile::tempdir().expect("a folder to work in");
            let folder = parent.path().join("session");
            let files = prepare(&folder);
            let outcome = kill(task, &folder, &files, call, number);
            let context = format!("{task}, killed at {call} {number}");
            check(&folder, &outcome, &context);
            if !outcome.was_killed {
                break;
            }
            of_kind += 1;
            number = if points < 10 { number * 3 } else { number + 1 };
        }
        killed += of_kind;
    }
    killed
}

/// Kills of each kind of call for each task: in the gate a few, in the soak script all.
fn points() -> usize {
    count_from("PALPATE_KILLS", 3)
}

fn log_files(folder: &Path) -> Vec<PathBuf> {
    let numbers = 0..8;
    let mut files: Vec<PathBuf> = numbers.map(|number| folder.join(segment_file(number))).collect();
    files.extend([folder.to_path_buf(), folder.join("lock")]);
    files
}

/// Nothing that was called saved is missing or changed; returns how many samples more and less than that are there.
fn check_recording(work: &Work, folder: &Path, outcome: &KillOutcome, context: &str) -> (u64, u64) {
    let saved = outcome.saved as usize;
    let session = match Session::open(folder) {
        Ok(session) => session,
        Err(refusal) => {
            assert_eq!(saved, 0, "{context}: {refusal}");
            return (0, outcome.taken);
        }
    };
    let count = session.rows.len();
    assert!(count >= saved, "{context}: {count} of {saved}");
    assert!(same_bits(&session.rows, &work.rows[..count]), "{context}");
    let raw = read_raw(folder).expect(context);
    check_raw(&raw, &work.rows, count, context);
    let entries = &work.entries[..session.entries.len()];
    assert_eq!(session.entries, entries, "{context}");
    let due = work.entries.partition_point(|entry| (entry.after_sample as usize) < saved);
    assert!(entries.len() >= due, "{context}: entries are missing");
    // The lock went with the process, and what is left can be recovered.
    drop(SessionFolder::create(folder).expect_err("a session is in it"));
    if session.end.is_none() {
        let copy = recover(folder, "1", chrono::DateTime::UNIX_EPOCH);
        let copy = Session::open(&copy.expect(context).folder).expect(context);
        assert!(same_bits(&copy.rows, &session.rows), "{context}");
        assert_eq!(copy.auxiliary, session.auxiliary, "{context}");
    }
    let taken = outcome.taken.max(count as u64);
    (count as u64 - outcome.saved, taken - count as u64)
}

#[test]
fn a_killed_recording_has_everything_it_called_saved() {
    if is_hindered() {
        return;
    }
    let (mut killed, mut most_more, mut most_less) = (0, 0, 0);
    for (task, samples) in [("log", 2000), ("session", 9000)] {
        let work = Work::new(samples);
        killed += sweep(
            &format!("{task} {samples}"),
            points(),
            &log_files,
            &mut |folder, outcome, context| {
                let (more, less) = check_recording(&work, folder, outcome, context);
                assert!(outcome.was_killed || less == 0, "{context}");
                (most_more, most_less) = (more.max(most_more), less.max(most_less));
            },
        );
    }
    println!(
        "{killed} crash points: no sample that was called saved is lost; at most {most_more} more are there, \
         at most {most_less} that were not called saved are lost"
    );
    // Samples are 1 ms apart.
    assert!(killed >= 5 && most_less <= 200, "{killed}, {most_less}");
}

/// What the simulated disk of the power cuts does, the real files do.
#[test]
fn a_session_is_on_the_disk_before_a_sample_is_taken() {
    if is_hindered() {
        return;
    }
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("sessions/one");
    let trace = parent.path().join("trace");
    let shown = trace.to_str().unwrap();
    let calls = "trace=write,fdatasync,fsync";
    let program = ["strace", "-f", "-y", "-qq", "-o", shown, "-e", calls];
    let output = command(&program, "log 60", &folder).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = fs::read_to_string(&trace).unwrap();
    let place = |call: &str, path: &Path| {
        let end = format!("<{}>", path.display());
        let is_it = |line: &&str| line.contains(call) && line.contains(&end);
        let found = text.lines().enumerate().find(|(_, line)| is_it(line));
        found.unwrap_or_else(|| panic!("no {call} of {end} in\n{text}")).0
    };
    let log = folder.join(LOG_FILE);
    let first = text.lines().position(|line| line.contains("\"taken \""));
    let order = [
        place("fsync", parent.path()),
        place("write", &log),
        place("fdatasync", &log),
        place("fsync", &folder),
        first.unwrap(),
    ];
    assert!(order.is_sorted(), "{order:?} in\n{text}");
    assert!(place("fsync", &parent.path().join("sessions")) < order[4]);
}

#[test]
fn a_killed_recovery_leaves_the_original_and_can_be_repeated() {
    if is_hindered() {
        return;
    }
    let work = Work::new(2000);
    let bytes = log_bytes(&work.rows, &work.entries, None);
    let prepare = |folder: &Path| {
        fs::create_dir(folder).expect("a folder to work in");
        fs::write(folder.join(LOG_FILE), &bytes).expect("a folder to work in");
        let copy = recovered_folder(folder);
        let unfinished = copy.with_extension("recovering");
        let log = unfinished.join(LOG_FILE);
        let parent = folder.parent().expect("it has one").to_path_buf();
        vec![parent, unfinished, log, copy]
    };
    let killed = sweep("recover", points(), &prepare, &mut |folder, outcome, context| {
        assert_eq!(fs::read(folder.join(LOG_FILE)).expect(context), bytes);
        let copy = recovered_folder(folder);
        if outcome.saved == 0 && !copy.exists() {
            recover(folder, "1", chrono::DateTime::UNIX_EPOCH).expect(context);
        }
        let copy = Session::open(&copy).expect(context);
        assert!(same_bits(&copy.rows, &work.rows), "{context}");
        assert_eq!(copy.entries, work.entries, "{context}");
        let salvage = salvage(folder, &mut |_| {}).expect(context);
        assert_eq!(salvage.samples, 2000, "{context}");
    });
    println!("{killed} crash points of a recovery");
    assert!(killed >= 3, "{killed}");
}

#[test]
fn a_killed_edit_counts_or_does_not() {
    if is_hindered() {
        return;
    }
    let mut killed = 0;
    for (task, file) in [("edits 6", EDITS_FILE), ("journal 6", JOURNAL_FILE)] {
        let prepare = |folder: &Path| {
            fs::create_dir(folder).expect("a folder to work in");
            vec![folder.join(file), folder.to_path_buf()]
        };
        killed += sweep(task, points(), &prepare, &mut |folder, outcome, context| {
            let found: Vec<Edit> = match file {
                JOURNAL_FILE => Journal::open(folder).expect(context).1,
                _ => Edits::read(folder, &manifest().session_id).expect(context).all,
            };
            assert!(found.len() as u64 >= outcome.saved, "{context}");
            assert!(found.len() as u64 <= outcome.saved + 1, "{context}");
            let expected: Vec<Edit> = (1..=found.len()).map(edit).collect();
            assert_eq!(found, expected, "{context}");
        });
    }
    println!("{killed} crash points of edits and journals");
    assert!(killed >= 4, "{killed}");
}
