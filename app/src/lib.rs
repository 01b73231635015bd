//! The palpate workbench: the window and the command line, both on the same runner.
//!
//! This crate draws snapshots and sends commands. It never touches hardware except through
//! [`palpate_protocols::runner`] and contains no experiment logic.
//! Start reading at [`cli`] for the headless commands.

pub mod cli;
