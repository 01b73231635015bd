//! Panics that are caught where they happen, so that the rest of the program goes on as it is.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread::Result;

thread_local! {
    static DEPTH: Cell<u32> = const { Cell::new(0) };
}

/// Catches a panic of `work`. Whoever calls uses nothing any more that `work` may have left half changed.
///
/// While it runs [`is_panic_caught`] tells a panic hook that nothing has to be stopped.
pub fn catch_panic<T>(work: impl FnOnce() -> T) -> Result<T> {
    DEPTH.set(DEPTH.get() + 1);
    let outcome = catch_unwind(AssertUnwindSafe(work));
    DEPTH.set(DEPTH.get() - 1);
    outcome
}

/// Whether a panic of this thread would be caught by [`catch_panic`].
#[must_use]
pub fn is_panic_caught() -> bool {
    DEPTH.get() > 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contained_panic_is_known_as_one_and_the_next_is_not() {
        assert!(!is_panic_caught());
        let (outer, inner) = catch_panic(|| {
            let inner = catch_panic(|| panic!("on purpose"));
            (is_panic_caught(), inner.is_err())
        })
        .unwrap();
        assert!(outer && inner && !is_panic_caught());
    }
}
