//! Status reports and answers to queries (doc/markdown/interface.md; forms as in report.c).

use super::planner::Coordinates;
use super::{Grbl, RX_MAX, State};
use std::fmt::Write;

/// Reports between two that carry the offset or the overrides: 30 and 20 in motion, 10 at rest (config.h).
const OFFSET_BUSY: u32 = 30;
const OVERRIDES_BUSY: u32 = 20;
const REST: u32 = 10;

/// Reports until the periodic fields are due again.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReportCounters {
    offset: u32,
    overrides: u32,
}

impl ReportCounters {
    pub fn report_offset(&mut self) {
        self.offset = 0;
    }

    pub fn report_overrides(&mut self) {
        self.overrides = 0;
    }
}

/// A field with the letters that are on; empty if none is.
fn letters(head: &str, all: &[(bool, char)]) -> String {
    let on: String = all.iter().filter(|(is_on, _)| *is_on).map(|(_, letter)| *letter).collect();
    if on.is_empty() { on } else { format!("{head}{on}") }
}

fn list(place: &Coordinates) -> String {
    format!("{:.3},{:.3},{:.3}", place[0], place[1], place[2])
}

impl Grbl {
    pub(super) fn send_status(&mut self) {
        let name = match self.state {
            State::Idle => "Idle",
            State::Run => "Run",
            State::Jog => "Jog",
            State::Hold if self.planner.is_idle() => "Hold:0",
            State::Hold => "Hold:1",
            State::Door if self.planner.is_idle() => "Door:0",
            State::Door => "Door:2",
            State::Alarm => "Alarm",
            State::Home => "Home",
            State::Check => "Check",
            State::Sleep => "Sleep",
        };
        let inch = if self.eeprom.is_set(13) { 1.0 / 25.4 } else { 1.0 };
        let scaled = |place: Coordinates| place.map(|mm| mm * inch);
        let mask = self.eeprom.value(10) as u32;
        let here = self.machine();
        let offset = self.offsets.of(self.modes.system);
        let mut text = if mask & 1 == 0 {
            let work = std::array::from_fn(|axis| here[axis] - offset[axis]);
            format!("<{name}|WPos:{}", list(&scaled(work)))
        } else {
            format!("<{name}|MPos:{}", list(&scaled(here)))
        };
        // Writing to a String cannot fail.
        if mask & 2 != 0 {
            let _ = write!(text, "|Bf:{},{}", self.planner.free(), RX_MAX - self.rx.len());
        }
        let spindle = if self.modes.spindle == 5 { 0.0 } else { self.modes.spindle_speed };
        let _ = write!(text, "|FS:{:.0},{spindle:.0}", self.speed * 60.0 * inch);
        text += &letters(
            "|Pn:",
            &[(self.is_probe(), 'P'), (self.is_limit(), 'X'), (self.is_hold_pressed, 'H')],
        );
        self.add_periodic_fields(&mut text, list(&scaled(offset)));
        self.reports.offset = self.reports.offset.saturating_sub(1);
        self.reports.overrides = self.reports.overrides.saturating_sub(1);
        text.push_str(">\r\n");
        self.send(&text);
    }

    /// Fields of some reports only: the offset of the work coordinates, else the overrides.
    fn add_periodic_fields(&mut self, text: &mut String, offset: String) {
        let is_busy = self.is_moving();
        let interval = |busy| if is_busy { busy } else { REST };
        if self.reports.offset == 0 {
            self.reports.offset = interval(OFFSET_BUSY);
            // The overrides follow in the next report.
            self.reports.overrides = self.reports.overrides.max(1);
            let _ = write!(text, "|WCO:{}", offset);
        } else if self.reports.overrides == 0 {
            self.reports.overrides = interval(OVERRIDES_BUSY);
            let [feed, rapid, of_spindle] = self.overrides;
            let _ = write!(text, "|Ov:{feed},{rapid},{of_spindle}");
            let modes = self.modes;
            *text += &letters(
                "|A:",
                &[(modes.spindle == 3, 'S'), (modes.spindle == 4, 'C'), (modes.has_coolant, 'F')],
            );
        }
    }

    pub(super) fn send_probe(&mut self) {
        let (place, is_found) = self.probe_result;
        self.send(&format!("[PRB:{}:{}]\r\n", list(&place), u8::from(is_found)));
    }

    pub(super) fn send_offsets(&mut self) {
        let offsets = self.offsets;
        let names = ["G54", "G55", "G56", "G57", "G58", "G59", "G28", "G30", "G92"];
        let shift = [offsets.shift];
        let places = offsets.systems.iter().chain(&offsets.stored).chain(&shift);
        for (name, place) in names.iter().zip(places) {
            self.send(&format!("[{name}:{}]\r\n", list(place)));
        }
        self.send(&format!("[TLO:{:.3}]\r\n", offsets.tool));
        self.send_probe();
    }

    pub(super) fn send_modes(&mut self) {
        let modes = self.modes;
        let motion = match modes.motion {
            probe @ 382.. => format!("38.{}", probe - 380),
            other => other.to_string(),
        };
        let units = if modes.is_inch { 20 } else { 21 };
        let distance = if modes.is_relative { 91 } else { 90 };
        let feed_mode = if modes.is_inverse { 93 } else { 94 };
        let coolant = if modes.has_coolant { 8 } else { 9 };
        self.send(&format!(
            "[GC:G{motion} G{} G{} G{units} G{distance} G{feed_mode} M{} M{coolant} T{} F{:.0} S{:.0}]\r\n",
            54 + modes.system, modes.plane, modes.spindle, modes.tool, modes.feed, modes.spindle_speed
        ));
    }

    pub(super) fn send_build(&mut self) {
        let version = if self.is_wrong { "0.9j.20160303" } else { "1.1h.20190830" };
        let info = self.eeprom.build_info.clone();
        self.send(&format!("[VER:{version}:{info}]\r\n[OPT:V,15,128]\r\n"));
    }
}
