//! The Galil driver against the emulated controller: in simulated time, and over real wires.

#[path = "galil_driver/bench.rs"]
mod bench;
#[path = "galil_driver/fault_runs.rs"]
mod fault_runs;
#[path = "galil_driver/faults.rs"]
mod faults;
#[path = "galil_driver/moves.rs"]
mod moves;
#[path = "galil_driver/opening.rs"]
mod opening;
#[path = "galil_driver/pace.rs"]
mod pace;
#[path = "galil_driver/recording.rs"]
mod recording;
#[path = "galil_driver/sines.rs"]
mod sines;
#[path = "galil_driver/wires.rs"]
mod wires;
