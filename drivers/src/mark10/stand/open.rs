//! Opening a stand: it is stopped, its travel is limited, its gauge is set up. Nothing moves.

use super::protocol::{ForceTravelPair, STOP, StandStatus, ask_limit, number, set_limit, to_gauge};
use super::session::{StandPace, TICK};
use super::{LAG, MM_PER_PULSE, REST_TOLERANCE_MM, StandSettings};
use crate::mark10::gauge::{self, GaugeScale};
use crate::mark10::protocol::{GaugeForce, GaugeLine, GaugeList, GaugeReading};
use crate::text::{DeviceError, TextConsole};
use crate::wire::{HostClock, Link, LinkStats};
use palpate_model::Nanos;
use palpate_model::rig::{RawBytes, RigDescription};
use palpate_model::units::{MmPerS, Volts};
use std::collections::BTreeMap;
use std::sync::Arc;

const DEVICE: &str = "Mark-10 stand";
const ANSWER_MAX: Nanos = Nanos::from_millis(500);
/// A line without a byte for so long has nothing more to say, at any latency of a USB converter.
const QUIET: Nanos = Nanos::from_millis(60);
const MEASURED: usize = 20;
/// Speeds are written in tenths of mm/min (ESM301 user's guide, page 24).
const SPEED_QUANTUM: MmPerS = MmPerS(0.1 / 60.0);
/// Beyond both ends of the travel until moves set limits of their own, in hundredths of mm.
const MARGIN: i64 = 1_000;
/// A question at least so often apart: a sample has a tick of its own.
const EVERY_MIN: Nanos = Nanos::from_millis(2);
/// Other questions take samples away: they come further apart by this.
const BETWEEN: f64 = 1.5;

#[derive(Clone, Debug)]
pub struct ConnectedStand {
    pub description: RigDescription,
    /// Conversion of its readings to counts.
    pub scale: GaugeScale,
    pub pace: StandPace,
    pub stats: LinkStats,
    pub raw: Vec<RawBytes>,
}

pub fn connect(
    link: &mut dyn Link,
    clock: &HostClock,
    settings: &StandSettings,
    name: &Arc<str>,
) -> Result<ConnectedStand, DeviceError> {
    gauge::check(&settings.gauge)?;
    let mut console = TextConsole::new(link, clock, name, DEVICE);
    // Ends half a command: a stop, the channel to the gauge closed, readings that the gauge sends by itself ended.
    console.write(&format!("\\{STOP}{}", to_gauge("AOUT0")))?;
    console.drain(QUIET)?;
    // Millimetres, and the mode that keeps to travel limits.
    for command in ["i", "l"] {
        console.write(command)?;
        console.drain(Nanos(QUIET.0 / 3))?;
    }
    if sample(&mut console)?.is_none() {
        return Err(no_answer_error(&console));
    }
    let (list, serial) = set_up_gauge(&mut console, settings)?;
    let has_status = check_status(&mut console)?;
    let (like, travel) = sample(&mut console)?.ok_or_else(|| no_answer_error(&console))?;
    set_limits(&mut console, settings, travel)?;
    let (stats, pace) = measure(&mut console, has_status)?;
    let scale = GaugeScale::new(like, settings.gauge.capacity);
    let devices = format!(
        "Mark-10 stand with gauge{serial}, firmware {}{}",
        list.firmware,
        gauge::filters(&list)
    );
    Ok(ConnectedStand {
        description: describe(settings, scale, pace, &devices),
        scale,
        pace,
        stats,
        raw: console.into_raw(),
    })
}

fn sample(console: &mut TextConsole<'_>) -> Result<Option<(GaugeReading, i64)>, DeviceError> {
    console.write("n")?;
    let mut pair = ForceTravelPair::default();
    let mut is_over = false;
    let mut is_inches = false;
    let found = console.find(ANSWER_MAX, |line| {
        is_inches |= line.ends_with(" in");
        match pair.take(line)? {
            (GaugeForce::Reading(reading), travel) => Some((reading, travel)),
            (GaugeForce::Overload, _) => {
                is_over = true;
                None
            }
        }
    })?;
    if is_over {
        return Err(unfit("the force is beyond the range of its gauge; take the load off"));
    }
    if is_inches {
        return Err(unfit(
            "it reports travel in inches; switch it to millimetres, and switch PC control on",
        ));
    }
    Ok(found)
}

fn no_answer_error(console: &TextConsole<'_>) -> DeviceError {
    let is_part = |line: &str| {
        super::protocol::travel(line).is_some()
            || matches!(GaugeLine::parse(line), GaugeLine::Reading(_))
    };
    if console.received().lines().any(is_part) {
        return unfit(
            "the stand does not send force and travel together; check the cable between stand and gauge, and that the stand's travel option is on",
        );
    }
    console.no_answer(
        "check its power, its USB cable, and that its menu shows CONTROL: CONSOLE off and 8-1n",
    )
}

/// The settings of the gauge and, after a blank, its serial number.
fn set_up_gauge(
    console: &mut TextConsole<'_>,
    settings: &StandSettings,
) -> Result<(GaugeList, String), DeviceError> {
    let list = gauge::set_up(console, &settings.gauge, to_gauge)?.ok_or_else(|| {
        unfit("its gauge does not answer the command LIST; use a gauge of Series 5 or 7, at 115200 baud over RS-232")
    })?;
    let serial = gauge::ask_text(console, to_gauge, "RS")?;
    let expected = settings.gauge.serial_number.as_deref();
    DeviceError::check_serial("gauge on the stand", serial.as_deref(), expected)?;
    Ok((list, serial.map(|s| format!(" {s}")).unwrap_or_default()))
}

/// Whether it reports its state; if it does, it must keep to travel limits.
fn check_status(console: &mut TextConsole<'_>) -> Result<bool, DeviceError> {
    console.write("p")?;
    let status = console.find(ANSWER_MAX, StandStatus::parse)?;
    if status.is_some_and(|status| status.is_limit_mode == Some(false)) {
        return Err(unfit(
            "it does not enter its travel limit mode; switch PC control on, and switch cycling and auto return off",
        ));
    }
    Ok(status.is_some())
}

fn set_limits(
    console: &mut TextConsole<'_>,
    settings: &StandSettings,
    here: i64,
) -> Result<(), DeviceError> {
    let end = settings.pulses((settings.travel.0 / MM_PER_PULSE).round() as i64);
    let lower = end.min(0).min(here) - MARGIN;
    let upper = end.max(0).max(here) + MARGIN;
    for (is_upper, limit) in [(false, lower), (true, upper)] {
        let set = set_limit(is_upper, limit)
            .ok_or_else(|| unfit("its travel limits cannot exceed 999.99 mm; lower travel_mm"))?;
        console.write(&format!("{set}{}", ask_limit(is_upper)))?;
        let found = console.find(ANSWER_MAX, number)?;
        let is_right = found.is_some_and(|found| (found * 100.0).round() as i64 == limit);
        if !is_right {
            let found = found.map_or_else(|| "nothing".into(), |found| found.to_string());
            return Err(unfit(&format!(
                "it reports {found} after the command {set}; switch PC control on, and check the range of the stand"
            )));
        }
    }
    Ok(())
}

fn measure(
    console: &mut TextConsole<'_>,
    has_status: bool,
) -> Result<(LinkStats, StandPace), DeviceError> {
    let mut stats = LinkStats { in_flight: 1, ..LinkStats::default() };
    for _ in 0..MEASURED {
        let start = console.now();
        if sample(console)?.is_none() {
            return Err(no_answer_error(console));
        }
        stats.push(console.now().since(start));
    }
    let every = stats.round_trip_mean.max(EVERY_MIN);
    Ok((stats, StandPace { every, has_status }))
}

fn describe(
    settings: &StandSettings,
    scale: GaugeScale,
    pace: StandPace,
    devices: &str,
) -> RigDescription {
    let step = Volts(scale.volts_per_count());
    let ticks = pace.every.0 as f64 / TICK.0 as f64;
    RigDescription {
        name: settings.name.clone(),
        identity: format!(
            "{devices}, {:.0} samples per second; no watchdog: after a lost link the crosshead runs to the target of its move, at most {:.0} mm further; positions agree with the commanded path within {REST_TOLERANCE_MM} mm and {} s",
            1e9 / pace.every.0 as f64,
            settings.travel.0,
            LAG.0
        ),
        settings: BTreeMap::new(),
        mm_per_pulse: MM_PER_PULSE,
        travel: settings.travel,
        tick_nanos: TICK.0,
        speed_quantum: SPEED_QUANTUM,
        speed_max: settings.speed_max,
        acceleration: settings.acceleration,
        adc: Some(scale.adc()),
        noise_expected: settings.gauge.noise_expected(step),
        pulse_lag: LAG,
        cell_delay: palpate_model::units::Seconds(0.0),
        ticks_per_sample: ticks.max(1.0) * BETWEEN,
        unseen_max: settings.unseen,
        takes_targets: false,
        sensors: Default::default(),
    }
}

fn unfit(detail: &str) -> DeviceError {
    DeviceError::unfit(DEVICE, detail)
}
