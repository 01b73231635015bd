//! Opening a sidecar: who it is, whether that can be, and how fast it answers. Nothing moves.

use super::description::SidecarDescription;
use super::protocol::{HostMessage, ReceivedItem, SidecarMessage, SidecarParser};
use crate::text::{DeviceError, describe_unknown_device};
use crate::wire::{HostClock, Link, LinkStats, SetupConsole};
use palpate_model::Nanos;
use palpate_model::rig::RawBytes;
use std::io;
use std::sync::Arc;

pub(super) const DEVICE: &str = "sidecar";
/// Opening a port resets most boards, whose boot loader then waits up to two seconds; a Python program with large
/// libraries takes as long to start.
const START_MAX: Nanos = Nanos::from_millis(10_000);
const ASK_EVERY: Nanos = Nanos::from_millis(300);
/// Five times what the protocol allows for an answer.
const ANSWER_MAX: Nanos = Nanos::from_millis(500);
const BEATS: usize = 20;
/// Count of the newest bytes that identify an unexpected device.
const RECEIVED_MAX: usize = 512;

/// A sidecar that has introduced itself. It sends no samples yet.
#[derive(Clone, Debug)]
pub struct ConnectedSidecar {
    pub description: SidecarDescription,
    pub stats: LinkStats,
    /// The number of the newest line.
    pub number: u64,
    pub raw: Vec<RawBytes>,
}

type Console<'a> = SetupConsole<'a, SidecarParser, ReceivedItem>;

/// Asks a sidecar who it is, checks that, and measures its answers. `name` stands in the log of bytes.
pub fn connect(
    link: &mut dyn Link,
    clock: &HostClock,
    name: &Arc<str>,
    serial: Option<&str>,
) -> Result<ConnectedSidecar, DeviceError> {
    let mut console = Console::open(link, clock, name, SidecarParser::take);
    let mut number = 0;
    let description = introduce(&mut console, &mut number)?;
    description.check().map_err(|detail| DeviceError::unfit(DEVICE, detail))?;
    DeviceError::check_serial(DEVICE, description.serial.as_deref(), serial)?;
    let mut stats = LinkStats { in_flight: 1, ..LinkStats::default() };
    for _ in 0..BEATS {
        let sent = console.now();
        ask(&mut console, &mut number, HostMessage::Beat, description.crc)?;
        stats.push(console.now().since(sent));
    }
    Ok(ConnectedSidecar { description, stats, number, raw: console.raw })
}

/// Starts the samples of a sidecar that is only listened to from now on, as lines.
pub fn start_samples(
    link: &mut dyn Link,
    clock: &HostClock,
    name: &Arc<str>,
    connected: &mut ConnectedSidecar,
) -> Result<(), DeviceError> {
    let mut console = Console::open(link, clock, name, SidecarParser::take);
    console.set_parser(SidecarParser::new(connected.description.crc, false));
    let start = HostMessage::Start { is_binary: false };
    ask(&mut console, &mut connected.number, start, connected.description.crc)?;
    connected.raw.append(&mut console.raw);
    Ok(())
}

fn introduce(
    console: &mut Console<'_>,
    number: &mut u64,
) -> Result<SidecarDescription, DeviceError> {
    let start = console.now();
    // Ends half a line that another program may have written.
    console.write("\n").map_err(lost)?;
    while console.now().since(start) < START_MAX {
        *number += 1;
        console.write(HostMessage::Hello.line(*number, false)).map_err(lost)?;
        let until = console.now() + ASK_EVERY;
        while let Some((_, item)) = console.next(until).map_err(lost)? {
            match item {
                ReceivedItem::Message(SidecarMessage::Description(description)) => {
                    return Ok(*description);
                }
                ReceivedItem::Message(SidecarMessage::No { number: Some(_), why }) => {
                    let detail = format!("it refuses to introduce itself: {why}");
                    return Err(DeviceError::unfit(DEVICE, detail));
                }
                _ => {}
            }
        }
    }
    let received = console.last_received(RECEIVED_MAX);
    if received.is_empty() {
        let hint = "check that the program runs, or power, cable and baud rate of the board";
        return Err(DeviceError::Silent { device: DEVICE, hint });
    }
    let found = describe_unknown_device(&String::from_utf8_lossy(&received));
    Err(DeviceError::Other { device: DEVICE, found })
}

fn ask(
    console: &mut Console<'_>,
    number: &mut u64,
    message: HostMessage,
    has_checksum: bool,
) -> Result<(), DeviceError> {
    *number += 1;
    console.write(message.line(*number, has_checksum)).map_err(lost)?;
    let until = console.now() + ANSWER_MAX;
    while let Some((_, item)) = console.next(until).map_err(lost)? {
        match item {
            ReceivedItem::Message(SidecarMessage::Ok { number: found, .. }) if found == *number => {
                return Ok(());
            }
            ReceivedItem::Message(SidecarMessage::No { number: Some(found), why })
                if found == *number =>
            {
                return Err(DeviceError::unfit(DEVICE, format!("it refuses {message:?}: {why}")));
            }
            ReceivedItem::Message(SidecarMessage::Fault(why)) => {
                return Err(DeviceError::unfit(DEVICE, why));
            }
            _ => {}
        }
    }
    Err(DeviceError::Silent { device: DEVICE, hint: "it must answer every line within 100 ms" })
}

fn lost(err: io::Error) -> DeviceError {
    DeviceError::Lost { device: DEVICE, detail: err.to_string() }
}
