//! Protocol files through the crate's public door.
#![cfg(test)]

mod protocol_files;
