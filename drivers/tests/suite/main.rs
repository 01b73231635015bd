//! The simulated rig through the crate's public door.
#![cfg(test)]

mod sim;
