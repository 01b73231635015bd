//! Wide vector instructions where the processor has them.
//!
//! The release is built for any x86-64 processor, so the compiler may count on two numbers an
//! instruction only. `pulp` compiles a closure again for wider instructions and picks at run time.
//! The arithmetic is the same, operation by operation: no sum is reordered and no product fused, so
//! every processor gives the same bits (decision 0005).

use pulp::Arch;

/// Runs `work` compiled for the widest vectors at hand; all it calls must be `#[inline(always)]`.
#[inline(always)]
pub fn run_wide<R>(work: impl FnOnce() -> R) -> R {
    Arch::new().dispatch(work)
}
