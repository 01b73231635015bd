//! A load cell that sends plain numbers: one per line, at a rate of its own, as an Arduino, an ESP32 or a weighing
//! indicator does that prints `12345` or `1.234`, with or without a time before it.
//!
//! Nothing is asked and nothing is written. A line counts only if it is what the rig file says and nothing else, with
//! as many digits behind the point as when the cell was opened. Every other line is counted as garbled and stands in
//! the log of bytes as it came. There is no checksum: a digit that was lost on the way leaves a number, which shows
//! only as a jump of the force.

use crate::board_clock::{BoardClock, BoardTime};
use crate::cell::{CellDescription, CellDevice, CellProtocol, CellReports, LineCell, silence_max};
use crate::devices::{DeviceKind, DeviceRole, LineEmulation, split_lines};
use crate::mark10::protocol::ForceUnit;
use crate::rig_file::Fields;
use crate::text::{DeviceError, FixedDecimal, OpenedCell, TextConsole};
use crate::wire::{HostClock, Link};
use palpate_model::Nanos;
use palpate_model::rig::AdcDescription;
use palpate_model::units::Volts;
use std::sync::Arc;

pub(crate) const KIND: DeviceKind = DeviceKind {
    word: "plain-numbers",
    title: "a device that sends plain numbers",
    introduction: "a device that sends plain numbers, such as a load cell: ",
    role: DeviceRole::Cell {
        read: |fields| Some(Arc::new(PlainNumbers::read(fields)?)),
        emulation: Some(LineEmulation {
            rate: 80.0,
            // A 24-bit converter whose whole range is 5 V behind the usual amplifier.
            line: |_, volts| format!("{:.0}\r\n", volts.0 / 5.0 * 8_388_607.0),
        }),
    },
    // The first line may be the end of one. Many devices send a single number.
    recognise: |lines| match lines {
        [_, first, second, rest @ ..] => {
            let mut all = [first, second].into_iter().chain(rest);
            all.all(|line| FixedDecimal::parse(line).is_some()).then_some(*first)
        }
        _ => None,
    },
};

const DEVICE: &str = "load cell that sends plain numbers";
/// Opening the port resets an Arduino, whose boot loader waits up to two seconds; sketches take their time to begin.
const START_MAX: Nanos = Nanos::from_millis(8_000);
/// Lines that come closer than this may have waited somewhere; looked for ten times as long.
const BACKLOG: Nanos = Nanos::from_millis(20);
/// A longer pause between two numbers is a start; slower cells leave the axis too long unseen.
const PAUSE_MAX: Nanos = Nanos::from_millis(1_100);
/// The rate is measured over so long, and over so many numbers.
const MEASURE: Nanos = Nanos::from_millis(1_000);
const MEASURED: usize = 5;
/// Volts that a range of counts stands for, as for an HX711 board.
const FULL_SCALE: Volts = Volts(5.0);
const QUOTE_MAX: usize = 40;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Unit {
    /// Counts of a converter; the volts stand for its whole range.
    Counts(Volts),
    /// A signal, and how many volts one is.
    Signal(f64),
    /// A force of a cell that is calibrated; a newton counts as a volt, as that of a gauge does.
    Force(ForceUnit),
}

const UNITS: [(&str, (&str, Unit)); 9] = [
    ("counts", ("counts", Unit::Counts(FULL_SCALE))),
    ("V", ("V", Unit::Signal(1.0))),
    ("mV", ("mV", Unit::Signal(1e-3))),
    ("N", ("N", Unit::Force(ForceUnit::Newton))),
    ("mN", ("mN", Unit::Force(ForceUnit::Millinewton))),
    ("kN", ("kN", Unit::Force(ForceUnit::Kilonewton))),
    ("gF", ("gF", Unit::Force(ForceUnit::Gram))),
    ("kgF", ("kgF", Unit::Force(ForceUnit::Kilogram))),
    ("lbF", ("lbF", Unit::Force(ForceUnit::Pound))),
];

#[derive(Clone, Debug, PartialEq)]
pub struct PlainNumbers {
    unit: Unit,
    unit_name: &'static str,
    /// End of the range on both sides, in the unit.
    full_scale: f64,
    is_reversed: bool,
    /// Length of a tick of the time before each number, where there is one.
    nanos_per_tick: Option<u64>,
    noise: Option<f64>,
}

impl PlainNumbers {
    pub fn read(fields: &mut Fields) -> Option<Self> {
        let unit = fields.choice("cell.unit", &UNITS, None);
        let full_scale = fields.required_number("cell.full_scale", 1e-6, 1e8);
        let volts = fields.number("cell.full_scale_v", 1e-3, 1000.0).map(Volts);
        let noise = fields.number("cell.noise", 1e-9, 1e8);
        let directions = [("compression", false), ("tension", true)];
        let is_reversed = fields.choice("cell.direction", &directions, Some(false));
        let times = [("none", None), ("ms", Some(1_000_000)), ("us", Some(1_000))];
        let nanos_per_tick = fields.choice("cell.time_column", &times, Some(None));
        let (unit_name, unit) = unit?;
        let unit = match (unit, volts) {
            (Unit::Counts(usual), volts) => Unit::Counts(volts.unwrap_or(usual)),
            (unit, None) => unit,
            (_, Some(_)) => {
                let message = "this key needs unit = \"counts\"; remove the key or change the unit";
                fields.mistake("cell.full_scale_v", message);
                return None;
            }
        };
        Some(Self {
            unit,
            unit_name,
            full_scale: full_scale?,
            is_reversed: is_reversed?,
            nanos_per_tick: nanos_per_tick?,
            noise,
        })
    }

    fn volts_per_unit(&self) -> f64 {
        match self.unit {
            Unit::Counts(full_scale) => full_scale.0 / self.full_scale,
            Unit::Signal(volts) => volts,
            Unit::Force(unit) => unit.newtons(),
        }
    }

    /// A line that is what the rig file says: the ticks of its time, where it has one, and its number.
    fn parse(&self, line: &str) -> Option<(u32, FixedDecimal)> {
        let (ticks, number) = match self.nanos_per_tick {
            None => (0, line),
            Some(_) => {
                let (ticks, number) = line.split_once([',', ';', ' '])?;
                let ticks = ticks.trim();
                // A counter has no sign.
                let is_plain = ticks.bytes().all(|byte| byte.is_ascii_digit());
                (ticks.parse().ok().filter(|_| is_plain)?, number)
            }
        };
        let number = number.trim();
        let unsigned = number.strip_prefix('+');
        if unsigned.is_some_and(|rest| rest.starts_with('-')) {
            return None;
        }
        Some((ticks, FixedDecimal::parse(unsigned.unwrap_or(number))?))
    }

    /// Waits for numbers that come one after the other; gives one of them and their rate.
    fn measure(&self, console: &mut TextConsole<'_>) -> Result<(FixedDecimal, f64), DeviceError> {
        let start = console.now();
        let mut all: Vec<(Nanos, u32, FixedDecimal)> = Vec::new();
        let mut wrong = None;
        // Buffered lines come at once and do not show the rate; the line after them may be the end of one.
        console.drain(BACKLOG)?;
        console.line(START_MAX)?;
        while let Some(rest) = START_MAX.0.checked_sub(console.now().since(start).0) {
            let Some((at, line)) = console.line(Nanos(rest))? else {
                break;
            };
            let Some((ticks, number)) = self.parse(&line) else {
                // Sketches print text when they start.
                wrong = Some(line);
                all.clear();
                continue;
            };
            if all.last().is_some_and(|(last, ..)| at.since(*last) > PAUSE_MAX) {
                all.clear();
            }
            all.push((at, ticks, number));
            let (first_at, first_ticks, first) = all[0];
            if number.decimals != first.decimals {
                return Err(unfit(format!(
                    "the number of digits after the point has changed from {} to {}; print all numbers with the same number of digits",
                    first.decimals, number.decimals
                )));
            }
            let span = at.since(first_at);
            if span >= MEASURE && all.len() > MEASURED {
                let steps = (all.len() - 1) as f64;
                let nanos = match self.nanos_per_tick {
                    None => span.0 as f64,
                    Some(nanos) => f64::from(ticks.wrapping_sub(first_ticks)) * nanos as f64,
                };
                return Ok((number, steps * 1e9 / nanos.max(1.0)));
            }
        }
        Err(self.no_numbers_error(console, wrong))
    }

    fn no_numbers_error(&self, console: &TextConsole<'_>, wrong: Option<String>) -> DeviceError {
        let received = console.received();
        let Some(line) = wrong else {
            return if received.is_empty() {
                console.no_answer("check the port, the cable and that the board sends numbers without being asked")
            } else {
                unfit("it sends less than one number per second; make it send numbers more often")
            };
        };
        let other = DeviceKind::recognise_lines(&split_lines(&received));
        if let Some((kind, _)) = other.filter(|(kind, _)| kind.word != KIND.word) {
            return DeviceError::Other { device: DEVICE, found: kind.title.into() };
        }
        let quote: String = line.chars().take(QUOTE_MAX).collect();
        let wanted = match self.nanos_per_tick {
            None => "a number alone",
            Some(_) => "a time, a comma and a number",
        };
        unfit(format!(
            "it sends {quote:?}, but the rig file expects {wanted}; correct cell.time_column in the rig file, or correct the output of the board"
        ))
    }
}

impl CellDevice for PlainNumbers {
    fn open(
        &self,
        link: &mut dyn Link,
        clock: &HostClock,
        name: &Arc<str>,
    ) -> Result<OpenedCell, DeviceError> {
        let mut console = TextConsole::new(link, clock, name, DEVICE);
        let (like, rate) = self.measure(&mut console)?;
        let counts_max = (self.full_scale / like.step()).round();
        if counts_max > f64::from(i32::MAX) {
            return Err(unfit(format!(
                "full_scale = {} is too large for numbers with {} digits after the point; lower full_scale",
                self.full_scale, like.decimals
            )));
        }
        let per_count = like.step() * self.volts_per_unit();
        let noise = match self.noise {
            Some(noise) => noise * self.volts_per_unit(),
            // Without better knowledge, the rounding to steps of the last digit.
            None => per_count / 12.0_f64.sqrt(),
        };
        let description = CellDescription {
            identity: format!(
                "plain numbers in {}, {} digits after the point, up to {}, {}",
                self.unit_name,
                like.decimals,
                self.full_scale,
                match self.nanos_per_tick {
                    None => "without times",
                    Some(_) => "with times",
                }
            ),
            adc: AdcDescription {
                counts_min: -(counts_max as i32),
                counts_max: counts_max as i32,
                volts_per_count: per_count,
            },
            noise_expected: Volts(noise),
            rate,
            // What the board averages over is not known.
            delay: Nanos::ZERO,
            newtons_per_volt: matches!(self.unit, Unit::Force(_)).then_some(1.0),
        };
        let numbers = PlainNumberReader {
            cell: self.clone(),
            decimals: like.decimals,
            counts_max: counts_max as i32,
            per_count,
            clock: BoardClock::new(self.nanos_per_tick.unwrap_or(1)),
            silence_max: silence_max(rate),
            is_begun: false,
        };
        Ok(OpenedCell {
            description,
            dialogue: Box::new(LineCell::start(numbers, console.now())),
            raw: console.into_raw(),
            closing_bytes: Vec::new(),
        })
    }
}

struct PlainNumberReader {
    cell: PlainNumbers,
    decimals: u8,
    counts_max: i32,
    per_count: f64,
    clock: BoardClock,
    silence_max: Nanos,
    /// A whole line has ended: the first one may have begun before the cell was opened.
    is_begun: bool,
}

impl CellProtocol for PlainNumberReader {
    fn take(&mut self, now: Nanos, line: &str, reports: &mut CellReports) -> bool {
        if !std::mem::replace(&mut self.is_begun, true) {
            return true;
        }
        let Some((ticks, number)) = self.cell.parse(line) else {
            return false;
        };
        if number.decimals != self.decimals {
            return false;
        }
        let has_times = self.cell.nanos_per_tick.is_some();
        let device_time = match has_times.then(|| self.clock.take(now, ticks)) {
            None => None,
            Some(BoardTime::At(time)) => Some(time),
            Some(BoardTime::Repeated) => return false,
            Some(BoardTime::Restarted(time)) => {
                reports.push_trouble("the board has restarted; check its supply");
                Some(time)
            }
        };
        let is_beyond = number.digits.saturating_abs() >= self.counts_max;
        reports.set_beyond_range(
            is_beyond,
            "its reading is at or beyond full scale; take the load off, or correct cell.full_scale in the rig file",
        );
        let counts = if self.cell.is_reversed { -number.digits } else { number.digits };
        reports.push_counts(now, device_time, counts, self.per_count);
        true
    }

    fn is_dead(&self, now: Nanos, newest: Nanos) -> Option<String> {
        (now.since(newest) > self.silence_max).then(|| {
            let secs = self.silence_max.seconds().0;
            format!("it has sent no number for {secs:.1} s; check its cable and supply")
        })
    }
}

fn unfit(detail: impl Into<String>) -> DeviceError {
    DeviceError::unfit(DEVICE, detail)
}

#[cfg(test)]
mod tests;
