//! The palpate workbench: the window and the command line, both on the same runner.
//!
//! This crate draws snapshots and sends commands. It never touches hardware except through
//! [`palpate_protocols::runner`] and contains no experiment logic.
//! Start reading at [`cli`] for the headless commands.

pub mod app;
pub mod cli;
pub mod command;
pub mod playback;
pub mod plots;
pub mod report;
pub mod scene;
pub mod screens;
pub mod settings;
pub mod shell;
pub mod theme;
pub mod trade;
pub mod widgets;
pub mod window;
pub mod workers;
