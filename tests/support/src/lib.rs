//! Shared by the test programs of all crates, and by examples and benchmarks.
//!
//! It is a dependency of tests only and needs the model alone, so that no test program waits for another crate.

pub mod messages;
pub mod naive_surface;
pub mod record;
pub mod skip;
pub mod wait;
