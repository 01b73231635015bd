//! Opening a sidecar: who it is, whether that can be, and how fast it answers. Nothing moves.

use super::FLOODED;
use super::budget::LinkBudget;
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
/// More than a sidecar can send that has not heard that its samples end: a second at 20 000 samples, and the buffers of
/// an operating system. Another device that sends more is none.
const INTRODUCTION_MAX: usize = 8 << 20;

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
    let mut budget = LinkBudget::new(description.rate, console.now());
    for _ in 0..BEATS {
        let sent = console.now();
        ask(&mut console, &mut number, &mut budget, HostMessage::Beat, description.crc)?;
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
    let about = &connected.description;
    let mut budget = LinkBudget::new(about.rate, console.now());
    ask(&mut console, &mut connected.number, &mut budget, start, about.crc)?;
    connected.raw.append(&mut console.raw);
    Ok(())
}

fn introduce(
    console: &mut Console<'_>,
    number: &mut u64,
) -> Result<SidecarDescription, DeviceError> {
    let start = console.now();
    console.allow(INTRODUCTION_MAX);
    // Ends half a line that another program may have written.
    console.write("\n").map_err(lost)?;
    while console.now().since(start) < START_MAX && !console.is_flooded() {
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
    budget: &mut LinkBudget,
    message: HostMessage,
    has_checksum: bool,
) -> Result<(), DeviceError> {
    *number += 1;
    console.write(message.line(*number, has_checksum)).map_err(lost)?;
    budget.note_written();
    let until = console.now() + ANSWER_MAX;
    console.allow(INTRODUCTION_MAX);
    while let Some((at, item)) = console.next(until).map_err(lost)? {
        budget.take_item(at);
        if budget.is_exceeded() {
            break;
        }
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
    if console.is_flooded() || budget.is_exceeded() {
        return Err(DeviceError::unfit(DEVICE, FLOODED));
    }
    Err(DeviceError::Silent { device: DEVICE, hint: "it must answer every line within 100 ms" })
}

fn lost(err: io::Error) -> DeviceError {
    DeviceError::Lost { device: DEVICE, detail: err.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::time::Duration;

    /// Sends an introduction, if it has one, and then a text without end; each read takes a millisecond.
    struct Torrent {
        first: Vec<u8>,
        text: &'static [u8],
        now: Arc<AtomicU64>,
    }

    impl Link for Torrent {
        fn read(&mut self, buffer: &mut [u8], _wait: Duration) -> io::Result<usize> {
            self.now.fetch_add(1_000_000, Ordering::Relaxed);
            let first = std::mem::take(&mut self.first);
            let mut bytes = first.into_iter().chain(self.text.iter().copied().cycle());
            buffer.fill_with(|| bytes.next().unwrap_or(0));
            Ok(buffer.len())
        }

        fn write(&mut self, _bytes: &[u8]) -> io::Result<()> {
            Ok(())
        }
    }

    fn try_connect(first: &str, text: &'static [u8]) -> (DeviceError, u64) {
        let now = Arc::new(AtomicU64::new(0));
        let shared = Arc::clone(&now);
        let clock: HostClock = Arc::new(move || Nanos(shared.load(Ordering::Relaxed)));
        let mut link = Torrent { first: first.as_bytes().to_vec(), text, now: Arc::clone(&now) };
        let err = connect(&mut link, &clock, &"a".into(), None).unwrap_err();
        (err, now.load(Ordering::Relaxed) / 1_000_000)
    }

    #[test]
    fn a_torrent_instead_of_an_introduction_is_another_device() {
        for text in [&b"x"[..], b"{\"ok\":0}\n", b"{\"t\":1,\"c\":1,\"p\":1,\"s\":0}\n"] {
            let (err, ms) = try_connect("", text);
            assert!(matches!(err, DeviceError::Other { .. }), "{err}");
            // Of 1 kB each millisecond, 8 MB.
            assert!((8_000..8_500).contains(&ms), "{ms}");
        }
    }

    #[test]
    fn a_torrent_after_the_introduction_is_named() {
        let about =
            "{\"ok\":1,\"sidecar\":1,\"name\":\"a\",\"boot\":1,\"tick_ns\":1000,\"rate\":10}\n";
        let (err, ms) = try_connect(about, b"{\"ok\":0}\n");
        assert!(err.to_string().contains("far more"), "{err}");
        assert!(ms < 10, "{ms}");
    }
}
