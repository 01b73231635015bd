//! The table of devices: what a rig file calls them, how their keys are read, and what gives them away on a wire.

use crate::cell::CellDevice;
use crate::rig_file::{Fields, RigFile};
use crate::{galil, grbl, hx711, mark10, sidecar};
use palpate_model::Nanos;
use palpate_model::units::Volts;
use std::sync::Arc;

/// All devices that palpate drives, in the order in which messages name them. What is heard is that of the first that
/// recognises it.
pub const DEVICES: &[DeviceKind] = &[
    galil::KIND,
    grbl::KIND,
    mark10::stand::KIND,
    hx711::KIND,
    mark10::gauge::KIND,
    crate::plain_numbers::KIND,
    sidecar::KIND,
    sidecar::CELL_KIND,
];

pub struct DeviceKind {
    pub word: &'static str,
    pub title: &'static str,
    /// Introduction of its own words where ports are listed.
    pub introduction: &'static str,
    pub role: DeviceRole,
    /// The line that gives it away among whole lines that were heard, if one does.
    pub recognise: for<'a> fn(&[&'a str]) -> Option<&'a str>,
}

pub enum DeviceRole {
    /// It moves the probe: its keys are those of the rig file itself. The first parameter is the rig's name.
    Axis(fn(String, &mut Fields) -> Option<RigFile>),
    /// A load cell beside an axis: its keys are in the table `[cell]`, but for those that say where it is.
    Cell {
        read: fn(&mut Fields) -> Option<Arc<dyn CellDevice>>,
        /// Its emulation, if it only sends lines.
        emulation: Option<LineEmulation>,
    },
}

/// A load cell that sends lines without being asked.
#[derive(Clone, Copy)]
pub struct LineEmulation {
    pub rate: f64,
    /// The line, with its end, of a time since it was switched on and the signal of the emulated bridge behind the
    /// usual amplifier.
    pub line: fn(Nanos, Volts) -> String,
}

impl DeviceKind {
    /// The device that has sent whole lines, if one is recognised, and the line that identifies it.
    #[must_use]
    pub fn recognise_lines<'a>(lines: &[&'a str]) -> Option<(&'static Self, &'a str)> {
        DEVICES.iter().find_map(|kind| Some((kind, (kind.recognise)(lines)?)))
    }
}

/// The lines of a text, without their ends and empty ones.
pub(crate) fn split_lines(text: &str) -> Vec<&str> {
    let lines = text.split(['\r', '\n']).map(str::trim);
    lines.filter(|line| !line.is_empty()).collect()
}

pub(crate) fn find_line<'a>(lines: &[&'a str], is_it: impl Fn(&str) -> bool) -> Option<&'a str> {
    lines.iter().copied().find(|line| is_it(line))
}
