//! `palpate rig`: detects devices, checks a rig against its file, monitors it. Only `conform` moves, where it is allowed to.

use super::Failure;
use super::arguments::parse_number;
use super::output::Output;
use super::rig::open_rig_file;
use super::rig_conform::{self, RigConformArgs};
use super::rig_new::{self, RigNewArgs};
use super::terminal::ctrl_c_flag;
use clap::{Args, Subcommand};
use palpate_drivers::rig_search::{BAUD, detect_at};
use palpate_drivers::serial::list_ports;
use palpate_drivers::wire::LinkStats;
use palpate_drivers::{Rig, RigEventBody};
use palpate_model::Nanos;
use palpate_model::rig::command::position_from_pulses;
use palpate_model::rig::{AxisStatus, Reading, SensorValues};
use palpate_runner::driver_clock;
use serde::Serialize;
use std::sync::atomic::Ordering;

/// Interval of the printed lines.
const PRINT_EVERY: Nanos = Nanos::from_millis(500);
/// Longest wait for the rig, so that Ctrl-C is heeded.
const WAIT_MAX: Nanos = Nanos::from_millis(20);

/// Connect wired rigs: detect devices, check a rig against its file, monitor it, make and check a sidecar
#[derive(Debug, Subcommand)]
pub enum RigSubcommand {
    /// List serial ports; with --ask, identify the device on each
    Detect(RigDetectArgs),
    /// Open the rig of a file, compare its devices with the file, and report their identity and link timing; nothing moves
    Check(RigCheckArgs),
    /// Show what the rig of a file reports, until Ctrl-C; nothing moves
    Monitor(RigMonitorArgs),
    /// Write a folder with a sidecar that works, to begin a rig of your own with
    New(RigNewArgs),
    /// Check that a sidecar keeps to its protocol, and what it may be trusted with
    Conform(RigConformArgs),
}

/// Arguments of `palpate rig detect`.
#[derive(Debug, Args)]
pub struct RigDetectArgs {
    /// Open each port and query it: palpate writes `?`, which moves nothing. An Arduino restarts when its port is opened
    #[arg(long)]
    ask: bool,
    /// Query here instead of at the ports of this computer: a port, or HOST:PORT of a device on a network; may be repeated
    #[arg(long, value_name = "PORT|HOST:PORT")]
    at: Vec<String>,
    /// Bits a second of serial ports
    #[arg(long, value_name = "BAUD", default_value_t = BAUD, value_parser = clap::value_parser!(u32).range(300..=4_000_000))]
    baud: u32,
}

/// Arguments of `palpate rig check`.
#[derive(Debug, Args)]
pub struct RigCheckArgs {
    /// The rig file
    #[arg(value_name = "FILE.toml")]
    file: String,
}

/// Arguments of `palpate rig monitor`.
#[derive(Debug, Args)]
pub struct RigMonitorArgs {
    /// The rig file
    #[arg(value_name = "FILE.toml")]
    file: String,
    /// End after this time
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    seconds: Option<f64>,
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = parse_number(text).ok().filter(|seconds| (0.1..=1e6).contains(seconds));
    seconds.ok_or_else(|| "give 0.1 to 1000000".to_owned())
}

pub(super) fn run(command: &RigSubcommand, output: &Output) -> Result<(), Failure> {
    match command {
        RigSubcommand::Detect(args) => detect(args, output),
        RigSubcommand::Check(args) => check(args, output),
        RigSubcommand::Monitor(args) => monitor(args, output),
        RigSubcommand::New(args) => rig_new::run(args, output),
        RigSubcommand::Conform(args) => rig_conform::run(args, output),
    }
}

#[derive(Serialize)]
struct Port {
    at: String,
    description: String,
    device: Option<&'static str>,
    says: Option<String>,
    error: Option<String>,
}

fn detect(args: &RigDetectArgs, output: &Output) -> Result<(), Failure> {
    let mut ports: Vec<Port> = Vec::new();
    let port_at = |at: &str, description: String| Port {
        at: at.to_owned(),
        description,
        device: None,
        says: None,
        error: None,
    };
    if args.at.is_empty() {
        for port in list_ports().map_err(|err| Failure::Failed(err.to_string()))? {
            ports.push(port_at(&port.name, port.description));
        }
    } else {
        ports.extend(args.at.iter().map(|at| port_at(at, String::new())));
    }
    let bar = output.count_bar(ports.len() as u64);
    if args.ask || !args.at.is_empty() {
        for port in &mut ports {
            bar.set_message(port.at.clone());
            match detect_at(&port.at, args.baud, &driver_clock()) {
                Ok(found) => {
                    port.device = found.device();
                    port.says = Some(found.to_string());
                }
                Err(sentence) => port.error = Some(sentence),
            }
            bar.inc(1);
        }
    }
    drop(bar);
    let object = serde_json::json!({ "ports": ports });
    output.answer("rig detect", &object, || port_lines(&ports));
    Ok(())
}

fn port_lines(ports: &[Port]) -> String {
    if ports.is_empty() {
        return "no serial port found; plug in the device, or give --at HOST:PORT for a device on a network"
            .into();
    }
    let lines = ports.iter().map(|port| {
        let words = [
            Some(port.description.as_str()).filter(|words| !words.is_empty()),
            port.says.as_deref(),
            port.error.as_deref(),
        ];
        let words: Vec<&str> = words.into_iter().flatten().collect();
        format!("{}  {}", port.at, words.join("; "))
    });
    lines.collect::<Vec<String>>().join("\n")
}

fn link_objects(links: &[(String, LinkStats)]) -> Vec<serde_json::Value> {
    let object = |(device, stats): &(String, LinkStats)| {
        serde_json::json!({
            "device": device, "round_trip_min_s": stats.round_trip_min.seconds().0,
            "round_trip_mean_s": stats.round_trip_mean.seconds().0,
            "round_trip_max_s": stats.round_trip_max.seconds().0,
            "jitter_s": stats.jitter().seconds().0, "answers": stats.answers,
            "in_flight": stats.in_flight, "resynchronised": stats.resynchronised,
            "is_real_time": stats.is_real_time,
        })
    };
    links.iter().map(object).collect()
}

fn link_lines(links: &[(String, LinkStats)]) -> impl Iterator<Item = String> {
    let ms = |time: Nanos| time.seconds().0 * 1e3;
    links.iter().map(move |(device, stats)| {
        format!(
            "link       {device}: round trip {:.2} ms ({:.2} to {:.2}), jitter {:.2} ms, resynchronised {} times, thread at {} priority",
            ms(stats.round_trip_mean),
            ms(stats.round_trip_min),
            ms(stats.round_trip_max),
            ms(stats.jitter()),
            stats.resynchronised,
            if stats.is_real_time { "real-time" } else { "ordinary" }
        )
    })
}

fn check(args: &RigCheckArgs, output: &Output) -> Result<(), Failure> {
    let (rig, _lock) = open_rig_file(&args.file)?;
    let about = rig.description();
    let links = rig.links();
    let object = serde_json::json!({ "rig": about, "links": link_objects(&links) });
    output.answer("rig check", &object, || {
        let mut lines = vec![
            format!("rig        {}", about.name),
            format!("is         {}", about.identity),
            format!(
                "axis       {} mm per pulse, travel {}, speed up to {}, acceleration {} mm/s2",
                about.mm_per_pulse, about.travel, about.speed_max, about.acceleration.0
            ),
            format!(
                "samples    at most {:.2} ms apart; the position is at most {:.2} ms behind or ahead of the command",
                about.tick().0 * about.ticks_per_sample * 1e3,
                about.pulse_lag.0 * 1e3
            ),
        ];
        lines.extend(link_lines(&links));
        lines.push("The rig matches its file. Nothing has moved.".into());
        lines.join("\n")
    });
    Ok(())
}

/// Readings of a stretch of time.
#[derive(Clone, Copy, Default)]
struct SampleWindow {
    samples: u64,
    sum_v: f64,
    min_v: f64,
    max_v: f64,
    age_max: Nanos,
    within_max: Nanos,
    longest_gap: u64,
}

impl SampleWindow {
    /// One reading, `ticks` after the one before it.
    fn of(reading: &Reading, ticks: u64) -> Self {
        let volts = reading.volts.0;
        Self {
            samples: 1,
            sum_v: volts,
            min_v: volts,
            max_v: volts,
            age_max: reading.age.map_or(Nanos::ZERO, |age| age.by),
            within_max: reading.age.map_or(Nanos::ZERO, |age| age.within),
            longest_gap: ticks,
        }
    }

    fn add(&mut self, other: &Self) {
        match (self.samples, other.samples) {
            (_, 0) => return,
            (0, _) => return *self = *other,
            _ => {}
        }
        self.min_v = self.min_v.min(other.min_v);
        self.max_v = self.max_v.max(other.max_v);
        self.samples += other.samples;
        self.sum_v += other.sum_v;
        self.age_max = self.age_max.max(other.age_max);
        self.within_max = self.within_max.max(other.within_max);
        self.longest_gap = self.longest_gap.max(other.longest_gap);
    }

    fn mean_v(&self) -> Option<f64> {
        (self.samples > 0).then(|| self.sum_v / self.samples as f64)
    }
}

fn monitor(args: &RigMonitorArgs, output: &Output) -> Result<(), Failure> {
    let (mut rig, _lock) = open_rig_file(&args.file)?;
    let is_ending = ctrl_c_flag()?;
    let clock = driver_clock();
    let length = args.seconds.map(|seconds| Nanos((seconds * 1e9) as u64));
    let (mut whole, mut recent) = (SampleWindow::default(), SampleWindow::default());
    let (mut newest, mut printed_at): (Option<Reading>, Nanos) = (None, Nanos::ZERO);
    let mut faults = Vec::new();
    let mut sensors = SensorValues::default();
    let end = loop {
        let now = clock();
        if is_ending.load(Ordering::Relaxed) || length.is_some_and(|length| now >= length) {
            break now;
        }
        while let Some(event) = rig.next_event(clock() + WAIT_MAX) {
            match event.body {
                RigEventBody::Reading(reading) => {
                    let before = newest.map_or(reading.tick, |newest| newest.tick);
                    recent.add(&SampleWindow::of(&reading, reading.tick.saturating_sub(before)));
                    newest = Some(reading);
                }
                RigEventBody::Ack(_) => {}
                RigEventBody::Fault(fault) => faults.push(fault.to_string()),
            }
            if clock().since(printed_at) >= PRINT_EVERY {
                break;
            }
        }
        rig.take_sensors().iter().for_each(|value| sensors.update(value));
        // The raw bytes are not recorded here.
        drop(rig.take_raw());
        if let Some(fault) = faults.first() {
            return Err(Failure::Failed(format!("{}: {fault}", args.file)));
        }
        let now = clock();
        let since = now.since(printed_at);
        if since >= PRINT_EVERY {
            output.text_only(|| {
                monitor_line(rig.as_ref(), newest.as_ref(), &recent, since)
                    + &channel_words(rig.as_ref(), &sensors)
            });
            whole.add(&recent);
            (recent, printed_at) = (SampleWindow::default(), now);
        }
    };
    whole.add(&recent);
    let links = rig.links();
    let tick = rig.description().tick().0;
    let object = serde_json::json!({ "rig": rig.description().name,
        "seconds": end.seconds().0,
        "samples": whole.samples,
        "samples_per_s": whole.samples as f64 / end.seconds().0,
        "signal_mean_V": whole.mean_v(),
        "signal_min_V": (whole.samples > 0).then_some(whole.min_v),
        "signal_max_V": (whole.samples > 0).then_some(whole.max_v),
        "age_max_s": whole.age_max.seconds().0,
        "age_within_s": whole.within_max.seconds().0,
        "longest_gap_s": whole.longest_gap as f64 * tick,
        "pulses": newest.map(|reading| reading.pulses),
        "position_mm": newest.map(|reading| position_mm(rig.as_ref(), &reading)),
        "sensors": channels(rig.as_ref(), &sensors).map(|(name, value, _)| (name, value.into())).collect::<serde_json::Map<String, serde_json::Value>>(),
        "links": link_objects(&links),
    });
    output.answer("rig monitor", &object, || {
        let mut lines = vec![format!(
            "samples    {} in {:.1} s, {:.1} per second, at most {:.2} ms apart",
            whole.samples,
            end.seconds().0,
            whole.samples as f64 / end.seconds().0,
            whole.longest_gap as f64 * tick * 1e3
        )];
        lines.extend(link_lines(&links));
        lines.join("\n")
    });
    Ok(())
}

/// The channels of a rig that have a value: name, value and unit.
fn channels<'a>(
    rig: &'a dyn Rig,
    values: &'a SensorValues,
) -> impl Iterator<Item = (String, f64, &'a str)> {
    (1..).zip(&rig.description().sensors.channels).filter_map(|(number, channel)| {
        Some((channel.name.clone(), values.channel(number)?, channel.unit.as_str()))
    })
}

fn channel_words(rig: &dyn Rig, values: &SensorValues) -> String {
    let words = channels(rig, values).map(|(name, value, unit)| match unit {
        "1" => format!("  {name} {value}"),
        unit => format!("  {name} {value} {unit}"),
    });
    words.collect()
}

fn position_mm(rig: &dyn Rig, reading: &Reading) -> f64 {
    position_from_pulses(reading.pulses, rig.description().mm_per_pulse).0
}

/// A line on the newest readings. The counter's zero is where the device was switched on, until a run zeroes it.
fn monitor_line(
    rig: &dyn Rig,
    newest: Option<&Reading>,
    recent: &SampleWindow,
    since: Nanos,
) -> String {
    let (Some(reading), Some(mean)) = (newest, recent.mean_v()) else {
        return "no sample".into();
    };
    let named = [
        (AxisStatus::MOVING, "moving"),
        (AxisStatus::HOME, "home switch"),
        (AxisStatus::FORWARD_LIMIT, "far limit switch"),
        (AxisStatus::REVERSE_LIMIT, "limit switch behind home"),
        (AxisStatus::MOTOR_ON, "motor on"),
    ];
    let states =
        named.into_iter().filter(|(bit, _)| reading.status.has(*bit)).map(|(_, name)| name);
    let states = states.collect::<Vec<&str>>().join(", ");
    format!(
        "{mean:9.4} V ({:.4} to {:.4})  {:9.3} mm  {:6.1} samples/s, up to {:.2} ± {:.2} ms old  {states}",
        recent.min_v,
        recent.max_v,
        position_mm(rig, reading),
        recent.samples as f64 / since.seconds().0,
        recent.age_max.seconds().0 * 1e3,
        recent.within_max.seconds().0 * 1e3
    )
}
