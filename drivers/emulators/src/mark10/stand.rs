//! A stand ESM301 or ESM303 with a gauge on it (ESM301 user's guide, page 24; ESM303 user's guide, pages
//! 31 and 32).
//!
//! Guesses, as the guides do not say: answers end with CR LF and have units; setting something is silent; `p` gives three
//! groups of letters with blanks between; acceleration; a limit that is changed while the crosshead moves holds at once;
//! unknown letters are passed over.

use super::gauge::{EmulatedGauge, EmulatedGaugeSettings};
use crate::cell::{CellLoad, EmulatedCell};
use crate::wire::Outbox;
use crate::{DeviceFault, EmulatedDevice, EmulatedPlant};
use palpate_drivers::sim::SimSettings;
use palpate_model::Nanos;
use palpate_model::rig::HandAction;
use palpate_model::units::Seconds;

/// Time step of the plant and the gauge.
const STEP: Nanos = Nanos::from_millis(1);
/// Guessed acceleration of the crosshead, in mm/s².
const ACCELERATION: f64 = 100.0;
/// Slowest and fastest speed in mm/min: 0.5 to 1100 (a guess after the ESM303's brochure).
const SPEED_MIN: f64 = 0.5;
const SPEED_MAX: f64 = 1_100.0;
const INCH: f64 = 25.4;
/// Longest time that is caught up in one go.
const CATCH_UP: Nanos = Nanos::from_millis(2_000);

#[derive(Clone, Debug, Default, PartialEq)]
pub struct EmulatedStandSettings {
    /// Specimen, seed and so on, as for the simulated rig.
    pub sim: SimSettings,
    pub gauge: EmulatedGaugeSettings,
    /// Without the option PC Control the stand ignores letters that move or set something.
    pub is_without_control: bool,
    /// Delay from a letter that moves the crosshead to its first step.
    pub reaction: Nanos,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Manual,
    Limit,
    Cycle,
}

/// The number of a letter that is still coming.
#[derive(Clone, Debug)]
struct Number {
    letter: u8,
    text: String,
}

pub struct EmulatedStand {
    settings: EmulatedStandSettings,
    plant: EmulatedPlant,
    gauge: EmulatedGauge,
    now: Nanos,
    is_gauge_addressed: bool,
    number: Option<Number>,
    mode: Mode,
    is_inches: bool,
    /// In mm/min.
    speed: f64,
    programmed: f64,
    lower: f64,
    upper: f64,
    cycles: u16,
    /// In mm upwards from where it was switched on.
    position: f64,
    zero: f64,
    /// In mm/s, upwards.
    velocity: f64,
    /// Commanded direction: 1 up, -1 down, 0 stop.
    direction: f64,
    /// When a motion that was commanded begins.
    moves_from: Nanos,
    output: Outbox,
}

impl EmulatedStand {
    /// A stand in manual mode, its travel zero where it is.
    pub fn new(settings: EmulatedStandSettings) -> Self {
        let tick = Seconds(STEP.0 as f64 * 1e-9);
        Self {
            plant: EmulatedPlant::new(&settings.sim, tick),
            gauge: EmulatedGauge::new(settings.gauge.clone()),
            settings,
            now: Nanos::ZERO,
            is_gauge_addressed: false,
            number: None,
            mode: Mode::Manual,
            is_inches: false,
            speed: 60.0,
            programmed: 60.0,
            lower: -100.0,
            upper: 100.0,
            cycles: 0,
            position: 0.0,
            zero: 0.0,
            velocity: 0.0,
            direction: 0.0,
            moves_from: Nanos::ZERO,
            output: Outbox::default(),
        }
    }

    pub fn plant(&self) -> &EmulatedPlant {
        &self.plant
    }

    /// Its own travel in mm, for tests.
    pub fn travel(&self) -> f64 {
        self.position - self.zero
    }

    /// Whether the crosshead moves, for tests.
    pub fn is_moving(&self) -> bool {
        self.velocity != 0.0
    }

    fn send_line(&mut self, text: &str) {
        self.output.push(format!("{text}\r\n").as_bytes());
    }

    fn length(&self, mm: f64) -> String {
        let (value, decimals, unit) =
            if self.is_inches { (mm / INCH, 3, "in") } else { (mm, 2, "mm") };
        let text = format!("{value:.decimals$} {unit}");
        match text.strip_prefix('-') {
            Some(rest) if rest.starts_with("0.00 ") || rest.starts_with("0.000 ") => rest.into(),
            _ => text,
        }
    }

    fn status(&self) -> String {
        let crosshead = match self.velocity {
            up if up > 0.0 => "U",
            0.0 => "S",
            _ => "D",
        };
        let mode = match self.mode {
            Mode::Manual => "M",
            Mode::Limit => "L",
            Mode::Cycle => "C",
        };
        let switch = if self.plant.is_reverse_limit() {
            " UL"
        } else if self.plant.is_forward_limit() {
            " DL"
        } else {
            ""
        };
        format!("{crosshead} {mode}{switch}")
    }

    fn take_byte(&mut self, byte: u8) {
        if self.is_gauge_addressed {
            if byte == b'\\' {
                self.is_gauge_addressed = false;
            } else {
                self.gauge.receive(self.now, &[byte]);
                self.forward_gauge_output();
            }
            return;
        }
        if let Some(mut number) = self.number.take() {
            number.text.push(char::from(byte));
            if self.is_complete(&number) {
                self.set(&number);
            } else {
                self.number = Some(number);
            }
            return;
        }
        self.handle_letter(byte);
    }

    /// Whether a number is complete or can no longer become one.
    fn is_complete(&self, number: &Number) -> bool {
        let digits = number.text.strip_prefix('-').unwrap_or(&number.text);
        let length = match (number.letter, self.is_inches) {
            (b'e', false) | (b'g' | b'h', _) => 6,
            (b'e', true) => 5,
            _ => 4,
        };
        digits.len() >= length || !digits.bytes().all(|b| b.is_ascii_digit() || b == b'.')
    }

    fn set(&mut self, number: &Number) {
        let Ok(value) = number.text.parse::<f64>() else {
            return;
        };
        let mm = if self.is_inches { value * INCH } else { value };
        if self.settings.is_without_control {
            return;
        }
        match number.letter {
            b'e' if (SPEED_MIN..=SPEED_MAX).contains(&mm) => {
                self.speed = mm;
                self.programmed = mm;
            }
            b'g' => self.lower = mm,
            b'h' => self.upper = mm,
            b'f' => self.cycles = value as u16,
            _ => {}
        }
    }

    /// The answer to a letter; none where it sets something or is unknown.
    fn answer(&self, byte: u8) -> Option<String> {
        Some(match byte {
            b'n' => {
                format!("{}\r\n{}", self.gauge.displayed_reading(), self.length(self.travel()))
            }
            b'x' => self.length(self.travel()),
            // Readings without slashes (ESM303 user's guide, page 32).
            b'X' | b'?' => self.gauge.displayed_reading(),
            _ if self.settings.is_without_control => return None,
            b'a' if self.is_inches => format!("{:.2} in/min", self.speed / INCH),
            b'a' => format!("{:.1} mm/min", self.speed),
            b'v' => self.length(self.upper),
            b'w' => self.length(self.lower),
            b'p' => self.status(),
            b'q' => "0".to_owned(),
            b'r' => self.cycles.to_string(),
            _ => return None,
        })
    }

    fn handle_letter(&mut self, byte: u8) {
        if let Some(answer) = self.answer(byte) {
            return self.send_line(&answer);
        }
        match byte {
            b'/' => self.is_gauge_addressed = true,
            b'e' | b'f' | b'g' | b'h' => {
                self.number = Some(Number { letter: byte, text: String::new() });
            }
            _ if self.settings.is_without_control => {}
            _ => self.control(byte),
        }
    }

    /// Letters of the option PC Control.
    fn control(&mut self, byte: u8) {
        match byte {
            b'u' | b'd' => {
                self.direction = if byte == b'u' { 1.0 } else { -1.0 };
                self.moves_from = self.now + self.settings.reaction;
            }
            b's' => self.direction = 0.0,
            b'i' => self.is_inches = false,
            b'b' => self.is_inches = true,
            b'z' => self.zero = self.position,
            b'l' => self.mode = Mode::Limit,
            b'm' => self.mode = Mode::Manual,
            b'c' => self.mode = Mode::Cycle,
            b'j' => self.speed = SPEED_MAX,
            b'k' => self.speed = SPEED_MIN,
            b'o' => self.speed = self.programmed,
            _ => {}
        }
    }

    /// Distance to the next limit in a direction, in mm.
    fn room(&self, direction: f64) -> f64 {
        let is_switched = if direction > 0.0 {
            self.plant.is_reverse_limit()
        } else {
            self.plant.is_forward_limit()
        };
        if is_switched {
            return 0.0;
        }
        if self.mode == Mode::Manual {
            return f64::INFINITY;
        }
        let end = if direction > 0.0 { self.upper } else { self.lower };
        (direction * (end - self.travel())).max(0.0)
    }

    fn move_crosshead(&mut self, dt: f64) {
        let direction = if self.velocity == 0.0 { self.direction } else { self.velocity.signum() };
        if direction == 0.0 || self.velocity == 0.0 && self.now < self.moves_from {
            return;
        }
        let room = self.room(direction);
        // The fastest speed from which it comes to rest in the room there is; steps of dt make it a little less.
        let brake = ACCELERATION * dt;
        let end_speed = (brake * brake / 4.0 + 2.0 * ACCELERATION * room).sqrt() - brake / 2.0;
        let target =
            if self.direction == direction { (self.speed / 60.0).min(end_speed) } else { 0.0 };
        let speed = self.velocity.abs();
        let speed = if target > speed {
            (speed + brake).min(target)
        } else if room == 0.0 {
            0.0
        } else {
            (speed - brake).max(target)
        };
        let step = (speed * dt).min(room);
        self.position += direction * step;
        // Less than a tenth of its resolution is there.
        let is_there = self.mode != Mode::Manual && room - step < 1e-3;
        if is_there {
            self.position += direction * (room - step);
        }
        let is_over = is_there || speed == 0.0;
        self.velocity = if is_over { 0.0 } else { direction * speed };
        if is_over && self.direction == direction {
            self.direction = 0.0;
        }
    }

    fn forward_gauge_output(&mut self) {
        self.output.push(&self.gauge.transmit());
    }

    fn restart(&mut self) {
        let fresh = Self::new(self.settings.clone());
        self.zero = self.position;
        (self.velocity, self.direction) = (0.0, 0.0);
        (self.mode, self.is_inches, self.is_gauge_addressed) = (Mode::Manual, false, false);
        (self.speed, self.programmed) = (fresh.speed, fresh.programmed);
        (self.lower, self.upper) = (fresh.lower, fresh.upper);
        self.number = None;
        self.output.clear();
    }
}

impl EmulatedDevice for EmulatedStand {
    fn receive(&mut self, now: Nanos, _channel: usize, bytes: &[u8]) {
        self.advance(now);
        for byte in bytes {
            self.take_byte(*byte);
        }
    }

    fn advance(&mut self, now: Nanos) {
        // After a long gap only its last two seconds are simulated: enough for the crosshead to reach its end.
        if now.since(self.now) > CATCH_UP {
            self.now = Nanos(now.0 - CATCH_UP.0);
        }
        while self.now + STEP <= now {
            self.now = self.now + STEP;
            let dt = STEP.0 as f64 * 1e-9;
            self.move_crosshead(dt);
            self.plant.advance(-self.position, Seconds(dt));
            let load = CellLoad { volts: self.plant.volts(), force: self.plant.cell_force() };
            self.gauge.advance(self.now, load);
            self.forward_gauge_output();
        }
    }

    fn transmit(&mut self, _channel: usize) -> Vec<u8> {
        self.output.take()
    }

    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool) {
        self.gauge.apply_fault(now, fault, is_on);
        if fault == DeviceFault::Reset && is_on || fault == DeviceFault::WrongDevice {
            self.restart();
        }
    }

    fn apply_hand_action(&mut self, _now: Nanos, action: HandAction) {
        self.plant.apply_hand_action(action);
    }
}
