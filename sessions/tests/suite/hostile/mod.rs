//! Files that are damaged or made to harm, of every kind that is read: no wrong number, no panic, and no more than
//! 64 MiB of memory.
//!
//! The reading is done by a process of its own whose address space may not grow by more, so that an allocation
//! that asks for more ends it, whether the memory is used or not.

mod corpus;
mod kinds;
mod mutate;
mod targets;

use crate::support::{Random, count_from, put, quick_folder};
use crate::worker::{command, reported_numbers};
use kinds::{Kind, Outcome};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What reading one file may take.
const MEMORY_MAX: u64 = 64 << 20;

/// From now on this process may not take more than so many bytes more.
pub fn limit_memory(more: u64) {
    let pages = fs::read_to_string("/proc/self/statm").expect("this is Linux");
    let pages = pages.split(' ').next().and_then(|pages| pages.parse::<u64>().ok());
    let now = pages.expect("a number of pages") * rustix::param::page_size() as u64;
    let limit = rustix::process::Rlimit { current: Some(now + more), maximum: Some(now + more) };
    rustix::process::setrlimit(rustix::process::Resource::As, limit)
        .expect("a limit can be lowered");
}

#[expect(
    clippy::disallowed_methods,
    reason = "how long a file takes is printed, and a budget is in seconds"
)]
fn now() -> Instant {
    Instant::now()
}

/// The work of a process: damages a kind of file so many times, and reads it.
pub fn damage(folder: &Path, name: &str, count: usize) {
    let kind = kinds::all().into_iter().find(|kind| kind.name == name);
    let kind = kind.expect("a kind of that name");
    let mut random = Random(count as u64);
    restore(&kind, folder);
    // What is only ever taken once, such as the threads of a pool, is not counted.
    assert_eq!((kind.read)(folder), Outcome::Whole, "{name}");
    limit_memory(MEMORY_MAX);
    let mut tally = BTreeMap::from([("refused", 0), ("short", 0), ("whole", 0)]);
    let mut slowest = Duration::ZERO;
    for case in 0..count {
        let (place, sound) = &kind.files[random.below(kind.files.len())];
        let mut bytes = sound.clone();
        let what = mutate::damage(&mut bytes, &mut random);
        // The parent tells the last line, should this be the end.
        eprintln!("case {case} of {name}: {what} in {place:?}");
        put(&folder.join(place), &bytes);
        let start = now();
        let outcome = (kind.read)(folder);
        slowest = slowest.max(now() - start);
        *tally.entry(outcome.word()).or_default() += 1;
        match kind.is_restored_whole {
            true => restore(&kind, folder),
            false => put(&folder.join(place), sound),
        }
    }
    for (word, count) in tally {
        eprintln!("{word} {count}");
    }
    eprintln!("slowest {}", slowest.as_micros());
}

fn restore(kind: &Kind, folder: &Path) {
    if kind.is_restored_whole {
        let _ = fs::remove_dir_all(folder);
    }
    for (place, bytes) in &kind.files {
        put(&folder.join(place), bytes);
    }
}

/// The work of a process: gives a parser its corpus, and what comes of mutating that.
pub fn fuzz(folder: &Path, name: &str, count: usize) {
    let target = targets::ALL.iter().find(|target| target.name == name);
    let target = target.expect("a target of that name");
    let corpus = corpus::read(name);
    assert!(!corpus.is_empty(), "no corpus for {name}");
    let input = folder.join("input");
    let mut slowest = Duration::ZERO;
    let mut run = |bytes: &[u8]| {
        put(&input, bytes);
        let start = now();
        (target.run)(bytes, folder);
        slowest = slowest.max(now() - start);
    };
    for (path, bytes) in &corpus {
        eprintln!("corpus {path}");
        run(bytes);
    }
    limit_memory(MEMORY_MAX);
    // Again: what once took too much memory is among them.
    corpus.iter().for_each(|(_, bytes)| run(bytes));
    let seconds = count_from("PALPATE_FUZZ_SECONDS", 0) as u64;
    let start = now();
    // Another budget goes other ways.
    let mut random = Random(count as u64 ^ seconds << 32);
    let mut done = 0;
    while done < count || now() - start < Duration::from_secs(seconds) {
        run(&mutate::input(&corpus, target.words, &mut random));
        done += 1;
    }
    eprintln!("done {done}\nslowest {}", slowest.as_micros());
}

/// Starts a process for a task and returns its output, or its last lines if it failed.
fn worked(task: &str) -> std::process::Output {
    let folder = quick_folder();
    let output = command(&[], task, folder.path())
        .env("POLARS_MAX_THREADS", "1")
        .output()
        .expect("a test is a program");
    if !output.status.success() {
        let stored = keep_input(folder.path(), task);
        let text = String::from_utf8_lossy(&output.stderr);
        let lines: Vec<&str> = text.lines().collect();
        let last = lines[lines.len().saturating_sub(12)..].join("\n");
        panic!("{task} ended with {}{stored}:\n{last}", output.status);
    }
    output
}

/// Keeps what was read last, to become a file of the corpus.
fn keep_input(folder: &Path, task: &str) -> String {
    let stored = std::env::temp_dir().join(format!("palpate-{}", task.replace(' ', "-")));
    match fs::copy(folder.join("input"), &stored) {
        Ok(_) => format!(", input stored as {}", stored.display()),
        Err(_) => String::new(),
    }
}

fn number(output: &std::process::Output, word: &str) -> u64 {
    reported_numbers(output, word).last().copied().unwrap_or(0)
}

/// Mutations of each kind of file; the soak script asks for more.
fn mutations() -> usize {
    count_from("PALPATE_MUTATIONS", 300)
}

#[test]
fn no_damaged_file_gives_a_wrong_number() {
    println!("kind                 mutations  refused    short    whole  slowest");
    for kind in kinds::all() {
        let output = worked(&format!("damage {} {}", kind.name, mutations()));
        let of = |word| number(&output, word);
        let (refused, short, whole) = (of("refused"), of("short"), of("whole"));
        let slowest_ms = of("slowest") as f64 / 1000.0;
        println!(
            "{:<20} {:>9} {refused:>8} {short:>8} {whole:>8} {slowest_ms:>6.1} ms",
            kind.name,
            mutations()
        );
        assert_eq!(refused + short + whole, mutations() as u64, "{}", kind.name);
        assert!(refused > 0, "{}: nothing was noticed", kind.name);
    }
}

#[test]
fn no_input_breaks_a_parser() {
    println!("target               inputs  slowest");
    for target in targets::ALL {
        let output = worked(&format!("fuzz {} {}", target.name, mutations()));
        let (done, slowest) = (number(&output, "done"), number(&output, "slowest"));
        let slowest_ms = slowest as f64 / 1000.0;
        println!("{:<18} {done:>8} {slowest_ms:>6.1} ms", target.name);
        assert!(done >= mutations() as u64, "{}", target.name);
    }
}

/// The limit is one: without it the tests above would say nothing about memory.
#[test]
fn more_memory_than_allowed_ends_a_process() {
    let folder = quick_folder();
    for (kib, is_allowed) in [(40 << 10, true), (65 << 10, false)] {
        let output = command(&[], &format!("greed any {kib}"), folder.path()).output();
        assert_eq!(output.unwrap().status.success(), is_allowed, "{kib} KiB");
    }
}

/// The work of a process: asks for memory that it does not use.
pub fn be_greedy(kib: usize) {
    limit_memory(MEMORY_MAX);
    let asked: Vec<u8> = Vec::with_capacity(kib << 10);
    eprintln!("room {}", asked.capacity());
}

/// The files of the corpus are small, and made by these tests.
#[test]
fn the_corpus_is_small_and_every_target_has_one() {
    let mut total = 0;
    for target in targets::ALL {
        let files = corpus::read(target.name);
        assert!(!files.is_empty(), "{}", target.name);
        for (path, bytes) in files {
            assert!(bytes.len() <= 8 << 10, "{path} has {} bytes", bytes.len());
            total += bytes.len();
        }
    }
    assert!(total < 100 << 10, "{total}");
    println!("corpus: {total} bytes");
}

/// Rebuilds the corpus in the folder `PALPATE_CORPUS`.
#[test]
fn what_the_corpus_is_made_of_can_be_made() {
    let chosen = std::env::var_os("PALPATE_CORPUS").map(PathBuf::from);
    let scratch = quick_folder();
    let folder = chosen.unwrap_or_else(|| scratch.path().into());
    let made = corpus::make(&folder);
    let targets: std::collections::BTreeSet<&str> = made.iter().map(String::as_str).collect();
    assert!(targets.iter().copied().eq(corpus::made_targets()), "{targets:?}");
}
