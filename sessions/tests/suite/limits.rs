//! Faults of the system that real processes meet: a full disk, a limit on files or memory, an error of the disk,
//! another process at the same files.

use crate::hostile::limit_memory;
use crate::killed::is_hindered;
use crate::support::{end, log_bytes, manifest, rows, same_bits};
use crate::worker::{Work, command, reported_numbers};
use palpate_model::Nanos;
use palpate_sessions::recover::recovered_folder;
use palpate_sessions::{
    Catalog, FolderError, LOG_FILE, LockError, LogNotice, RecordingPace, Session, SessionFolder,
    SessionWriter, segment_file,
};
use palpate_test_support::skip::{CAN_MOUNT, lacks_command};
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// The work of a process: records on a disk, or under a limit, that will not take it all, with another place to go
/// to; then reads it back.
pub fn record_with_spare(folder: &Path, samples: usize) {
    let work = Work::new(samples);
    let held = SessionFolder::create(&folder.join("one")).unwrap();
    // On the disk of the system, whatever is full here.
    let spare = tempfile::tempdir().unwrap();
    let mut writer =
        SessionWriter::start(held, Some(spare.path()), &manifest(), RecordingPace::Virtual)
            .unwrap();
    let mut pending = work.entries.iter().peekable();
    for (number, row) in work.rows.iter().enumerate() {
        while let Some(entry) = pending.next_if(|entry| entry.after_sample == number as u64) {
            writer.push_entry(entry.clone()).unwrap();
        }
        writer.push_row(*row).unwrap();
        if number == samples / 2 {
            // Long enough to be synchronised: what is written again is the second half, or less.
            std::thread::sleep(std::time::Duration::from_millis(1500));
        }
    }
    let news = writer.notices();
    writer.close(end(Nanos::from_millis(samples as u64))).unwrap();
    for notice in news.take() {
        let LogNotice::Moved { reason, is_last, .. } = &notice else {
            panic!("{notice}");
        };
        eprintln!("moved {}\nreason {reason}", u8::from(*is_last));
    }
    let session = Session::open(&folder.join("one")).unwrap();
    assert!(same_bits(&session.rows, &work.rows));
    assert_eq!(session.entries, work.entries);
    assert!(session.end.is_some());
    eprintln!("saved {}", session.rows.len());
}

/// The work of a process: records as much as its task says, with little memory.
pub fn record_in_little_memory(folder: &Path, samples: usize) {
    let work = Work::new(samples);
    let held = SessionFolder::create(&folder.join("one")).unwrap();
    let mut writer = SessionWriter::start(held, None, &manifest(), RecordingPace::Virtual).unwrap();
    limit_memory(60 << 20);
    for row in &work.rows {
        writer.push_row(*row).unwrap();
    }
    writer.close(end(Nanos::from_millis(samples as u64))).unwrap();
    eprintln!("saved {samples}");
}

/// The work of a process: brings the catalog of a library up to date.
pub fn update_catalog(library: &Path) {
    let found = Catalog::with(library, |catalog| {
        catalog.update(&mut |_, _| {})?;
        catalog.all()
    });
    eprintln!("saved {}", found.unwrap().len());
}

fn reasons(output: &std::process::Output) -> String {
    String::from_utf8_lossy(&output.stderr)
        .lines()
        .filter_map(|line| line.strip_prefix("reason "))
        .collect::<Vec<_>>()
        .join("; ")
}

#[test]
fn a_disk_that_is_really_full_sends_the_recording_elsewhere() {
    if lacks_command(CAN_MOUNT) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mounted = folder.path().join("small");
    fs::create_dir(&mounted).unwrap();
    let script =
        format!("mount -t tmpfs -o size=256k none '{}' && exec \"$0\" \"$@\"", mounted.display());
    let own_disk = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c"];
    let program = [&own_disk[..], &[&script]].concat();
    let output = command(&program, "spare 40000", &mounted).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    assert_eq!(reported_numbers(&output, "moved"), [1], "it is the last place");
    assert!(reasons(&output).contains("No space left on device"), "{output:?}");
    assert_eq!(reported_numbers(&output, "saved"), [40_000]);
}

#[test]
fn a_file_that_may_not_grow_is_left_for_another() {
    let folder = tempfile::tempdir().unwrap();
    // In blocks of 512 bytes; the signal that would end the process is ignored.
    let script = "trap '' XFSZ; ulimit -f 400; exec \"$0\" \"$@\"";
    let output = command(&["sh", "-c", script], "spare 15000", folder.path()).output();
    let output = output.unwrap();
    assert!(output.status.success(), "{output:?}");
    assert!(reasons(&output).contains("File too large"), "{output:?}");
    assert!(folder.path().join("one").join(segment_file(1)).exists());
    assert_eq!(reported_numbers(&output, "saved"), [15_000]);
}

#[test]
fn a_recording_takes_little_memory_however_long_it_is() {
    let folder = tempfile::tempdir().unwrap();
    // All samples would take 96 MB.
    let output = command(&[], "little 800000", folder.path()).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let mut samples = 0;
    let path = folder.path().join("one");
    Session::scan(&path, &mut |block| samples += block.len()).unwrap();
    assert_eq!(samples, 800_000);
}

/// What makes calls of this name on this file fail, those that `when` numbers.
fn failing(file: &Path, call: &str, error: &str, when: &str) -> Vec<String> {
    let shown = file.to_str().unwrap();
    let trace = format!("trace={call}");
    let inject = format!("inject={call}:error={error}:when={when}");
    let quiet = ["strace", "-f", "-qq", "-o", "/dev/null"];
    let what = ["-P", shown, "-e", &trace, "-e", &inject];
    [&quiet[..], &what].concat().into_iter().map(Into::into).collect()
}

fn words(program: &[String]) -> Vec<&str> {
    program.iter().map(String::as_str).collect()
}

#[test]
fn an_error_of_the_disk_costs_a_real_recording_nothing() {
    if is_hindered() {
        return;
    }
    let work = Work::new(3000);
    for (call, number) in [("write", 4), ("write", 11), ("fdatasync", 2), ("fdatasync", 5)] {
        let folder = tempfile::tempdir().unwrap();
        let session = folder.path().join("one");
        let log = session.join(LOG_FILE);
        let program = failing(&log, call, "EIO", &format!("{number}+"));
        let output = command(&words(&program), "session 3000", &session).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        let read = Session::open(&session).unwrap();
        assert!(same_bits(&read.rows, &work.rows), "{call} {number}");
        assert_eq!(read.entries, work.entries);
        let notes = read.notes.join("; ");
        assert!(notes.contains("000.mcap failed"), "{notes}");
    }
}

#[test]
fn disk_error_during_a_recovery_is_reported_and_leaves_the_original() {
    if is_hindered() {
        return;
    }
    let rows = rows(1500, 92);
    let bytes = log_bytes(&rows, &[], None);
    for (call, number, error) in
        [("write", 1, "EIO"), ("write", 3, "ENOSPC"), ("fdatasync", 2, "EIO")]
    {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("one");
        fs::create_dir(&folder).unwrap();
        fs::write(folder.join(LOG_FILE), &bytes).unwrap();
        let copy = recovered_folder(&folder);
        let log = copy.with_extension("recovering").join(LOG_FILE);
        let program = failing(&log, call, error, &number.to_string());
        let output = command(&words(&program), "recover", &folder).output().unwrap();
        let output_text = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{call} {number}: {output_text}");
        assert!(output_text.contains("Disk {"), "{output_text}");
        assert!(!copy.exists());
        assert_eq!(fs::read(folder.join(LOG_FILE)).unwrap(), bytes);
        let output = command(&[], "recover", &folder).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        assert!(same_bits(&Session::open(&copy).unwrap().rows, &rows));
    }
}

#[test]
fn two_processes_never_record_in_one_folder() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("one");
    let held = SessionFolder::create(&folder).unwrap();
    let output = command(&[], "log 100", &folder).output().unwrap();
    assert!(!output.status.success());
    let output_text = String::from_utf8_lossy(&output.stderr);
    let holder = format!("holder: \"{}\"", std::process::id());
    assert!(output_text.contains(&holder), "{output_text}");
    drop(held);
    // The other way round: the process is named by its number.
    let mut child = command(&[], "hold", &folder)
        .stdin(std::process::Stdio::piped())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let mut output_text = BufReader::new(child.stderr.take().unwrap());
    output_text.read_line(&mut String::new()).unwrap();
    let refusal = SessionFolder::create(&folder).unwrap_err();
    let FolderError::Lock(LockError::Held { holder, .. }) = refusal else {
        panic!("{refusal}");
    };
    assert_eq!(holder, child.id().to_string());
    // Its input ends, and so does it.
    drop(child.stdin.take());
    assert!(child.wait_with_output().unwrap().status.success());
    SessionFolder::create(&folder).unwrap();
}

#[test]
fn two_processes_make_one_catalog() {
    let library = tempfile::tempdir().unwrap();
    for number in 0..12 {
        let folder = library.path().join(format!("sessions/s{number}"));
        fs::create_dir_all(&folder).unwrap();
        let bytes = log_bytes(&rows(200, number), &[], Some(end(Nanos::ZERO)));
        fs::write(folder.join(LOG_FILE), bytes).unwrap();
    }
    let children: Vec<_> = (0..4)
        .map(|_| {
            let mut command = command(&[], "catalog", library.path());
            command.stdout(std::process::Stdio::null());
            command.stderr(std::process::Stdio::piped());
            command.spawn().unwrap()
        })
        .collect();
    for child in children {
        let output = child.wait_with_output().unwrap();
        assert_eq!(reported_numbers(&output, "saved"), [12], "{output:?}");
    }
    let catalog = Catalog::open(library.path()).unwrap();
    assert_eq!(catalog.check(&mut |_, _| {}).unwrap(), []);
}
