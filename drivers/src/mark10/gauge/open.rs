//! What happens once when a gauge is opened.

use super::dialogue::{GaugeDialogue, GaugeScale};
use super::{FAREWELL, FILTER_MAX, GaugeSettings, RATES};
use crate::cell::{CellDescription, CellDevice};
use crate::mark10::protocol::{GaugeLine, GaugeList, GaugeReading};
use crate::text::{DeviceError, OpenedCell, TextConsole, describe_unknown_device};
use crate::wire::{HostClock, Link};
use palpate_model::Nanos;
use palpate_model::rig::AdcDescription;
use palpate_model::units::Volts;
use std::sync::Arc;

pub(crate) const DEVICE: &str = "Mark-10 gauge";
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
    /// Makes sure which gauge it is, sets it up and lets it send.
    fn open(
        &self,
        link: &mut dyn Link,
        clock: &HostClock,
        name: &Arc<str>,
    ) -> Result<OpenedCell, DeviceError> {
        check(self)?;
        let mut console = TextConsole::new(link, clock, name, DEVICE);
        let found = quieten(&mut console)?;
        let model = identify(&mut console, self, &found)?;
        let set = set_up(&mut console, self)?;
        console.write("?C\r")?;
        let like =
            reading(&mut console)?.ok_or_else(|| unfit("it gives no reading to ?C".into()))?;
        let scale = GaugeScale::new(like, self.capacity);
        console.write(&format!("AOUT{}\r", self.per_second))?;
        let rate = measure(&mut console, scale, self.per_second)?;
        let step = Volts(scale.volts_per_count());
        let filters = filters(&set);
        let description = CellDescription {
            identity: format!(
                "{model}firmware {}, {} to {}, {rate} readings a second{filters}",
                set.firmware, step.0, self.capacity
            ),
            adc: AdcDescription {
                counts_min: -scale.counts_max,
                counts_max: scale.counts_max,
                volts_per_count: step.0,
            },
            noise_expected: self.noise_expected(step),
            rate,
            // Nothing is published of what its filters take.
            delay: Nanos::ZERO,
            newtons_per_volt: Some(1.0),
        };
        Ok(OpenedCell {
            description,
            dialogue: Box::new(GaugeDialogue::new(scale, rate, console.now())),
            raw: console.link.raw,
            farewell: FAREWELL.to_vec(),
        })
    }
}

pub(crate) fn check(settings: &GaugeSettings) -> Result<(), DeviceError> {
    if !RATES.contains(&settings.per_second) {
        let rates = RATES.map(|rate| rate.to_string()).join(", ");
        return Err(unfit(format!(
            "it does not send {} readings a second; choose one of {rates}",
            settings.per_second
        )));
    }
    if settings.filter.is_some_and(|n| n > FILTER_MAX) {
        return Err(unfit(format!("its filter goes from 0 to {FILTER_MAX}: 2^n samples")));
    }
    if !(settings.capacity.0 > 0.0 && settings.capacity.0 < 1e6) {
        return Err(unfit("its capacity must be above 0 N, as on its label".into()));
    }
    Ok(())
}

/// No readings by itself from here on; whatever was half said is over. Gives the settings that were found.
fn quieten(console: &mut TextConsole<'_>) -> Result<GaugeList, DeviceError> {
    console.write("\rAOUT0\r")?;
    console.drain(QUIET)?;
    // Once more: the first may have ended half a command of somebody before.
    console.write("AOUT0\r")?;
    console.drain(QUIET)?;
    if let Some(list) = list(console)? {
        return Ok(list);
    }
    let heard = String::from_utf8_lossy(&console.heard).into_owned();
    let lines: Vec<GaugeLine> = heard.lines().map(GaugeLine::parse).collect();
    if heard.is_empty() {
        return Err(DeviceError::Silent {
            device: DEVICE,
            hint: "check that it is on, its baud rate, and whether its menu sends over USB or RS-232",
        });
    }
    if lines.iter().any(|line| matches!(line, GaugeLine::Error(_))) {
        return Err(unfit(
            "it refuses LIST, as gauges of Series 4 do, which send single readings only; use one of Series 5, 7 or 7i"
                .into(),
        ));
    }
    if lines.iter().any(|line| matches!(line, GaugeLine::Reading(_))) {
        return Err(unfit(
            "it sends readings and hears nothing; check its cable and whether its menu listens to USB or RS-232"
                .into(),
        ));
    }
    Err(DeviceError::Other { device: DEVICE, found: describe_unknown_device(&console.heard) })
}

/// Model and serial number, where it tells them (`RN`, `RM`, `RS`; Series 5 user's guide, page 19).
fn identify(
    console: &mut TextConsole<'_>,
    settings: &GaugeSettings,
    found: &GaugeList,
) -> Result<String, DeviceError> {
    let mut identity = String::new();
    let mut serial = None;
    for (command, what) in [("RN", ""), ("RM", ""), ("RS", "serial number ")] {
        console.write(&format!("{command}\r"))?;
        let answer = console.find(ANSWER_MAX, |line| match GaugeLine::parse(line) {
            GaugeLine::Other(text) => Some(Some(text)),
            // A serial number may be all digits; a reading never is without its unit.
            GaugeLine::Error(_) => Some(None),
            _ => None,
        })?;
        if let Some(text) = answer.flatten() {
            identity += &format!("{what}{text}, ");
            if command == "RS" {
                serial = Some(text);
            }
        }
    }
    if let Some(expected) = &settings.serial_number
        && serial.as_ref() != Some(expected)
    {
        return Err(DeviceError::OtherSerial {
            device: DEVICE,
            found: serial.unwrap_or_else(|| format!("none that firmware {} tells", found.firmware)),
            expected: expected.clone(),
        });
    }
    Ok(identity)
}

/// Newtons, current readings with units and signs. What was refused shows in the settings read back.
fn set_up(
    console: &mut TextConsole<'_>,
    settings: &GaugeSettings,
) -> Result<GaugeList, DeviceError> {
    for command in commands(settings) {
        console.write(&format!("{command}\r"))?;
        // Silent when it is done, and the language does not say how fast one may follow the other.
        console.drain(Nanos(QUIET.0 / 3))?;
    }
    let set = list(console)?.ok_or_else(|| unfit("it no longer answers LIST".into()))?;
    check_list(&set, settings)?;
    Ok(set)
}

/// What a gauge is told before it is read: each is silent when it is done.
pub(crate) fn commands(settings: &GaugeSettings) -> Vec<String> {
    let polarity = format!("IPOL{}", u8::from(settings.is_reversed));
    let mut commands: Vec<String> =
        ["N", "CUR", "FULL", &polarity, "OPOL0", "AOFF0"].map(str::to_owned).into();
    let filters = settings.filter.map(|n| [format!("FLTC{n}"), format!("FLTP{n}")]);
    commands.extend(filters.into_iter().flatten());
    commands
}

/// Whether a gauge is set as [`commands`] asked.
pub(crate) fn check_list(set: &GaugeList, settings: &GaugeSettings) -> Result<(), DeviceError> {
    let wrong = |what: &str| unfit(format!("it does not take {what}; it says {}", set.line));
    if let Err(unit) = &set.unit {
        return Err(unfit(format!(
            "it measures in {unit}, which is no unit of force; choose newtons in its menu"
        )));
    }
    if set.mode != "CUR" {
        return Err(wrong("CUR, the mode of current readings"));
    }
    if !set.has_units {
        return Err(wrong("FULL, readings with their units"));
    }
    let is_reversed = set.is_inverted.unwrap_or(settings.is_reversed);
    if is_reversed != settings.is_reversed {
        let polarity = u8::from(settings.is_reversed);
        return Err(wrong(&format!("IPOL{polarity}, the sign of pressing")));
    }
    if set.is_unsigned == Some(true) {
        return Err(wrong("OPOL0, readings with their signs"));
    }
    let has_filters = [set.filter_displayed, set.filter_current]
        .iter()
        .all(|n| settings.filter.is_none() || n.is_none() || *n == settings.filter);
    if !has_filters {
        return Err(wrong("FLTC and FLTP, its filters"));
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

fn list(console: &mut TextConsole<'_>) -> Result<Option<GaugeList>, DeviceError> {
    console.write("LIST\r")?;
    console.find(ANSWER_MAX, |line| match GaugeLine::parse(line) {
        GaugeLine::List(list) => Some(list),
        _ => None,
    })
}

fn reading(console: &mut TextConsole<'_>) -> Result<Option<GaugeReading>, DeviceError> {
    console.find(ANSWER_MAX, |line| match GaugeLine::parse(line) {
        GaugeLine::Reading(reading) => Some(reading),
        _ => None,
    })
}

/// The rate that was asked for, or what comes when that is another: `AOUT1` of a 7i gives 50 a second (Model 7i user's
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
            "it sends no readings after AOUT{requested}; check its firmware"
        )));
    };
    let span = last.since(*first).0 as f64 * 1e-9;
    let measured = (times.len() - 1) as f64 / span;
    let is_other = times.len() >= 3 && (measured / requested - 1.0).abs() > RATE_OFF;
    Ok(if is_other { measured.round().max(1.0) } else { requested })
}

pub(crate) fn unfit(detail: String) -> DeviceError {
    DeviceError::Unfit { device: DEVICE, detail }
}
