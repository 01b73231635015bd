//! The Grbl driver against the emulated board: in simulated time, and over real wires.

#[path = "grbl/answers.rs"]
mod answers;
#[path = "grbl/bench.rs"]
mod bench;
#[path = "grbl/faults.rs"]
mod faults;
#[path = "grbl/moves.rs"]
mod moves;
#[path = "grbl/opening.rs"]
mod opening;
#[path = "grbl/streams.rs"]
mod streams;
#[path = "grbl/wires.rs"]
mod wires;
