//! Runs the program and reads what it says.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

/// The program at work in a folder with a library of its own, without anybody at its terminal.
pub fn command(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
    command
        .args(args)
        .current_dir(folder)
        .env("PALPATE_HOME", folder.join("library"))
        .stdin(Stdio::null());
    command
}

pub fn palpate(folder: &Path, args: &[&str]) -> Output {
    command(folder, args).output().expect("palpate starts")
}

/// The program beside the test, unheard.
pub fn background(folder: &Path, line: &str) -> Child {
    let mut command = command(folder, &split_words(line));
    let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    child.expect("palpate starts")
}

/// As [`palpate`], of words with a blank between them.
pub fn typed(folder: &Path, line: &str) -> Output {
    palpate(folder, &split_words(line))
}

/// The words of a command line in which nothing is quoted.
pub fn split_words(line: &str) -> Vec<&str> {
    line.split(' ').collect()
}

pub fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

pub fn json(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&text).unwrap_or_else(|err| panic!("{err}: {text}{}", stderr(output)))
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[track_caller]
pub fn succeeded(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
}

/// What it answered to `--json`, when it has succeeded.
#[track_caller]
pub fn answer(output: &Output) -> Value {
    succeeded(output);
    json(output)
}

/// Standard error contains this.
#[track_caller]
pub fn assert_says(output: &Output, fact: &str) {
    let message = stderr(output);
    assert!(message.contains(fact), "no {fact:?} in: {message}");
}

/// What was printed has this in it.
#[track_caller]
pub fn assert_prints(output: &Output, fact: &str) {
    let message = stdout(output);
    assert!(message.contains(fact), "no {fact:?} in: {message}");
}

/// It ended with this exit code, and a sentence that has this in it.
#[track_caller]
pub fn assert_refused(output: &Output, code: i32, fact: &str) {
    assert_eq!(output.status.code(), Some(code), "{}", stderr(output));
    assert_says(output, fact);
}

/// A run short enough for a test: about 90 s of session time, most of it finding contact.
pub const SHORT: [&str; 8] = ["run", "ramp-hold", "--speed", "3", "--depth", "6", "--hold", "1"];

pub fn short_run(folder: &Path, out: &str, more: &[&str]) -> Output {
    let mut args = SHORT.to_vec();
    args.extend(["--time-scale", "max", "--out", out]);
    args.extend(more);
    palpate(folder, &args)
}

pub fn log_file(session: &Path) -> PathBuf {
    std::fs::read_dir(session)
        .expect("a session folder")
        .flatten()
        .map(|entry| entry.path())
        .find(|path| path.extension().is_some_and(|extension| extension == "mcap"))
        .expect("a log")
}
