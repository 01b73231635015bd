//! An HX711 board as it answers: the chip on the emulated bridge, and palpate's sketch on an Arduino.
//!
//! The bridge's signal is made of the amplified one: 5 V of it are the chip's whole range at gain 128 (19.5 mV at a supply
//! of 5 V; HX711 data sheet, Avia Semiconductor, page 3), so that what is calibrated in those volts stays right.

use super::DeviceFault;
use super::cell::{CellLoad, EmulatedCell};
use super::wire::Outbox;
use palpate_drivers::hx711::protocol::{COUNT_MAX, COUNT_MIN, Header, Message, line};
use palpate_model::Nanos;

/// Amplified signal at the end of the range, gain 128.
const FULL_SCALE_V: f64 = 5.0;
/// The chip's oscillator is an RC one, its data sheet says "typically": here it is fast by 3 %, within what
/// such chips show.
const OSCILLATOR: f64 = 1.03;
/// An Arduino Uno's ceramic resonator, rated at 0.5 %: here fast by 0.2 %.
const RESONATOR: f64 = 1.002;
/// Its `micros()` counts in steps of 4 (Arduino reference, `micros`).
const MICROS_STEP: u64 = 4;
/// The Uno's boot loader waits about so long before the sketch.
const BOOT: Nanos = Nanos::from_millis(1_600);
/// Conversions after a start until the output is settled (data sheet, page 3: 400 ms at 10, 50 ms at 80
/// samples a second): a value is a mean over them. How they are weighted is not published.
const SETTLING: u32 = 4;
/// How long the sketch waits for the chip.
const MISSING_AFTER: Nanos = Nanos::from_millis(500);

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EmulatedHx711Settings {
    /// Name that the sketch reports.
    pub board: String,
    /// Conversions a second as wired: 80, or 10.
    pub is_fast: bool,
    /// Gain of channel A: 128, or 64.
    pub is_half_gain: bool,
    /// The board's clock in microseconds when the emulator starts, so that it wraps soon.
    pub micros: u32,
}

impl Default for EmulatedHx711Settings {
    fn default() -> Self {
        Self { board: "emulated".into(), is_fast: true, is_half_gain: false, micros: 0 }
    }
}

#[derive(Default)]
pub struct EmulatedHx711 {
    settings: EmulatedHx711Settings,
    /// When the sketch began, and its clock at that time.
    started: Option<(Nanos, u32)>,
    /// When the boot loader ends.
    boot_end: Nanos,
    /// Conversions since the start, or since the chip came back.
    conversions: u32,
    /// Whether the sketch has sent its `Started` message.
    has_begun: bool,
    next: Nanos,
    sum: f64,
    steps: u32,
    /// Means of the newest conversions, in volts.
    newest: [f64; SETTLING as usize],
    count: i32,
    missing_since: Option<Nanos>,
    is_chip_missing: bool,
    is_stuck: bool,
    is_saturated: bool,
    is_wrong: bool,
    output: Outbox,
}

impl EmulatedHx711 {
    /// A board that has been on for a while.
    pub fn new(settings: EmulatedHx711Settings) -> Self {
        let mut board = Self {
            started: Some((Nanos::ZERO, settings.micros)),
            settings,
            conversions: SETTLING,
            has_begun: true,
            ..Self::default()
        };
        board.next = board.period();
        board
    }

    /// Takes the chip off its wires, or puts it back.
    pub fn set_chip_missing(&mut self, is_missing: bool) {
        self.is_chip_missing = is_missing;
    }

    fn period(&self) -> Nanos {
        let rate = if self.settings.is_fast { 80.0 } else { 10.0 };
        Nanos((1e9 / (rate * OSCILLATOR)).round() as u64)
    }

    fn micros(&self, now: Nanos) -> u32 {
        let (since, first) = self.started.unwrap_or((now, 0));
        let run = (now.since(since).0 as f64 * RESONATOR / 1e3) as u64;
        // The board's counter has 32 bits.
        ((u64::from(first) + run) / MICROS_STEP * MICROS_STEP) as u32
    }

    fn header(&self) -> Header {
        Header {
            rate: match (self.conversions < SETTLING, self.settings.is_fast) {
                (true, _) => 0,
                (false, true) => 80,
                (false, false) => 10,
            },
            gain: if self.settings.is_half_gain { 64 } else { 128 },
            board: if self.is_wrong { "another".into() } else { self.settings.board.clone() },
        }
    }

    fn send(&mut self, message: &Message) {
        self.output.push(line(message).as_bytes());
    }

    fn restart(&mut self, now: Nanos) {
        self.started = None;
        self.boot_end = now + BOOT;
        self.conversions = 0;
        self.has_begun = false;
        self.missing_since = None;
        self.output.clear();
    }

    fn convert(&mut self, at: Nanos) {
        self.newest.rotate_left(1);
        if let Some(newest) = self.newest.last_mut() {
            *newest = match self.steps {
                0 => 0.0,
                steps => self.sum / f64::from(steps),
            };
        }
        let volts = self.newest.iter().sum::<f64>() / f64::from(SETTLING);
        (self.sum, self.steps) = (0.0, 0);
        if !self.is_stuck {
            let gain = if self.settings.is_half_gain { 0.5 } else { 1.0 };
            let count = (volts / FULL_SCALE_V * gain * f64::from(1 << 23)).round();
            // The cast saturates.
            self.count = (count as i32).clamp(COUNT_MIN, COUNT_MAX);
        }
        let count = if self.is_saturated { COUNT_MAX } else { self.count };
        self.conversions = self.conversions.saturating_add(1);
        let micros = self.micros(at);
        if self.conversions == SETTLING && !self.has_begun {
            self.has_begun = true;
            let header = self.header();
            self.send(&Message::Started { micros, header });
        } else if self.conversions > SETTLING {
            self.send(&Message::Value { micros, count });
        }
    }

    /// The sketch reports every [`MISSING_AFTER`] that the chip does not answer.
    fn wait_for_chip(&mut self, now: Nanos) {
        let since = *self.missing_since.get_or_insert(now);
        if now.since(since) >= MISSING_AFTER {
            self.missing_since = Some(now);
            self.conversions = 0;
            let micros = self.micros(now);
            self.send(&Message::Missing { micros });
        }
    }
}

impl EmulatedCell for EmulatedHx711 {
    fn receive(&mut self, now: Nanos, bytes: &[u8]) {
        if self.started.is_some() && bytes.contains(&b'?') {
            let message = Message::Header { micros: self.micros(now), header: self.header() };
            self.send(&message);
        }
    }

    fn advance(&mut self, now: Nanos, load: CellLoad) {
        if self.started.is_none() {
            if now < self.boot_end {
                return;
            }
            self.started = Some((self.boot_end, 0));
            self.next = self.boot_end + self.period();
            (self.sum, self.steps) = (0.0, 0);
        }
        self.sum += load.volts.0;
        self.steps += 1;
        if self.is_chip_missing {
            self.wait_for_chip(now);
            self.next = now + self.period();
            return;
        }
        self.missing_since = None;
        while self.next <= now {
            let at = self.next;
            self.convert(at);
            self.next = at + self.period();
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
                self.is_wrong = is_on;
                self.restart(now);
            }
        }
    }
}
