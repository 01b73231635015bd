//! The Mark-10 stand against its emulator, in time that the tests make, and once on a thread.

mod bench;
mod faults;
mod moves;
mod opening;
mod streams;
mod wires;
