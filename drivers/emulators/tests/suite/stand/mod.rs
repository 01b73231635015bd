//! The Mark-10 stand against its emulator, in time that the tests make, and once on a thread.

#[path = "stand/bench.rs"]
mod bench;
#[path = "stand/faults.rs"]
mod faults;
#[path = "stand/moves.rs"]
mod moves;
#[path = "stand/opening.rs"]
mod opening;
#[path = "stand/streams.rs"]
mod streams;
#[path = "stand/wires.rs"]
mod wires;
