//! Constitutive models of soft tissue and their identification.
//!
//! This crate knows the model families, their exact step and other integrators, the one fit, what a
//! record can identify, which family to choose and which precision a protocol will reach.
//! It never reads a file, a port or a clock, starts no thread and draws nothing: every result is a
//! function of its arguments.
//!
//! Start reading at [`families`] for the models and [`fit`] for their identification.
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

pub mod cycles;
pub mod expected;
#[cfg(feature = "extremes")]
pub mod extremes;
pub mod families;
pub mod fit;
pub mod integrators;
#[cfg(feature = "reference")]
pub mod reference;
pub mod select;
pub mod tolerance;
pub mod trade;
pub mod vectors;

/// Each of them once, in the order in which they first come.
fn distinct<T: PartialEq>(all: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for one in all {
        if !found.contains(&one) {
            found.push(one);
        }
    }
    found
}
