//! Signals through the crate's public door.
#![cfg(test)]

mod touches;
