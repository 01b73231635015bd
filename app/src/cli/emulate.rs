//! `palpate emulate`: a device that is not there, on a pseudo-terminal or a TCP port.

use super::Failure;
use super::output::Output;
use super::rig::BenchArgs;
use clap::{Args, Subcommand};
use palpate_drivers::emulate::galil::{GalilEmulator, GalilModel, GalilSettings};
use palpate_drivers::emulate::serve::{Place, ServeOptions, Told, serve};
use palpate_drivers::emulate::{Device, ScheduledFault};
use palpate_model::Nanos;
use serde::Serialize;
use std::io::BufRead;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};

/// Orders that may wait; a person types them.
const ORDERS_MAX: usize = 16;

/// Which device.
#[derive(Debug, Subcommand)]
pub enum EmulateCommand {
    /// A Galil DMC controller: axis A the slide with the probe, analog input 1 the load cell
    Galil(GalilArgs),
}

impl EmulateCommand {
    /// Whether one object is printed.
    pub fn is_json(&self) -> bool {
        match self {
            Self::Galil(args) => args.wire.json,
        }
    }
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
    /// Print one JSON object when it is ready
    #[arg(long)]
    json: bool,
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
    command: &'static str,
    device: &'static str,
    model: String,
    at: &'a str,
    is_serial: bool,
}

/// Emulates until it is stopped.
pub(super) fn run(command: &EmulateCommand, output: &Output) -> Result<(), Failure> {
    let EmulateCommand::Galil(args) = command;
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
        let object = Ready {
            command: "emulate",
            device: "galil",
            model: args.model.to_string(),
            at,
            is_serial,
        };
        output.result(&object, || {
            format!("{} at {at}; Ctrl-C ends it", args.model)
        });
    };
    emulate(&mut device, &args.wire, args.bench.seed, &mut ready, output)
}

fn emulate(
    device: &mut dyn Device,
    wire: &WireArgs,
    seed: u64,
    ready: &mut dyn FnMut(&str),
    output: &Output,
) -> Result<(), Failure> {
    let place = match wire.tcp {
        Some(address) => Place::Tcp(address),
        None => Place::Pty(wire.pty.clone().flatten()),
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
            if let Some(told) = order.told() {
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
