//! Protocol files and loops of the haptics through the crate's public door.
#![cfg(test)]

mod haptic_loop;
mod haptic_scene;
mod protocol_files;
