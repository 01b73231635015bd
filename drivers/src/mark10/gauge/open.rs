//! Opening a gauge.

use super::dialogue::{GaugeDialogue, GaugeScale};
use super::{FAREWELL, FILTER_MAX, GaugeSettings, RATES};
use crate::cell::{CellDescription, CellDevice};
use crate::mark10::protocol::{GaugeLine, GaugeList};
use crate::text::{DeviceError, OpenedCell, TextConsole};
use crate::wire::{HostClock, Link};
use palpate_model::Nanos;
use palpate_model::units::Volts;
use std::sync::Arc;

const DEVICE: &str = "Mark-10 gauge";
/// Gauges answer within some ms; a converter may keep an answer for 16.
const ANSWER_MAX: Nanos = Nanos::from_millis(500);
/// A line without a byte for so long has nothing more to say, at any latency of a USB converter.
const QUIET: Nanos = Nanos::from_millis(60);
/// Readings by which the rate is measured, and the shortest and longest time for it.
const MEASURED: usize = 10;
const MEASURE_MAX: Nanos = Nanos::from_millis(3_000);
/// A rate that is further off than a converter's packets explain is another one.
const RATE_OFF: f64 = 0.25;

impl CellDevice for GaugeSettings {
    /// Checks the identity of the gauge, sets it up and lets it send.
    fn open(
        &self,
        link: &mut dyn Link,
        clock: &HostClock,
        name: &Arc<str>,
    ) -> Result<OpenedCell, DeviceError> {
        check(self)?;
        let mut console = TextConsole::new(link, clock, name, DEVICE);
        silence_gauge(&mut console)?;
        let model = identify(&mut console, self)?;
        let set = set_up(&mut console, self, as_line)?;
        let set =
            set.ok_or_else(|| unfit("it no longer answers the command LIST; check its cable"))?;
        console.write("?C\r")?;
        let like = console.find(ANSWER_MAX, |line| match GaugeLine::parse(line) {
            GaugeLine::Reading(reading) => Some(reading),
            _ => None,
        })?;
        let like = like.ok_or_else(|| {
            unfit("it does not answer the command ?C with a reading; check its cable")
        })?;
        let scale = GaugeScale::new(like, self.capacity);
        console.write(&format!("AOUT{}\r", self.per_second))?;
        let rate = measure(&mut console, scale, self.per_second)?;
        let step = Volts(scale.volts_per_count());
        let filters = filters(&set);
        let description = CellDescription {
            identity: format!(
                "{model}firmware {}, {} to {}, {rate} readings per second{filters}",
                set.firmware, step.0, self.capacity
            ),
            adc: scale.adc(),
            noise_expected: self.noise_expected(step),
            rate,
            // The delay of its filters is not published.
            delay: Nanos::ZERO,
            newtons_per_volt: Some(1.0),
        };
        Ok(OpenedCell {
            description,
            dialogue: Box::new(GaugeDialogue::new(scale, rate, console.now())),
            raw: console.into_raw(),
            closing_bytes: FAREWELL.to_vec(),
        })
    }
}

pub(crate) fn check(settings: &GaugeSettings) -> Result<(), DeviceError> {
    if !RATES.contains(&settings.per_second) {
        let rates = RATES.map(|rate| rate.to_string()).join(", ");
        return Err(unfit(format!(
            "it cannot send {} readings a second; choose one of {rates}",
            settings.per_second
        )));
    }
    if settings.filter.is_some_and(|n| n > FILTER_MAX) {
        return Err(unfit(format!(
            "its filter must be from 0 to {FILTER_MAX}; a filter n averages 2^n samples"
        )));
    }
    if !(settings.capacity.0 > 0.0 && settings.capacity.0 < 1e6) {
        return Err(unfit("its capacity must be above 0 N; give the capacity on its label"));
    }
    Ok(())
}

/// Ends readings that the gauge sends by itself and half a command of an earlier program. Returns an error if it does
/// not answer `LIST` then.
fn silence_gauge(console: &mut TextConsole<'_>) -> Result<(), DeviceError> {
    console.write("\rAOUT0\r")?;
    console.drain(QUIET)?;
    // Once more: the first one may have ended half a command.
    console.write("AOUT0\r")?;
    console.drain(QUIET)?;
    if ask_list(console, as_line)?.is_some() {
        return Ok(());
    }
    let received = console.received();
    let lines: Vec<GaugeLine> = received.lines().map(GaugeLine::parse).collect();
    Err(if lines.iter().any(|line| matches!(line, GaugeLine::Error)) {
        unfit(
            "it refuses the command LIST, so it may be a gauge of Series 4, which sends only single readings; use a gauge of Series 5, 7 or 7i",
        )
    } else if lines.iter().any(|line| matches!(line, GaugeLine::Reading(_))) {
        unfit(
            "it sends readings but does not receive commands; check its cable and the choice of USB or RS-232 in its menu",
        )
    } else {
        console.no_answer(
            "check its power, its baud rate, and the choice of USB or RS-232 in its menu",
        )
    })
}

/// Model and serial number, where it reports them (`RN`, `RM`, `RS`; Series 5 user's guide, page 19).
fn identify(
    console: &mut TextConsole<'_>,
    settings: &GaugeSettings,
) -> Result<String, DeviceError> {
    let mut identity = String::new();
    let mut serial = None;
    for (command, what) in [("RN", ""), ("RM", ""), ("RS", "serial number ")] {
        if let Some(text) = ask_text(console, as_line, command)? {
            identity += &format!("{what}{text}, ");
            if command == "RS" {
                serial = Some(text);
            }
        }
    }
    DeviceError::check_serial(DEVICE, serial.as_deref(), settings.serial_number.as_deref())?;
    Ok(identity)
}

fn as_line(command: &str) -> String {
    format!("{command}\r")
}

/// Newtons, current readings with units and signs. What was refused shows in the settings read back; `None` where they
/// cannot be read. `wrap` makes of a command what is written.
pub(crate) fn set_up(
    console: &mut TextConsole<'_>,
    settings: &GaugeSettings,
    wrap: fn(&str) -> String,
) -> Result<Option<GaugeList>, DeviceError> {
    let polarity = format!("IPOL{}", u8::from(settings.is_reversed));
    let mut commands: Vec<String> =
        ["N", "CUR", "FULL", &polarity, "OPOL0", "AOFF0"].map(str::to_owned).into();
    let filters = settings.filter.map(|n| [format!("FLTC{n}"), format!("FLTP{n}")]);
    commands.extend(filters.into_iter().flatten());
    for command in commands {
        console.write(&wrap(&command))?;
        // Silent when it is done, and the language does not say how fast one may follow the other.
        console.drain(Nanos(QUIET.0 / 3))?;
    }
    let list = ask_list(console, wrap)?;
    if let Some(list) = &list {
        check_list(list, settings)?;
    }
    Ok(list)
}

fn ask_list(
    console: &mut TextConsole<'_>,
    wrap: fn(&str) -> String,
) -> Result<Option<GaugeList>, DeviceError> {
    console.write(&wrap("LIST"))?;
    console.find(ANSWER_MAX, |line| GaugeLine::parse(line).list())
}

/// The text that a command asks for, if the gauge has it.
pub(crate) fn ask_text(
    console: &mut TextConsole<'_>,
    wrap: fn(&str) -> String,
    command: &str,
) -> Result<Option<String>, DeviceError> {
    console.write(&wrap(command))?;
    let text = console.find(ANSWER_MAX, |line| GaugeLine::parse(line).text_or_error())?;
    Ok(text.flatten())
}

/// Whether a gauge has taken the settings.
fn check_list(set: &GaugeList, settings: &GaugeSettings) -> Result<(), DeviceError> {
    let wrong = |what: &str| {
        unfit(format!("it does not accept the setting {what}; its settings are {}", set.line))
    };
    if let Err(unit) = &set.unit {
        return Err(unfit(format!(
            "it measures in {unit}, which is not a unit of force; choose newtons in its menu"
        )));
    }
    if set.mode != "CUR" {
        return Err(wrong("CUR (current readings)"));
    }
    if !set.has_units {
        return Err(wrong("FULL (readings with units)"));
    }
    let is_reversed = set.is_inverted.unwrap_or(settings.is_reversed);
    if is_reversed != settings.is_reversed {
        let polarity = u8::from(settings.is_reversed);
        return Err(wrong(&format!("IPOL{polarity} (sign of compression)")));
    }
    if set.is_unsigned == Some(true) {
        return Err(wrong("OPOL0 (readings with signs)"));
    }
    let has_filters = [set.filter_displayed, set.filter_current]
        .iter()
        .all(|n| settings.filter.is_none() || n.is_none() || *n == settings.filter);
    if !has_filters {
        return Err(wrong("FLTC or FLTP (filters)"));
    }
    Ok(())
}

/// Its filters in words, for the operator and the log.
pub(crate) fn filters(set: &GaugeList) -> String {
    [("FLTC", set.filter_displayed), ("FLTP", set.filter_current)]
        .into_iter()
        .filter_map(|(name, n)| n.map(|n| format!(", {name}{n}")))
        .collect()
}

/// The requested rate, or the measured one where they differ: `AOUT1` of a 7i gives 50 a second (Model 7i user's
/// guide, page 30).
fn measure(
    console: &mut TextConsole<'_>,
    scale: GaugeScale,
    requested: u16,
) -> Result<f64, DeviceError> {
    let requested = f64::from(requested);
    let enough = MEASURED.max((0.2 * requested) as usize);
    let start = console.now();
    let mut times = Vec::new();
    while times.len() < enough && console.now().since(start) < MEASURE_MAX {
        if let Some((at, line)) = console.line(Nanos(MEASURE_MAX.0 / 2))?
            && let GaugeLine::Reading(reading) = GaugeLine::parse(&line)
            && reading.unit == scale.unit
        {
            times.push(at);
        }
    }
    let (Some(first), Some(last)) = (times.first(), times.last()) else {
        return Err(unfit(format!(
            "it sends no readings after the command AOUT{requested}; check its firmware"
        )));
    };
    let span = last.since(*first).0 as f64 * 1e-9;
    let measured = (times.len() - 1) as f64 / span;
    let is_other = times.len() >= 3 && (measured / requested - 1.0).abs() > RATE_OFF;
    Ok(if is_other { measured.round().max(1.0) } else { requested })
}

fn unfit(detail: impl Into<String>) -> DeviceError {
    DeviceError::unfit(DEVICE, detail)
}
