//! Opening a controller: identity, settings, limits before anything can move, and the speed of the link.

use super::capture::{self, SamplingSetup};
use super::console::GalilConsole;
use super::model::{GalilBoard, GalilOpenError};
use super::order::{limit_commands, software_limits};
use super::protocol::GalilParser;
use super::recording::RecordingPlan;
use super::sampling::parse_register;
use super::session::PollPace;
use super::settings::GalilSettings;
use super::watchdog;
use crate::wire::{HostClock, Link, LinkStats};
use palpate_model::Nanos;
use palpate_model::rig::{AdcDescription, RawBytes, RigDescription};
use palpate_model::units::{MmPerS, MmPerS2, Seconds};
use std::collections::BTreeMap;
use std::sync::Arc;

/// True length in ns of what `TM` calls a microsecond: `TM 1000` sets 976 microseconds, 1024 samples a second
/// (DMC-40x0 user manual, page 246; DMC-18x2 command reference, `TIME`).
const NANOS_PER_TM: f64 = 1e9 / 1024.0 / 1000.0;
/// The weakest smoothing of pulses (`KS`; Galil application note 2446): its time constant of three samples a unit keeps
/// pulses within 1.5 samples of the command.
const SMOOTHING: f64 = 0.5;
/// A line without a byte for so long has nothing more to say, at any baud rate and latency of a USB converter.
const QUIET: Nanos = Nanos::from_millis(120);
/// A download is answered when it has been stored.
const DOWNLOAD_MAX: Nanos = Nanos::from_millis(10_000);
/// Largest difference of reported pulses from the command, in samples: 1.5 of the smoothing filter, and two between
/// `BG` or `ST` and the sample behind it.
const LAG_SAMPLES: f64 = 4.0;
/// Two samples of the controller may fall between two questions: on average they come further apart by this.
const BETWEEN: f64 = 1.1;

#[derive(Clone, Debug)]
pub struct ConnectedGalil {
    pub board: GalilBoard,
    pub description: RigDescription,
    pub pace: PollPace,
    pub stats: LinkStats,
    /// The link in words: latency, jitter, and the sampling chosen for it.
    pub link: String,
    pub plan: Option<RecordingPlan>,
    /// Whether the watchdog's program runs.
    pub has_watchdog: bool,
    /// Longest way of the axis after palpate falls silent, in mm; the whole travel without a watchdog.
    pub worst_case_mm: f64,
    pub raw: Vec<RawBytes>,
}

/// Sets a controller up. The axis is stopped first; nothing moves.
pub fn connect(
    link: &mut dyn Link,
    clock: &HostClock,
    settings: &GalilSettings,
    device: &Arc<str>,
) -> Result<ConnectedGalil, GalilOpenError> {
    let mut console = GalilConsole::open(link, clock, device, GalilParser::take);
    let board = identify(&mut console, settings)?;
    silence_controller(&mut console, settings)?;
    let acceleration = set_up_axis(&mut console, settings)?;
    let takes_targets = has_tracking_mode(&mut console, settings.axis)?;
    set_up_input(&mut console, settings)?;
    let has_watchdog = settings.has_watchdog && start_watchdog(&mut console, settings)?;
    let tm = console.number("_TM")?;
    if !(tm > 0.0 && tm <= 1e6) {
        return Err(GalilOpenError::set_otherwise("TM", tm.to_string()));
    }
    let tick = Nanos((tm * NANOS_PER_TM).round() as u64);
    // From here on only the signal has decimals, in a format of its own: short answers are fast ones.
    console.try_ask("VF 10.0")?;
    let measured = capture::measure(&mut console, settings)?;
    let SamplingSetup { pace, plan, words, measured: how } =
        capture::set_up(&mut console, settings, &measured, tick)?;
    let stats = LinkStats { in_flight: pace.in_flight, ..measured.stats };
    let worst_case_mm = if has_watchdog {
        watchdog::worst_case_mm(settings.speed_max, acceleration, tick)
    } else {
        settings.travel.0 + 2.0 * super::order::LIMIT_MARGIN_MM
    };
    let with = if has_watchdog { "with" } else { "without" };
    // Rounded up: it is a bound.
    let most = (worst_case_mm * 10.0).ceil() / 10.0;
    let safety =
        format!("{with} watchdog: the axis stops within {most:.1} mm after the link is lost");
    let ms = |span: Nanos| span.0 as f64 * 1e-6;
    let link = format!(
        "the controller answers in {:.1} to {:.1} ms; {how}",
        ms(stats.round_trip_min),
        ms(stats.round_trip_max)
    );
    // Values that change from one opening to the next stay out of the identity, by which repeats are compared.
    let words = format!("{safety}, {words}");
    let description = RigDescription {
        takes_targets,
        ..describe(settings, &board, acceleration, (pace, plan), &words, tm)
    };
    Ok(ConnectedGalil {
        board,
        description,
        pace,
        stats,
        link,
        plan,
        has_watchdog,
        worst_case_mm,
        raw: console.raw,
    })
}

fn identify(
    console: &mut GalilConsole<'_>,
    settings: &GalilSettings,
) -> Result<GalilBoard, GalilOpenError> {
    // Ends half a line or half a download of an earlier program; echo is off from here on.
    console.write("\rEO 0\r")?;
    if console.drain_prompts(QUIET)? == 0 {
        console.write("\\\rEO 0\r")?;
        if console.drain_prompts(Nanos(4 * QUIET.0))? == 0 {
            return Err(GalilOpenError::Silent);
        }
    }
    let reply = console.try_ask("\x12\x16")?;
    let mut board = GalilBoard::parse(&reply.text())?;
    // Not every firmware has the operand.
    let serial = console.try_ask("MG _BN")?;
    let number = serial.numbers().filter(|_| serial.is_accepted);
    board.serial_number = number
        .and_then(|numbers| numbers.first().copied())
        .filter(|number| *number >= 0.0 && number.fract() == 0.0)
        .map(|number| number as u64);
    if let Some(expected) = settings.serial_number
        && board.serial_number != Some(expected)
    {
        let found =
            board.serial_number.map_or_else(|| "(not reported)".to_owned(), |n| n.to_string());
        return Err(GalilOpenError::OtherSerial { found, expected });
    }
    let index = (settings.axis as usize).wrapping_sub('A' as usize);
    if index >= board.axes {
        return Err(GalilOpenError::NoAxis {
            revision: board.revision,
            axes: board.axes,
            axis: settings.axis,
        });
    }
    Ok(board)
}

/// Programs halted, the axis stopped, unsolicited text marked, numbers in a form that has all their digits.
fn silence_controller(
    console: &mut GalilConsole<'_>,
    settings: &GalilSettings,
) -> Result<(), GalilOpenError> {
    let a = settings.axis;
    console.ask("HX")?;
    console.ask(&format!("ST{a}"))?;
    console.ask("CW 1")?;
    // Not every firmware has these: numbers are read in any form.
    for form in ["LZ 1", "PF 10.0", "VF 10.4"] {
        console.try_ask(form)?;
    }
    // The slowest stop of a controller takes longer than an operator waits for a rig to open.
    let start = console.now();
    while console.number(&format!("_BG{a}"))? != 0.0 {
        if console.now().since(start) > Nanos::from_millis(5_000) {
            console.ask("AB 1")?;
        }
        if console.now().since(start) > Nanos::from_millis(6_000) {
            return Err(GalilOpenError::set_otherwise(
                "AB 1",
                format!("that axis {a} still moves"),
            ));
        }
    }
    Ok(())
}

/// Pulses, rates, switches and software limits. Gives the acceleration that was set.
fn set_up_axis(
    console: &mut GalilConsole<'_>,
    settings: &GalilSettings,
) -> Result<MmPerS2, GalilOpenError> {
    let a = settings.axis;
    if let Some(us) = settings.sample_us {
        let command = format!("TM {us}");
        console.ask(&command)?;
        console.check(&command, "_TM", &[f64::from(us)])?;
    }
    let motor_type = f64::from(settings.motor_type as i8);
    if console.number(&format!("_MT{a}"))? != motor_type {
        console.ask(&format!("MO{a}"))?;
        let command = format!("MT{a}={motor_type}");
        console.ask(&command)?;
        console.check(&command, &format!("_MT{a}"), &[motor_type])?;
    }
    set_if_readable(console, format!("KS{a}={SMOOTHING}"), &format!("_KS{a}"), &[SMOOTHING])?;
    let levels = [settings.limits as i8, settings.home as i8];
    let command = format!("CN {},{}", levels[0], levels[1]);
    set_if_readable(console, command, "_CN0,_CN1", &levels.map(f64::from))?;
    let rate = settings.counts(settings.acceleration.0);
    console.ask(&format!("AC{a}={rate}"))?;
    console.ask(&format!("DC{a}={rate}"))?;
    // Limits are left at this rate; the older series have no such command and use that of `DC`.
    console.try_ask(&format!("SD{a}={rate}"))?;
    let rates = console.numbers(&format!("_AC{a},_DC{a}"))?;
    // It rounds down to its resolution.
    if rates[0] != rates[1] || rates[0] <= 0.0 || rates[0] > rate as f64 {
        let found = format!("{} and {}", rates[0], rates[1]);
        return Err(GalilOpenError::set_otherwise(format!("AC{a}={rate}"), found));
    }
    console.ask(&format!("SP{a}={}", settings.counts(settings.speed_max.0)))?;
    // Before homing the axis can be anywhere on its travel, and homing may need all of it.
    let here = console.number(&format!("_TD{a}"))?;
    let here = settings.sign() * parse_register(here).unwrap_or(0);
    let travel = (settings.travel.0 / settings.mm_per_pulse).round() as i64;
    // Homing searches ten millimetres further than the travel.
    let margin = (10.0 / settings.mm_per_pulse).round() as i64;
    let (forward, reverse) =
        software_limits(settings, here - travel - margin, 2.0 * (settings.travel.0 + 10.0));
    for command in limit_commands(a, forward, reverse) {
        if let Some(list) = command.strip_prefix("MG ") {
            let set = format!("FL{a}={forward};BL{a}={reverse}");
            console.check(&set, list, &[forward as f64, reverse as f64])?;
        } else {
            console.ask(&command)?;
        }
    }
    Ok(MmPerS2(rates[0] * settings.mm_per_pulse))
}

/// Sends a command and compares what it has set, where the firmware has the operands to read it back.
fn set_if_readable(
    console: &mut GalilConsole<'_>,
    command: String,
    operands: &str,
    wanted: &[f64],
) -> Result<(), GalilOpenError> {
    console.ask(&command)?;
    let reply = console.try_ask(&format!("MG {operands}"))?;
    if reply.is_accepted && reply.numbers().as_deref() != Some(wanted) {
        return Err(GalilOpenError::set_otherwise(command, reply.text()));
    }
    Ok(())
}

/// Whether the controller has the position tracking mode, in which the axis takes a new target on the way; it is off
/// behind. The firmware itself says so.
fn has_tracking_mode(console: &mut GalilConsole<'_>, axis: char) -> Result<bool, GalilOpenError> {
    let operand = format!("MG _PT{axis}");
    let reply = console.try_ask(&operand)?;
    let is_mode = |mode: &[f64]| matches!(mode, [mode] if *mode == 0.0 || *mode == 1.0);
    if !reply.is_accepted || !reply.numbers().is_some_and(|numbers| is_mode(&numbers)) {
        return Ok(false);
    }
    let command = format!("PT{axis}=0");
    console.ask(&command)?;
    console.check(&command, &format!("_PT{axis}"), &[0.0])?;
    Ok(true)
}

fn set_up_input(
    console: &mut GalilConsole<'_>,
    settings: &GalilSettings,
) -> Result<(), GalilOpenError> {
    let (input, range) = (settings.input, settings.range as u8);
    // A controller that has one range only does not know the command; then it must be the usual +-10 V.
    let command = format!("AQ {input},{range}");
    let reply = console.try_ask(&command)?;
    if reply.is_accepted {
        console.check(&command, &format!("_AQ{input}"), &[f64::from(range)])?;
    } else if settings.range != super::AnalogRange::Bipolar10 {
        console.ask(&command)?;
    }
    console.number(&format!("@AN[{input}]")).map(|_| ())
}

/// Downloads and starts the watchdog's program; `false` when the controller runs none.
fn start_watchdog(
    console: &mut GalilConsole<'_>,
    settings: &GalilSettings,
) -> Result<bool, GalilOpenError> {
    console.ask(&format!("{}=1", watchdog::VARIABLE))?;
    let program = watchdog::program(settings.axis).join("\r");
    console.write(format!("DL\r{program}\r\\"))?;
    // One prompt for `\` and one for `DL`; a line that is refused gives `?` before them.
    let replies = console.replies(2, DOWNLOAD_MAX)?;
    let is_stored = replies.len() == 2 && replies.iter().all(|reply| reply.is_accepted);
    console.drain(QUIET)?;
    let start = format!("XQ {},{}", watchdog::LABEL, watchdog::THREAD);
    if !is_stored || !console.try_ask(&start)?.is_accepted {
        return Ok(false);
    }
    Ok(console.number(&format!("_XQ{}", watchdog::THREAD))? >= 0.0)
}

fn describe(
    settings: &GalilSettings,
    board: &GalilBoard,
    acceleration: MmPerS2,
    (pace, plan): (PollPace, Option<RecordingPlan>),
    words: &str,
    tm: f64,
) -> RigDescription {
    let counts = 1_i32 << settings.bits.min(24);
    let (counts_min, counts_max) =
        if settings.range.is_bipolar() { (-counts / 2, counts / 2 - 1) } else { (0, counts - 1) };
    let filter = settings.filter.as_deref().unwrap_or("not known");
    RigDescription {
        name: settings.name.clone(),
        identity: format!(
            "{board}, axis {}, input {} (filter ahead of the input: {filter}), {words}",
            settings.axis, settings.input
        ),
        settings: BTreeMap::new(),
        mm_per_pulse: settings.mm_per_pulse,
        travel: settings.travel,
        tick_nanos: pace.tick.0,
        // Resolution of `SP`: 2 * (1000 / TM) counts/s (DMC-40x0 command reference).
        speed_quantum: MmPerS(2.0 * 1000.0 / tm * settings.mm_per_pulse),
        speed_max: settings.speed_max,
        acceleration,
        adc: Some(AdcDescription {
            counts_min,
            counts_max,
            volts_per_count: settings.volts_per_count(),
        }),
        noise_expected: settings.noise,
        // A recording has them all.
        ticks_per_sample: plan.map_or_else(
            || (pace.every.0 as f64 / pace.tick.0 as f64).max(1.0) * BETWEEN,
            |plan| plan.interval as f64,
        ),
        unseen_max: settings.unseen,
        takes_targets: false,
        sensors: Default::default(),
        pulse_lag: Seconds(LAG_SAMPLES * tm * NANOS_PER_TM * 1e-9),
        cell_delay: Seconds(0.0),
    }
}
