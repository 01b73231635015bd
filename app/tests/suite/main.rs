//! The command line as a user meets it, and the window once.
#![cfg(test)]

mod altered;
mod analyse;
mod calibration;
mod catalog;
mod compliance;
mod demo;
mod disk;
mod doctor;
mod emulate;
mod extremes;
mod fit;
mod haptics;
mod import;
mod lake;
mod master_curve;
mod material;
mod migrations;
mod newer;
mod plan;
mod programme;
mod protocol;
mod queue;
mod rate;
mod records;
mod report;
mod scene;
mod select;
mod study;
mod support;
mod support_bundle;
mod trade;
mod viscoelastic_material;
mod whole_commands;
mod window;
mod wired;
