//! Emulated devices through the crate's public door, and the drivers that talk to them.
#![cfg(test)]

mod cells;
mod galil;
mod galil_driver;
mod grbl;
mod hapi;
mod inverse;
mod sidecar;
mod stand;
