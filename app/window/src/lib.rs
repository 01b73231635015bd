//! The window of the workbench.
//!
//! This crate draws snapshots and sends requests. It never touches hardware except through the
//! runner, holds no experiment logic and makes no analysis of its own.
//!
//! Start reading at [`app`] for what a frame does, [`screens::screen`] for what a screen is.
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

pub mod app;
pub mod command;
mod latest_run;
pub mod playback;
pub mod plots;
pub mod scene;
pub mod screens;
pub mod settings;
pub mod shell;
pub mod theme;
pub mod widgets;
pub mod window;
pub mod workbench;
pub mod workers;
