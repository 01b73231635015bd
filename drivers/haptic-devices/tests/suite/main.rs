//! Haptic devices through the crate's public door, on emulated ones.
#![cfg(test)]

mod hapi_simulated;
mod hapi_wires;
mod margin;
mod reports;
mod served;
mod simulated;
mod wires;
