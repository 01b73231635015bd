//! What crosses crates: whole runs, replay, the window, and the rules of the source tree.
#![cfg(test)]

mod compliance;
mod contact;
mod cycles;
mod engine_protocols;
mod fast;
mod faults;
mod follow;
mod gui_flows;
mod gui_library;
mod gui_link;
mod gui_models;
mod gui_pictures;
mod gui_playback;
mod gui_protocols;
mod gui_report;
mod gui_review;
mod gui_scene;
mod gui_tape;
mod gui_tutorial;
mod gui_workbench;
mod hold_until;
mod on_wires;
mod pausing;
mod preview;
mod programme;
mod protocol_runs;
mod random_runs;
mod replay;
mod shipped;
mod slave;
mod thirty_seeds;
mod tidy;
mod trade;
mod unloading;
mod wired;
