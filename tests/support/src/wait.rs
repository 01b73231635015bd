//! Waiting in tests: for a condition, with an end that no busy computer reaches.
#![expect(
    clippy::disallowed_methods,
    reason = "a test that hangs must fail, and nothing is measured"
)]

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

/// Runs of a test that may end otherwise on a busy computer before it fails.
const ATTEMPTS: usize = 20;

/// The result of the first attempt that succeeds; a failed one returns its reason.
///
/// # Panics
/// If none of twenty does, with what each said.
pub fn retry<T>(mut attempt: impl FnMut() -> Result<T, String>) -> T {
    let mut failures = Vec::new();
    for _ in 0..ATTEMPTS {
        match attempt() {
            Ok(found) => return found,
            Err(why) => failures.push(why),
        }
    }
    panic!("none of {ATTEMPTS} attempts succeeded: {failures:#?}");
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
