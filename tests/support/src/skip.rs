//! Tests that cannot run on a computer say so in one way, and are counted.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

/// A software renderer for Vulkan is here: Mesa's lavapipe.
pub const HAS_RENDERER: &str = "ls /usr/share/vulkan/icd.d/lvp*";

/// File systems can be mounted in a namespace of one's own.
pub const CAN_MOUNT: &str = "unshare -Urm mount -t tmpfs none /tmp";

/// Names the file that gets a line for every test that is skipped, as `scripts/skipped` reads them.
const LIST: &str = "PALPATE_SKIPPED";

/// A requirement of a test that a computer may lack.
#[derive(Clone, Copy, Debug)]
pub enum TestNeed<'a> {
    Program(&'a str),
    /// A package that `python3` imports.
    Python(&'a str),
    File(&'a Path),
    /// A command of the shell that succeeds.
    Command(&'a str),
    /// A computer that is in time in one of so many runs.
    RealTime(usize),
}

impl TestNeed<'_> {
    /// Its kind, as the list has it, and its name.
    fn words(&self) -> (&'static str, String) {
        match self {
            Self::Program(name) => ("program", (*name).into()),
            Self::Python(name) => ("python", (*name).into()),
            Self::File(path) => ("file", path.display().to_string()),
            Self::Command(line) => ("command", (*line).into()),
            Self::RealTime(runs) => ("computer", format!("that is in time in one of {runs} runs")),
        }
    }
}

/// Says that the test of this thread is skipped and for want of what. The caller returns.
///
/// # Panics
/// If the list cannot be written: a gate that counts must not count too few.
pub fn skip(need: TestNeed, reason: &str) {
    let (kind, name) = need.words();
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test").to_owned();
    // Written past what catches the words of a test that passes.
    let _ = writeln!(std::io::stderr(), "skipped: {test}: no {kind} {name}: {reason}");
    let Some(list) = std::env::var_os(LIST) else {
        return;
    };
    let one_line = reason.split_whitespace().collect::<Vec<_>>().join(" ");
    let line = format!("{kind}\t{name}\t{test}\t{one_line}\n");
    let file = std::fs::OpenOptions::new().create(true).append(true).open(list);
    // One write, so that lines of programs that run at the same time stay whole.
    let written = file.and_then(|mut file| file.write_all(line.as_bytes()));
    written.expect("the list of skipped tests can be written");
}

/// Whether a program is missing; if so the test is skipped.
#[must_use]
pub fn lacks_program(name: &str) -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let is_missing = !std::env::split_paths(&folders).any(|folder| folder.join(name).is_file());
    if is_missing {
        skip(TestNeed::Program(name), "it is not on the path");
    }
    is_missing
}

/// Whether a file or folder is missing; if so the test is skipped.
#[must_use]
pub fn lacks_file(path: &Path) -> bool {
    let is_missing = !path.exists();
    if is_missing {
        skip(TestNeed::File(path), "it is not here");
    }
    is_missing
}

/// Whether a command of the shell fails; if so the test is skipped.
///
/// # Panics
/// If there is no shell.
#[must_use]
pub fn lacks_command(line: &str) -> bool {
    let outcome = Command::new("sh").args(["-c", line]).stdin(Stdio::null()).output();
    let output = outcome.expect("a shell");
    let is_missing = !output.status.success();
    if is_missing {
        skip(TestNeed::Command(line), &String::from_utf8_lossy(&output.stderr));
    }
    is_missing
}

/// Whether there are no pseudo-terminals; if so the test is skipped.
#[must_use]
pub fn lacks_terminals() -> bool {
    lacks_file(Path::new("/dev/ptmx"))
}
