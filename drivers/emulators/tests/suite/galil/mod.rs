//! The emulated Galil controller against what manuals and captures say, byte for byte, and against closed forms.

mod bench;
mod data;
mod language;
mod moves;
mod programs;
mod streams;
mod upset;
mod wires;
