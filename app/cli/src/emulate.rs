//! `palpate emulate`: a device that is not there, on a pseudo-terminal or a TCP port.

use super::Failure;
use super::output::Output;
use super::rig::BenchArgs;
use clap::builder::PossibleValuesParser;
use clap::{Args, Subcommand};
use palpate_emulators::bench::EmulatedBench;
use palpate_emulators::cell::{emulated_cell, emulated_cells};
use palpate_emulators::galil::{GalilEmulator, GalilModel, GalilSettings};
use palpate_emulators::grbl::{Eeprom, Grbl, EmulatedGrblSettings, HomeWiring};
use palpate_emulators::mark10::{EmulatedGaugeSettings, EmulatedStand, EmulatedStandSettings};
use palpate_emulators::serve::{Place, ServeOptions, Told, serve};
use palpate_emulators::{EmulatedDevice, ScheduledFault};
use palpate_model::Nanos;
use serde::Serialize;
use std::io::BufRead;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};

/// An Arduino Uno's ceramic resonator is rated at 0.5 %: this one is fast by 0.3 %.
const UNO: f64 = 1.003;

/// Orders that may wait; a person types them.
const ORDERS_MAX: usize = 16;

/// Answer like a controller on a wire, with the simulated bench behind it
#[derive(Debug, Subcommand)]
pub enum EmulateCommand {
    /// A Galil DMC controller: axis A the slide with the probe, analog input 1 the load cell
    Galil(GalilArgs),
    /// A Grbl board with the slide on its X axis, and a load cell on a serial line of its own
    Grbl(GrblArgs),
    /// A Mark-10 stand ESM303 with a force gauge on it
    Mark10(Mark10Args),
}

/// The wire to an emulated device.
#[derive(Debug, Args)]
struct WireArgs {
    /// Be a serial port: a pseudo-terminal, with a link to it by this name; the usual place
    #[arg(long, value_name = "PATH", num_args = 0..=1, conflicts_with = "tcp")]
    pty: Option<Option<PathBuf>>,
    /// Be a device on a network at this address, such as 127.0.0.1:5023; port 0 is any free one
    #[arg(long, value_name = "ADDRESS:PORT")]
    tcp: Option<SocketAddr>,
    /// Bits a second of the serial line; without it bytes take no time
    #[arg(long, value_name = "BAUD", value_parser = clap::value_parser!(u32).range(300..=4_000_000))]
    baud: Option<u32>,
    /// Latency timer of a USB converter in ms: it keeps a packet that is not full for so long
    #[arg(long, value_name = "MS", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=255))]
    latency_ms: u32,
    /// A fault, KIND@SECONDS[:DURATION]: garbage, drop, duplicate, partial, late, deaf, mute, reset, disconnect, stuck, saturated or wrong-device; may be repeated. Lines KIND[:DURATION] on standard input begin at once; so do load GRAMS, mount NUMBER and unmount
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
    /// How fast the controller's crystal is, in parts in a million
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
    /// Load cell beside it
    #[arg(long, default_value = "hx711", value_parser = PossibleValuesParser::new(emulated_cells()))]
    cell: String,
    /// Link to the pseudo-terminal of the load cell, which has one also where --tcp is the board's address
    #[arg(long, value_name = "PATH")]
    cell_pty: Option<PathBuf>,
    /// Home switch on the limit pin of the axis, or on the probe pin with limit switches on the limit pin: limit or probe
    #[arg(long, default_value = "limit")]
    home: HomePin,
    /// A setting that the board has stored, NUMBER=VALUE such as 22=1; may be repeated
    #[arg(long, value_name = "NUMBER=VALUE", value_parser = setting)]
    setting: Vec<(u16, f64)>,
    /// What $I= has stored, by which a board is told from others
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

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum HomePin {
    Limit,
    Probe,
}

fn setting(text: &str) -> Result<(u16, f64), String> {
    let wrong = || "give NUMBER=VALUE, such as 22=1".to_owned();
    let (number, value) = text.split_once('=').ok_or_else(wrong)?;
    let number = number.trim_start_matches('$').parse().map_err(|_| wrong())?;
    let value = value.parse().ok().filter(|value: &f64| value.is_finite());
    Ok((number, value.ok_or_else(wrong)?))
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
    text.parse()
        .ok()
        .filter(|ppm: &f64| ppm.abs() <= 1000.0)
        .ok_or_else(|| "give -1000 to 1000".to_owned())
}

#[derive(Serialize)]
struct Ready<'a> {
    device: &'static str,
    model: String,
    at: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    cell_at: Option<&'a str>,
    is_serial: bool,
}

/// Emulates until it is stopped.
pub(super) fn run(command: &EmulateCommand, output: &Output) -> Result<(), Failure> {
    match command {
        EmulateCommand::Galil(args) => galil(args, output),
        EmulateCommand::Grbl(args) => grbl(args, output),
        EmulateCommand::Mark10(args) => mark10(args, output),
    }
}

fn galil(args: &GalilArgs, output: &Output) -> Result<(), Failure> {
    let usual = if args.model.is_21x3() { None } else { Some(16) };
    let is_serial = args.wire.tcp.is_none();
    let mut device = GalilEmulator::new(GalilSettings {
        sim: args.bench.settings(),
        model: args.model,
        converter: args.adc.map_or(usual, |bits| bits.0),
        is_serial,
        has_echo: args.echo,
        clock_ppm: args.clock_ppm,
        serial_number: args.serial_number,
    });
    let mut ready = |at: &str| {
        let object =
            Ready { device: "galil", model: args.model.to_string(), at, cell_at: None, is_serial };
        output.answer("emulate", &object, || format!("{} at {at}; Ctrl-C ends it", args.model));
    };
    emulate(&mut device, &args.wire, None, args.bench.seed, &mut ready, output)
}

fn grbl(args: &GrblArgs, output: &Output) -> Result<(), Failure> {
    let mut eeprom = Eeprom::slide();
    if args.home == HomePin::Probe {
        // As the limit switches on the limit pin need it; every board takes it.
        let _ = eeprom.set(21, 1.0);
    }
    for (number, value) in &args.setting {
        eeprom.set(*number, *value).map_err(|code| {
            Failure::usage(format!(
                "the board would refuse --setting {number}={value} with error:{code}"
            ))
        })?;
    }
    eeprom.build_info.clone_from(&args.build_info);
    let board = Grbl::new(EmulatedGrblSettings {
        eeprom,
        home: match args.home {
            HomePin::Limit => HomeWiring::Limit,
            HomePin::Probe => HomeWiring::Probe,
        },
        resonator: UNO,
        ..EmulatedGrblSettings::default()
    });
    let seed = args.bench.seed;
    let model = &args.cell;
    // One of those that are emulated: it was checked when the arguments were read.
    let cell = emulated_cell(model, seed)
        .ok_or_else(|| Failure::usage(format!("no emulated load cell is called {model}")))?;
    let mut device = EmulatedBench::new(&args.bench.settings(), Box::new(board), cell);
    let mut ready = |places: &str| {
        let (at, cell_at) = places.split_once(", ").unwrap_or((places, ""));
        let object = Ready {
            device: "grbl",
            model: format!("1.1h with {model}"),
            at,
            cell_at: Some(cell_at),
            is_serial: args.wire.tcp.is_none(),
        };
        output.answer("emulate", &object, || {
            format!("Grbl 1.1h at {at}, {model} at {cell_at}; Ctrl-C ends it")
        });
    };
    let cell_link = Some(args.cell_pty.clone());
    emulate(&mut device, &args.wire, cell_link, seed, &mut ready, output)
}

fn mark10(args: &Mark10Args, output: &Output) -> Result<(), Failure> {
    let seed = args.bench.seed;
    let mut device = EmulatedStand::new(EmulatedStandSettings {
        sim: args.bench.settings(),
        gauge: EmulatedGaugeSettings { seed, ..EmulatedGaugeSettings::default() },
        ..EmulatedStandSettings::default()
    });
    let is_serial = args.wire.tcp.is_none();
    let mut ready = |at: &str| {
        let object =
            Ready { device: "mark10", model: "ESM303".into(), at, cell_at: None, is_serial };
        output.answer("emulate", &object, || format!("ESM303 at {at}; Ctrl-C ends it"));
    };
    emulate(&mut device, &args.wire, None, seed, &mut ready, output)
}

fn emulate(
    device: &mut dyn EmulatedDevice,
    wire: &WireArgs,
    cell_link: Option<Option<PathBuf>>,
    seed: u64,
    ready: &mut dyn FnMut(&str),
    output: &Output,
) -> Result<(), Failure> {
    let link = wire.pty.clone().flatten();
    let place = match (wire.tcp, cell_link) {
        (Some(address), None) => Place::Tcp(address),
        (Some(address), Some(cell)) => Place::TcpAndPtys(address, vec![cell]),
        (None, None) => Place::Pty(link),
        (None, Some(cell)) => Place::Ptys(vec![link, cell]),
    };
    let options = ServeOptions {
        place,
        baud: wire.baud,
        latency: Nanos(u64::from(wire.latency_ms) * 1_000_000),
        faults: wire.fault.clone(),
        seed,
    };
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed)).map_err(Failure::failed)?;
    let orders = orders()?;
    let mut tell = |told: Told| match told {
        Told::Ready(at) => ready(&at),
        Told::Fault(turn) => {
            let verb = if turn.is_on { "begins" } else { "ends" };
            output.note(&format!("{} {verb}", turn.kind));
        }
        Told::Done(order) => {
            if let Some(told) = order.confirmation() {
                output.note(&told);
            }
        }
        Told::Refused(sentence) => output.note(&sentence),
    };
    serve(device, &options, &orders, &stop, &mut tell).map_err(Failure::failed)
}

/// Lines of standard input; its end changes nothing.
fn orders() -> Result<Receiver<String>, Failure> {
    let (sender, receiver) = sync_channel(ORDERS_MAX);
    std::thread::Builder::new()
        .name("orders".into())
        .spawn(move || {
            for line in std::io::stdin().lock().lines() {
                let Ok(line) = line else { return };
                let line = line.trim();
                if !line.is_empty() && sender.send(line.to_owned()).is_err() {
                    return;
                }
            }
        })
        .map_err(Failure::failed)?;
    Ok(receiver)
}
