//! The emulated Galil controller against what manuals and captures say, byte for byte, and against closed forms.

#[path = "galil/bench.rs"]
mod bench;
#[path = "galil/data.rs"]
mod data;
#[path = "galil/language.rs"]
mod language;
#[path = "galil/moves.rs"]
mod moves;
#[path = "galil/programs.rs"]
mod programs;
#[path = "galil/streams.rs"]
mod streams;
#[path = "galil/upset.rs"]
mod upset;
#[path = "galil/wires.rs"]
mod wires;
