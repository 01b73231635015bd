//! A Mark-10 gauge of Series 5 (Series 5 user's guide, pages 17 to 19; Model 7i user's guide, pages 29 to 31).

use crate::DeviceFault;
use crate::cell::{CellLoad, EmulatedCell};
use crate::wire::Outbox;
use palpate_drivers::mark10::gauge::{FILTER_MAX, RATES};
use palpate_drivers::mark10::protocol::ForceUnit;
use palpate_drivers::sim::{Random, RandomStream};
use palpate_model::Nanos;
use std::collections::VecDeque;

/// Largest force, in N. Beyond 110 % of it no number is given: a guess.
const CAPACITY: f64 = 25.0;
/// One step of its last digit in N; the reading 4.285 N of the Series 4 user's guide, page 16, is a multiple of it.
const STEP: f64 = 0.005;
/// White noise of its own samples in N, so that a reading at rest now and then moves by a step.
const NOISE: f64 = 0.002;
/// Samples of its converter in a ms; filters average 2^n of them. A guess.
const SAMPLES_PER_MS: f64 = 7.0;
/// Milliseconds of the longest filter.
const STEPS_MAX: usize = 147;
/// Longest command; more is an illegal one.
const COMMAND_MAX: usize = 32;
/// From its supply to the first answer: a guess.
const START: Nanos = Nanos::from_millis(500);

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EmulatedGaugeSettings {
    /// Serial number that it reports.
    pub serial_number: String,
    /// Whether `AOUT1` gives 50 readings a second, as on the 7i.
    pub is_7i: bool,
    /// Unit it is switched on with.
    pub unit: ForceUnit,
    pub seed: u64,
}

impl Default for EmulatedGaugeSettings {
    fn default() -> Self {
        Self {
            serial_number: "3519042".into(),
            is_7i: false,
            // As in the example of LIST: what a driver must not take for newtons.
            unit: ForceUnit::Pound,
            seed: 0,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Current,
    PeakTension,
    PeakCompression,
}

/// What commands set. A loss of supply resets it, as nothing is saved.
#[derive(Clone, Debug)]
struct GaugeState {
    unit: ForceUnit,
    mode: Mode,
    filter_displayed: u8,
    filter_current: u8,
    auto_transmit: u16,
    auto_off: u8,
    is_full: bool,
    is_inverted: bool,
    is_unsigned: bool,
}

impl GaugeState {
    fn new(unit: ForceUnit) -> Self {
        Self {
            unit,
            mode: Mode::Current,
            filter_displayed: 8,
            filter_current: 1,
            auto_transmit: 0,
            auto_off: 5,
            is_full: true,
            is_inverted: false,
            is_unsigned: false,
        }
    }
}

pub struct EmulatedGauge {
    settings: EmulatedGaugeSettings,
    state: GaugeState,
    noise: Random,
    command: Vec<u8>,
    /// Force with noise in N, one value a ms, newest last.
    forces: VecDeque<f64>,
    zero: f64,
    peaks: (f64, f64),
    next: Nanos,
    off_until: Nanos,
    is_stuck: bool,
    is_saturated: bool,
    is_other: bool,
    output: Outbox,
}

impl EmulatedGauge {
    /// A gauge that has been on for a while, not zeroed.
    pub fn new(settings: EmulatedGaugeSettings) -> Self {
        Self {
            state: GaugeState::new(settings.unit),
            noise: Random::new(settings.seed, RandomStream::Noise),
            settings,
            command: Vec::new(),
            forces: VecDeque::from([0.0]),
            zero: 0.0,
            peaks: (0.0, 0.0),
            next: Nanos::ZERO,
            off_until: Nanos::ZERO,
            is_stuck: false,
            is_saturated: false,
            is_other: false,
            output: Outbox::default(),
        }
    }

    /// The present reading as `?` gives it; a stand passes it on.
    pub fn displayed_reading(&self) -> String {
        let force = match self.state.mode {
            Mode::Current => self.filtered(self.state.filter_displayed),
            Mode::PeakTension => self.peaks.0,
            Mode::PeakCompression => self.peaks.1,
        };
        self.format_force(force)
    }

    /// Mean of the newest 2^n samples above zero.
    fn filtered(&self, exponent: u8) -> f64 {
        let samples = f64::from(1_u32 << exponent.min(FILTER_MAX));
        let steps = (samples / SAMPLES_PER_MS).ceil() as usize;
        let newest = self.forces.iter().rev().take(steps);
        let count = newest.len();
        newest.sum::<f64>() / count as f64 - self.zero
    }

    fn format_force(&self, newtons: f64) -> String {
        if self.is_saturated || (newtons + self.zero).abs() > 1.1 * CAPACITY {
            return "OVER".into();
        }
        let unit = self.state.unit;
        // As many digits as its step in newtons has in that unit; -0 has no sign.
        let step = STEP / unit.newtons();
        let decimals = (-step.log10()).ceil().clamp(0.0, 5.0) as usize;
        let rounded = (newtons / STEP).round() * STEP / unit.newtons();
        let sign = if self.state.is_inverted { -1.0 } else { 1.0 };
        let signed = if self.state.is_unsigned { rounded.abs() } else { sign * rounded };
        let text = format!("{signed:.decimals$}");
        let is_zero = text.bytes().all(|b| !(b'1'..=b'9').contains(&b));
        let text = if is_zero { text.trim_start_matches('-').to_owned() } else { text };
        if self.state.is_full { format!("{text} {}", unit.name()) } else { text }
    }

    fn list(&self) -> String {
        let state = &self.state;
        let mode = match state.mode {
            Mode::Current => "CUR",
            Mode::PeakTension => "PT",
            Mode::PeakCompression => "PC",
        };
        format!(
            "V1.00;{};{mode};FLTC{};FLTP{};AOUT{:02};AOFF{};{};MIT;POL;IPOL{};OPOL{};B0",
            state.unit.name().to_ascii_uppercase(),
            state.filter_displayed,
            state.filter_current,
            state.auto_transmit,
            state.auto_off,
            if state.is_full { "FULL" } else { "NUM" },
            u8::from(state.is_inverted),
            u8::from(state.is_unsigned),
        )
    }

    fn send_line(&mut self, text: &str) {
        self.output.push(format!("{text}\r\n").as_bytes());
    }

    /// The answer to a command; none where it sets something.
    fn answer(&mut self, now: Nanos, command: &str) -> Option<String> {
        let state = &mut self.state;
        match command {
            "" => {}
            "?" => return Some(self.displayed_reading()),
            "?C" => return Some(self.format_force(self.filtered(self.state.filter_current))),
            "?PT" => return Some(self.format_force(self.peaks.0)),
            "?PC" => return Some(self.format_force(self.peaks.1)),
            "LIST" => return Some(self.list()),
            "RN" => return Some("Series 5 Force Gauge".into()),
            "RM" => return Some("M5-5".into()),
            "RV" => return Some("V1.00".into()),
            "RS" if self.is_other => return Some("9999999".into()),
            "RS" => return Some(self.settings.serial_number.clone()),
            "CUR" => state.mode = Mode::Current,
            "PT" => state.mode = Mode::PeakTension,
            "PC" => state.mode = Mode::PeakCompression,
            "FULL" => state.is_full = true,
            "NUM" => state.is_full = false,
            "CLR" => self.peaks = (0.0, 0.0),
            "Z" => {
                self.zero += self.filtered(self.state.filter_displayed);
                self.peaks = (0.0, 0.0);
            }
            "SAVE" => {}
            "?ET" | "?A" | "AM" | "PM" => return Some("*11".into()),
            _ => return self.answer_numbered(now, command),
        }
        None
    }

    fn answer_numbered(&mut self, now: Nanos, command: &str) -> Option<String> {
        if let Some(unit) = match command {
            "N" | "MN" | "KN" | "LB" | "KG" | "G" | "OZ" => ForceUnit::parse(command),
            _ => None,
        } {
            self.state.unit = unit;
            return None;
        }
        let digits = command.trim_start_matches(|c: char| c.is_ascii_uppercase());
        let name = &command[..command.len() - digits.len()];
        if !["FLTC", "FLTP", "AOUT", "AOFF", "IPOL", "OPOL"].contains(&name) {
            return Some("*10".into());
        }
        let Ok(number) = digits.parse::<u16>() else {
            return Some("*12".into());
        };
        let state = &mut self.state;
        let small = number.min(255) as u8;
        match (name, number) {
            ("FLTC", 0..=10) => state.filter_displayed = small,
            ("FLTP", 0..=10) => state.filter_current = small,
            ("AOFF", 0..=30) => state.auto_off = small,
            ("FLTC" | "FLTP" | "AOFF", _) => return Some("*22".into()),
            ("AOUT", n) if n == 0 || RATES.contains(&n) => {
                state.auto_transmit = n;
                self.next = now + self.period();
            }
            ("IPOL", 0 | 1) => state.is_inverted = number == 1,
            ("OPOL", 0 | 1) => state.is_unsigned = number == 1,
            _ => return Some("*12".into()),
        }
        None
    }

    fn period(&self) -> Nanos {
        let rate = match self.state.auto_transmit {
            1 if self.settings.is_7i => 50,
            rate => rate.max(1),
        };
        Nanos(1_000_000_000 / u64::from(rate))
    }

    fn restart(&mut self, now: Nanos) {
        self.state = GaugeState::new(self.settings.unit);
        self.off_until = now + START;
        self.command.clear();
        self.output.clear();
        // It zeroes itself when it is switched on.
        self.zero = self.forces.back().copied().unwrap_or(0.0);
        self.peaks = (0.0, 0.0);
    }
}

impl EmulatedCell for EmulatedGauge {
    fn receive(&mut self, now: Nanos, bytes: &[u8]) {
        if now < self.off_until {
            return;
        }
        for byte in bytes {
            match byte {
                b'\r' => {
                    let command = std::mem::take(&mut self.command);
                    if let Some(answer) = self.answer(now, &String::from_utf8_lossy(&command)) {
                        self.send_line(&answer);
                    }
                }
                // "where the Line Feed, 0x0A, is ignored" (Series 5 user's guide, page 17).
                b'\n' => {}
                _ if self.command.len() < COMMAND_MAX => self.command.push(*byte),
                _ => {}
            }
        }
    }

    fn advance(&mut self, now: Nanos, load: CellLoad) {
        if !self.is_stuck {
            let force = load.force.0 + NOISE * self.noise.normal();
            if self.forces.len() >= STEPS_MAX {
                self.forces.pop_front();
            }
            self.forces.push_back(force);
            let above = force - self.zero;
            self.peaks = (self.peaks.0.min(above), self.peaks.1.max(above));
        }
        if now < self.off_until || self.state.auto_transmit == 0 {
            return;
        }
        while self.next <= now {
            let text = self.displayed_reading();
            self.send_line(&text);
            self.next = self.next + self.period();
        }
    }

    fn transmit(&mut self) -> Vec<u8> {
        self.output.take()
    }

    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool) {
        match fault {
            DeviceFault::Reset if is_on => self.restart(now),
            DeviceFault::Reset => {}
            DeviceFault::Stuck => self.is_stuck = is_on,
            DeviceFault::Saturated => self.is_saturated = is_on,
            DeviceFault::WrongDevice => {
                self.is_other = is_on;
                self.restart(now);
            }
        }
    }
}
