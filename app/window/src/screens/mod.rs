//! The screens: [`screen`] says what one is, [`table`] which there are; each has a file or a folder of its own.

pub mod after_stop;
pub mod approach;
pub mod calibration;
pub mod checks;
pub mod exact_fit;
pub mod extremes;
pub mod form;
pub mod haptics;
pub mod library;
pub mod models;
pub mod parameters;
pub mod preview_view;
pub mod protocol_panel;
pub mod results_panel;
pub mod review;
pub mod rig;
pub mod rig_panel;
pub mod run;
pub mod run_panes;
pub mod scene;
pub mod screen;
pub mod start_page;
pub mod table;
mod tape;
pub mod trade;
pub mod weighing;
