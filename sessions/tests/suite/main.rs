//! Sessions through the crate's public door: written, damaged, read back, exported.
#![cfg(test)]

mod altered;
mod catalog;
mod chains;
mod companions;
mod damage;
mod disk;
mod documents;
mod exports;
mod faults;
mod foreign;
mod foreign_bluehill;
mod foreign_damage;
mod foreign_indenters;
mod foreign_jpk;
mod foreign_languages;
mod foreign_mach1;
mod hostile;
mod killed;
mod lake;
mod limits;
mod messages;
mod pace;
mod power;
mod recovery;
mod round_trip;
mod segments;
mod support;
mod two_programs;
mod worker;
mod written_again;
