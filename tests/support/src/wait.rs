//! Waiting in tests: for a condition, with an end that no busy computer reaches.
#![expect(
    clippy::disallowed_methods,
    reason = "a test that hangs must fail, and nothing is measured"
)]

use crate::skip::{TestNeed, skip};
use std::time::{Duration, Instant};

/// Longest wait of a test for an event that must come, on a busy computer.
pub const PATIENCE: Duration = Duration::from_secs(300);

/// The end of a wait that begins now.
#[derive(Clone, Copy, Debug)]
pub struct Deadline(Instant);

impl Deadline {
    /// When patience, counted from now, ends.
    #[must_use]
    #[expect(clippy::new_without_default, reason = "it begins now, whenever that is")]
    pub fn new() -> Self {
        Self(Instant::now() + PATIENCE)
    }

    #[must_use]
    pub fn is_over(self) -> bool {
        Instant::now() >= self.0
    }
}

/// Runs in real time before a computer counts as too busy for them.
const ATTEMPTS: usize = 10;

/// The result of the first attempt that was in time; one that an interlock ended, as it must where samples come late, has
/// been checked as far as it went and returns its reason. Where none was in time the test is skipped.
pub fn in_time<T>(mut attempt: impl FnMut() -> Result<T, String>) -> Option<T> {
    let mut reason = String::new();
    for _ in 0..ATTEMPTS {
        match attempt() {
            Ok(found) => return Some(found),
            Err(why) => reason = why,
        }
    }
    skip(TestNeed::RealTime(ATTEMPTS), &reason);
    None
}

/// Tries until something is there.
///
/// # Panics
/// If it is not there when patience ends, with `seen`, which tells how things stand then.
pub fn until<T>(mut attempt: impl FnMut() -> Option<T>, seen: impl FnOnce() -> String) -> T {
    let end = Deadline::new();
    loop {
        if let Some(found) = attempt() {
            return found;
        }
        assert!(!end.is_over(), "it never came: {}", seen());
        std::thread::sleep(Duration::from_millis(2));
    }
}
