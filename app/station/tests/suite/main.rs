//! The station through its socket, on the simulated rig.
#![cfg(test)]

mod attacks;
mod client;
mod remote;
mod watching;
