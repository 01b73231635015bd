//! Tests that cross crates, and their fixtures.
