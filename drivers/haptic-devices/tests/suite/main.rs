//! The Inverse3 through the crate's public door, on an emulated service.
#![cfg(test)]

mod margin;
mod reports;
mod served;
mod simulated;
mod wires;
