//! Runs the program and reads what it says.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

pub fn palpate(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(args)
        .current_dir(folder)
        .env("PALPATE_HOME", folder.join("library"))
        .stdin(Stdio::null())
        .output()
        .expect("palpate starts")
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

pub fn succeeded(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
}

/// A run short enough for a test: about 90 s of session time, most of it finding contact.
pub const SHORT: [&str; 8] = [
    "run",
    "ramp-hold",
    "--speed",
    "3",
    "--depth",
    "6",
    "--hold",
    "1",
];

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
        .find(|path| {
            path.extension()
                .is_some_and(|extension| extension == "mcap")
        })
        .expect("a log")
}
