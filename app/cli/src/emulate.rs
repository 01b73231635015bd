//! `palpate emulate`: an emulated device on a pseudo-terminal or a TCP port.

use super::Failure;
use super::arguments::{Choice, choice, parse_number};
use super::output::Output;
use super::rig::BenchArgs;
use super::terminal::{ctrl_c_flag, read_lines};
use clap::builder::PossibleValuesParser;
use clap::{Args, Subcommand};
use palpate_drivers::priority::request_real_time;
use palpate_emulators::bench::EmulatedBench;
use palpate_emulators::cell::{emulated_cell, emulated_cells};
use palpate_emulators::galil::{EmulatedGalilSettings, GalilEmulator, GalilModel};
use palpate_emulators::grbl::{Eeprom, EmulatedGrblSettings, Grbl, HomeWiring};
use palpate_emulators::hapi::{EmulatedHapi, HapiBoardSettings};
use palpate_emulators::inverse::{EmulatedInverse, InverseServiceSettings};
use palpate_emulators::mark10::{EmulatedGaugeSettings, EmulatedStand, EmulatedStandSettings};
use palpate_emulators::serve::{EmulatorAddress, ServeError, ServeEvent, ServeOptions, serve};
use palpate_emulators::sidecar::{EmulatedSidecar, EmulatedSidecarSettings};
use palpate_emulators::{EmulatedDevice, ScheduledFault};
use palpate_model::Nanos;
use std::net::SocketAddr;
use std::path::PathBuf;

/// An Arduino Uno's ceramic resonator is rated at 0.5 %: this one is fast by 0.3 %.
const UNO_CLOCK: f64 = 1.003;

/// Emulate a device on a serial port or a network, with the simulated rig behind it
#[derive(Debug, Subcommand)]
pub enum EmulateCommand {
    /// A Galil DMC controller: axis A the slide with the probe, analog input 1 the load cell
    Galil(GalilArgs),
    /// A Grbl board with the slide on its X axis, and a load cell on a serial line of its own
    Grbl(GrblArgs),
    /// A Mark-10 stand ESM303 with a force gauge on it
    Mark10(Mark10Args),
    /// A sidecar: a board with stage, load cell, thermometer and trigger line that speaks the sidecar protocol
    Sidecar(SidecarArgs),
    /// Haply's Inverse service with an Inverse3, whose hand pokes; on the network at 127.0.0.1:10001 without --tcp
    Inverse(InverseArgs),
    /// Haply's 2DIY on a hAPI board, whose hand leaves the home position and pokes
    Hapi(HapiArgs),
}

/// The wire to an emulated device.
#[derive(Debug, Args)]
struct WireArgs {
    /// Serve on a pseudo-terminal, with a link of this name to it; the default
    #[arg(long, value_name = "PATH", num_args = 0..=1, conflicts_with = "tcp")]
    pty: Option<Option<PathBuf>>,
    /// Serve on the network at this address, such as 127.0.0.1:5023; port 0 takes any free port
    #[arg(long, value_name = "ADDRESS:PORT")]
    tcp: Option<SocketAddr>,
    /// Bits a second of the serial line; without it there is no delay
    #[arg(long, value_name = "BAUD", value_parser = clap::value_parser!(u32).range(300..=4_000_000))]
    baud: Option<u32>,
    /// Latency timer of a USB converter in ms: an incomplete packet waits that long
    #[arg(long, value_name = "MS", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=255))]
    latency_ms: u32,
    /// A fault, KIND@SECONDS[:DURATION]: garbage, drop, duplicate, partial, late, deaf, mute, reset, disconnect, stuck, saturated or wrong-device; may be repeated. Lines on standard input take effect at once: KIND[:DURATION], load GRAMS, mount NUMBER or unmount
    #[arg(long, value_name = "FAULT")]
    fault: Vec<ScheduledFault>,
}

/// Arguments of `palpate emulate galil`.
#[derive(Debug, Args)]
pub struct GalilArgs {
    #[command(flatten)]
    wire: WireArgs,
    /// Controller: dmc4143, dmc4183, dmc4040 or dmc2143
    #[arg(long, default_value = "dmc4143")]
    model: GalilModel,
    /// Bits of the analog inputs, 12, 16 or none; usually 16, and none on a dmc2143
    #[arg(long, value_name = "BITS", value_parser = converter)]
    adc: Option<Converter>,
    /// Echo on the serial line from power-up (EO 1)
    #[arg(long)]
    echo: bool,
    /// Error of the controller's crystal in ppm; positive is fast
    #[arg(long, value_name = "PPM", default_value_t = 0.0, allow_negative_numbers = true, value_parser = ppm)]
    clock_ppm: f64,
    /// Serial number
    #[arg(long, value_name = "NUMBER", default_value_t = 1820)]
    serial_number: u32,
    #[command(flatten)]
    bench: BenchArgs,
}

/// Arguments of `palpate emulate grbl`.
#[derive(Debug, Args)]
pub struct GrblArgs {
    #[command(flatten)]
    wire: WireArgs,
    /// Load cell on a line of its own
    #[arg(long, default_value = "hx711", value_parser = PossibleValuesParser::new(emulated_cells()))]
    cell: String,
    /// Name of a link to the load cell's pseudo-terminal; the cell has one even with --tcp
    #[arg(long, value_name = "PATH")]
    cell_pty: Option<PathBuf>,
    /// Home switch on the limit pin of the axis, or on the probe pin with limit switches on the limit pin: limit or probe
    #[arg(long, value_parser = choice(&HOME_PINS), default_value = "limit")]
    home: HomeWiring,
    /// A setting that the board has stored, NUMBER=VALUE such as 22=1; may be repeated
    #[arg(long, value_name = "NUMBER=VALUE", value_parser = setting)]
    setting: Vec<(u16, f64)>,
    /// Text that $I= has stored, which identifies the board
    #[arg(long, value_name = "TEXT", default_value = "")]
    build_info: String,
    #[command(flatten)]
    bench: BenchArgs,
}

/// Arguments of `palpate emulate mark10`.
#[derive(Debug, Args)]
pub struct Mark10Args {
    #[command(flatten)]
    wire: WireArgs,
    #[command(flatten)]
    bench: BenchArgs,
}

/// Arguments of `palpate emulate sidecar`.
#[derive(Debug, Args)]
pub struct SidecarArgs {
    #[command(flatten)]
    wire: WireArgs,
    /// Samples a second
    #[arg(long, value_name = "PER_SECOND", default_value_t = 500, value_parser = clap::value_parser!(u32).range(10..=2000))]
    samples: u32,
    /// Lines have no checksum
    #[arg(long)]
    no_checksum: bool,
    /// Samples are lines, never frames
    #[arg(long)]
    no_frames: bool,
    /// Error of its crystal in ppm; positive is fast
    #[arg(long, value_name = "PPM", default_value_t = 0.0, allow_negative_numbers = true, value_parser = ppm)]
    clock_ppm: f64,
    #[command(flatten)]
    bench: BenchArgs,
}

/// Arguments of `palpate emulate inverse`.
#[derive(Debug, Args)]
pub struct InverseArgs {
    /// Serve on the network at this address; port 0 takes any free port
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:10001")]
    tcp: SocketAddr,
    /// From a message to its report in ms
    #[arg(long, value_name = "MS", default_value_t = 0.0, value_parser = reply_ms)]
    reply_ms: f64,
    /// A fault, KIND@SECONDS[:DURATION]: drop, partial, late, deaf, mute or disconnect; may be repeated. Lines on standard input take effect at once: KIND[:DURATION]
    #[arg(long, value_name = "FAULT")]
    fault: Vec<ScheduledFault>,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Arguments of `palpate emulate hapi`.
#[derive(Debug, Args)]
pub struct HapiArgs {
    #[command(flatten)]
    wire: WireArgs,
    /// From a packet to its answer in ms
    #[arg(long, value_name = "MS", default_value_t = 0.0, value_parser = reply_ms)]
    reply_ms: f64,
    /// The board runs on when its cable is pulled, and keeps its torque
    #[arg(long)]
    own_power: bool,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Longer than any service takes.
fn reply_ms(text: &str) -> Result<f64, String> {
    let ms = parse_number(text).ok().filter(|ms| (0.0..=1000.0).contains(ms));
    ms.ok_or_else(|| "give 0 to 1000".to_owned())
}

const HOME_PINS: [Choice<HomeWiring>; 2] = [
    ("limit", HomeWiring::Limit, "Home switch on the limit pin of the axis"),
    ("probe", HomeWiring::Probe, "Home switch on the probe pin, limit switches on the limit pin"),
];

fn setting(text: &str) -> Result<(u16, f64), String> {
    let wrong = || "give NUMBER=VALUE, such as 22=1".to_owned();
    let (number, value) = text.split_once('=').ok_or_else(wrong)?;
    let number = number.trim_start_matches('$').parse().map_err(|_| wrong())?;
    Ok((number, parse_number(value).map_err(|_| wrong())?))
}

#[derive(Clone, Copy, Debug)]
struct Converter(Option<u32>);

fn converter(text: &str) -> Result<Converter, String> {
    match text {
        "12" => Ok(Converter(Some(12))),
        "16" => Ok(Converter(Some(16))),
        "none" => Ok(Converter(None)),
        _ => Err("give 12, 16 or none".to_owned()),
    }
}

/// A crystal is off by tens, never by thousands.
fn ppm(text: &str) -> Result<f64, String> {
    let ppm = parse_number(text).ok().filter(|ppm| ppm.abs() <= 1000.0);
    ppm.ok_or_else(|| "give -1000 to 1000".to_owned())
}

/// How an emulated device is announced.
struct Announcement {
    /// Key of the device in the JSON object.
    device: &'static str,
    model: String,
    label: String,
    /// Name of a load cell on a line of its own.
    cell: Option<String>,
}

impl Announcement {
    /// Prints the addresses: that of the device and, after a comma, that of its cell.
    fn print(&self, addresses: &str, is_serial: bool, output: &Output) {
        let (at, cell_at) = addresses.split_once(", ").unwrap_or((addresses, ""));
        let mut object = serde_json::json!({
            "device": self.device, "model": self.model, "at": at, "is_serial": is_serial,
        });
        if self.cell.is_some() {
            object["cell_at"] = cell_at.into();
        }
        output.answer("emulate", &object, || match &self.cell {
            Some(cell) => {
                format!("{} at {at}, {cell} at {cell_at}; Ctrl-C ends the emulation", self.label)
            }
            None => format!("{} at {at}; Ctrl-C ends the emulation", self.label),
        });
    }
}

pub(super) fn run(command: &EmulateCommand, output: &Output) -> Result<(), Failure> {
    match command {
        EmulateCommand::Galil(args) => galil(args, output),
        EmulateCommand::Grbl(args) => grbl(args, output),
        EmulateCommand::Mark10(args) => mark10(args, output),
        EmulateCommand::Sidecar(args) => sidecar(args, output),
        EmulateCommand::Inverse(args) => inverse(args, output),
        EmulateCommand::Hapi(args) => hapi(args, output),
    }
}

fn galil(args: &GalilArgs, output: &Output) -> Result<(), Failure> {
    let usual = if args.model.is_21x3() { None } else { Some(16) };
    let is_serial = args.wire.tcp.is_none();
    let mut device = GalilEmulator::new(EmulatedGalilSettings {
        sim: args.bench.settings(),
        model: args.model,
        converter: args.adc.map_or(usual, |bits| bits.0),
        is_serial,
        has_echo: args.echo,
        clock_ppm: args.clock_ppm,
        serial_number: args.serial_number,
    });
    let model = args.model.to_string();
    let announcement = Announcement { device: "galil", label: model.clone(), model, cell: None };
    emulate(&mut device, announcement, &args.wire, None, args.bench.seed, output)
}

fn grbl(args: &GrblArgs, output: &Output) -> Result<(), Failure> {
    let mut eeprom = Eeprom::slide();
    if args.home == HomeWiring::Probe {
        // Limit switches on the limit pin need hard limits; every board accepts the setting.
        let _ = eeprom.set(21, 1.0);
    }
    for (number, value) in &args.setting {
        eeprom.set(*number, *value).map_err(|code| {
            Failure::usage(format!(
                "the emulated board refuses --setting {number}={value} with error:{code}; give another setting"
            ))
        })?;
    }
    eeprom.build_info.clone_from(&args.build_info);
    let board = Grbl::new(EmulatedGrblSettings {
        eeprom,
        home: args.home,
        resonator: UNO_CLOCK,
        ..EmulatedGrblSettings::default()
    });
    let seed = args.bench.seed;
    let model = &args.cell;
    // The parser of the arguments accepts only emulated cells.
    let cell = emulated_cell(model, seed)
        .ok_or_else(|| Failure::usage(format!("no emulated load cell is called {model}")))?;
    let mut device = EmulatedBench::new(&args.bench.settings(), Box::new(board), cell);
    let announcement = Announcement {
        device: "grbl",
        model: format!("1.1h with {model}"),
        label: "Grbl 1.1h".into(),
        cell: Some(model.clone()),
    };
    let cell_link = Some(args.cell_pty.clone());
    emulate(&mut device, announcement, &args.wire, cell_link, seed, output)
}

fn mark10(args: &Mark10Args, output: &Output) -> Result<(), Failure> {
    let seed = args.bench.seed;
    let mut device = EmulatedStand::new(EmulatedStandSettings {
        sim: args.bench.settings(),
        gauge: EmulatedGaugeSettings { seed, ..EmulatedGaugeSettings::default() },
        ..EmulatedStandSettings::default()
    });
    let (model, label) = ("ESM303".to_owned(), "ESM303".to_owned());
    let announcement = Announcement { device: "mark10", model, label, cell: None };
    emulate(&mut device, announcement, &args.wire, None, seed, output)
}

fn sidecar(args: &SidecarArgs, output: &Output) -> Result<(), Failure> {
    let mut device = EmulatedSidecar::new(EmulatedSidecarSettings {
        sim: args.bench.settings(),
        rate: f64::from(args.samples),
        has_checksum: !args.no_checksum,
        has_frames: !args.no_frames,
        clock_ppm: args.clock_ppm,
        ..EmulatedSidecarSettings::default()
    });
    let (model, label) = ("sidecar".to_owned(), "sidecar".to_owned());
    let announcement = Announcement { device: "sidecar", model, label, cell: None };
    emulate(&mut device, announcement, &args.wire, None, args.bench.seed, output)
}

fn inverse(args: &InverseArgs, output: &Output) -> Result<(), Failure> {
    let settings = InverseServiceSettings {
        reply_delay: Nanos((args.reply_ms * 1e6) as u64),
        seed: args.seed,
        ..InverseServiceSettings::default()
    };
    let (mut device, _) = EmulatedInverse::new(settings).map_err(Failure::usage)?;
    let (model, label) = ("Inverse3".to_owned(), "Inverse service".to_owned());
    // A thousand answers a second: without it, this computer's other work would be the service's delay.
    let _ = request_real_time();
    let announcement = Announcement { device: "inverse", model, label, cell: None };
    let wire = WireArgs {
        pty: None,
        tcp: Some(args.tcp),
        baud: None,
        latency_ms: 0,
        fault: args.fault.clone(),
    };
    emulate(&mut device, announcement, &wire, None, args.seed, output)
}

fn hapi(args: &HapiArgs, output: &Output) -> Result<(), Failure> {
    let settings = HapiBoardSettings {
        reply_delay: Nanos((args.reply_ms * 1e6) as u64),
        has_own_power: args.own_power,
        ..HapiBoardSettings::default()
    };
    let (mut device, _) = EmulatedHapi::new(settings).map_err(Failure::usage)?;
    let (model, label) = ("2DIY".to_owned(), "hAPI board".to_owned());
    // A thousand answers a second, as above.
    let _ = request_real_time();
    let announcement = Announcement { device: "hapi", model, label, cell: None };
    emulate(&mut device, announcement, &args.wire, None, args.seed, output)
}

fn emulate(
    device: &mut dyn EmulatedDevice,
    announcement: Announcement,
    wire: &WireArgs,
    cell_link: Option<Option<PathBuf>>,
    seed: u64,
    output: &Output,
) -> Result<(), Failure> {
    let link = wire.pty.clone().flatten();
    // Windows has no pseudo-terminals.
    let own = cfg!(windows).then_some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let tcp = wire.tcp.or(own);
    let place = match (tcp, cell_link) {
        (Some(address), None) => EmulatorAddress::Tcp(address),
        (Some(address), Some(cell)) => EmulatorAddress::TcpAndPtys(address, vec![cell]),
        (None, None) => EmulatorAddress::Pty(link),
        (None, Some(cell)) => EmulatorAddress::Ptys(vec![link, cell]),
    };
    let options = ServeOptions {
        address: place,
        baud: wire.baud,
        latency: Nanos(u64::from(wire.latency_ms) * 1_000_000),
        faults: wire.fault.clone(),
        seed,
    };
    let stop = ctrl_c_flag()?;
    let orders = read_lines("orders")?;
    let mut notify = |event: ServeEvent| match event {
        ServeEvent::Ready(at) => announcement.print(&at, tcp.is_none(), output),
        ServeEvent::Fault(turn) => {
            let verb = if turn.is_on { "begins" } else { "ends" };
            output.note(&format!("{} {verb}", turn.kind));
        }
        ServeEvent::Done(order) => {
            if let Some(sentence) = order.confirmation() {
                output.note(&sentence);
            }
        }
        ServeEvent::Refused(sentence) => output.note(&sentence),
    };
    serve(device, &options, &orders, &stop, &mut notify).map_err(|err| match err {
        ServeError::Open { .. } => Failure::failed(format!("{err} with --pty or --tcp")),
        err => Failure::failed(err),
    })
}
