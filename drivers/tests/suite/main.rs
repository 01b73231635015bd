//! The simulated rig, and messages, through the crate's public door.
#![cfg(test)]

mod messages;
mod sidecar;
mod sim;
