//! Signals through the crate's public door.
#![cfg(test)]

mod messages;
mod touches;
