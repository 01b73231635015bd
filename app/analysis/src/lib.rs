//! Use cases for recorded sessions, once for every front end: read, fit, compare, report, export.
//!
//! A use case takes a typed request and gives a typed result or error; it names no command-line flag
//! and no button, prints nothing and draws in no window. It never commands a rig.
//!
//! Start reading at [`source`], which makes samples of a session or a table, and [`fit`].
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

pub mod analysed_session;
pub mod build_description;
pub mod calibrations;
pub mod catalog_search;
pub mod compliance;
pub mod cycle_analysis;
pub mod cycles;
pub mod daily;
pub mod demonstration_library;
pub mod dynamic;
pub mod edited_session;
pub mod edits;
pub mod exports;
#[cfg(feature = "extremes")]
pub mod extremes;
#[cfg(feature = "haptics")]
pub mod feedback_session;
pub mod fidelity;
pub mod fit;
pub mod group_statistics;
#[cfg(feature = "haptics")]
pub mod haptics;
#[cfg(feature = "haptics")]
pub mod haptics_tape;
pub mod imports;
pub mod kept_files;
#[cfg(feature = "haptics")]
pub mod margin;
pub mod material;
pub mod material_lake;
pub mod plan;
pub mod pool;
pub mod population;
pub mod press_modulus;
pub mod progress;
pub mod property;
pub mod protocol_sources;
pub mod recordings;
pub mod relaxation;
pub mod report;
pub mod research_object;
pub mod run_quality;
#[cfg(feature = "haptics")]
pub mod scene;
#[cfg(feature = "haptics")]
pub mod scene_bench;
#[cfg(feature = "haptics")]
pub mod scene_device;
pub mod select;
pub mod session_actions;
pub mod session_entries;
pub mod shared_library;
pub mod shared_results;
pub mod source;
pub mod specimen_queue;
pub mod station_settings;
pub mod study_table;
pub mod support_bundle;
pub mod tick_replay;
pub mod today;
pub mod trade;
pub mod unloading;
pub mod window_requests;
