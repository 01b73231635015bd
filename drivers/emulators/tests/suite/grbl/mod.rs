//! The Grbl driver against the emulated board: in simulated time, and over real wires.

mod answers;
mod bench;
mod faults;
mod moves;
mod opening;
mod streams;
mod wires;
