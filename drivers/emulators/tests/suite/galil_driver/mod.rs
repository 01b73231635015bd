//! The Galil driver against the emulated controller: in simulated time, and over real wires.

mod bench;
mod fault_runs;
mod faults;
mod moves;
mod opening;
mod pace;
mod recording;
mod sines;
mod tracking;
mod wires;
