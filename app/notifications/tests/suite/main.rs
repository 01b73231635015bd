//! Notices against real servers on this computer.

mod email;
mod faults;
mod mqtt;
mod runs;
mod servers;
mod webhook;
