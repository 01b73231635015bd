//! Notices against real servers on this computer.
#![cfg(test)]

mod email;
mod faults;
mod mqtt;
mod runs;
mod servers;
mod webhook;
