//! The sidecar's driver and an emulated sidecar.

pub mod bench;
mod conform;
mod fault_runs;
mod faults;
mod moves;
