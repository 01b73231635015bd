//! What stands on every screen: the state, the numbers, the stop control, the event log.

pub mod actions;
pub mod activity;
pub mod armed;
pub mod dropped_files;
pub mod event_log;
pub mod frame_meter;
pub mod keys;
pub mod pace;
pub mod palette;
pub mod panels;
pub mod rail;
pub mod run_strip;
pub mod sizes;
pub mod top_bar;
pub mod tour;
