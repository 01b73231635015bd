//! Loops of the haptics, and messages, through the crate's public door.
#![cfg(test)]

mod galil_rig;
mod haptic_loop;
mod haptic_scene;
mod messages;
mod slave_on_galil;
