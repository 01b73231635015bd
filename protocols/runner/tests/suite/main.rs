//! Loops of the haptics through the crate's public door.
#![cfg(test)]

mod haptic_loop;
mod haptic_scene;
