//! Detection of the device on a link: one question that moves nothing, and the answer of each device to it.
//!
//! The question is `?` and an end of line. Grbl reports its status to the `?`, before the line is even read
//! (gnea/grbl, doc/markdown/interface.md); a Mark-10 gauge sends its reading (GCL2, Series 5 user's guide, page 17);
//! the load cell on an HX711 sends its header; a Galil controller refuses the command with a `?` of its own
//! (DMC-1700/1800 user manual, chapter 5), after which it may be asked for its revision (`^R^V`).

use crate::devices::{DeviceKind, split_lines};
use crate::galil::{self, GalilBoard};
use crate::wire::{HostClock, Link};
use palpate_model::Nanos;
use std::fmt;
use std::io;
use std::time::Duration;

/// A device may be sending already, or restarting because its port was opened, as an Arduino does for 1.5 s.
const LISTEN: Nanos = Nanos::from_millis(2_000);
const ANSWER_MAX: Nanos = Nanos::from_millis(700);
const READ_MAX: Duration = Duration::from_millis(5);
/// More than any of these devices says; what comes after it is not looked at.
const BYTES_MAX: usize = 4096;
const SHOWN_MAX: usize = 80;

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DetectedDevice {
    /// A device that palpate drives: its word in a rig file, its introduction, and its own words.
    Device(&'static str, &'static str, String),
    /// A device that palpate does not know, by its answer.
    Unknown(String),
    Silent,
}

impl DetectedDevice {
    fn from_kind(kind: &'static DeviceKind, text: &str) -> Self {
        let text = text.chars().take(SHOWN_MAX).collect();
        Self::Device(kind.word, kind.introduction, text)
    }

    /// The word for it in a rig file, if palpate drives it.
    pub const fn device(&self) -> Option<&'static str> {
        match self {
            Self::Device(word, ..) => Some(word),
            Self::Unknown(_) | Self::Silent => None,
        }
    }
}

impl fmt::Display for DetectedDevice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Device(_, introduction, text) => write!(f, "{introduction}{text}"),
            Self::Unknown(text) => write!(f, "an unknown device that sends \"{text}\""),
            Self::Silent => f.write_str("no device answers at this baud rate"),
        }
    }
}

/// Listens, asks, and identifies the device. Nothing moves: what is written is `?`, an end of line, and after an
/// answer like a Galil controller's `^R^V`.
pub fn detect_device(link: &mut dyn Link, clock: &HostClock) -> io::Result<DetectedDevice> {
    let mut received = Vec::new();
    receive(link, clock, LISTEN, &mut received, |received| recognise(received).is_some())?;
    if let Some(found) = recognise(&received) {
        return Ok(found);
    }
    received.clear();
    link.write(b"?\r\n")?;
    receive(link, clock, ANSWER_MAX, &mut received, |received| recognise(received).is_some())?;
    if let Some(found) = recognise(&received) {
        return Ok(found);
    }
    // The `?` of a controller that refuses a line, perhaps behind an echo of it.
    if received.iter().any(|byte| matches!(byte, b'?' | b':')) {
        let mut answer = Vec::new();
        link.write(b"\x12\x16\r")?;
        receive(link, clock, ANSWER_MAX, &mut answer, |answer| answer.ends_with(b":"))?;
        let text = printable_text(&answer);
        let from = text.find("DMC").or_else(|| text.find("RIO"));
        if let Some(from) = from {
            let revision = text[from..].trim_end_matches([':', '?', ' ']);
            let text = match GalilBoard::parse(revision) {
                Ok(board) => board.revision,
                Err(err) => format!("{revision}: {err}"),
            };
            return Ok(DetectedDevice::Device(galil::KIND.word, galil::KIND.introduction, text));
        }
    }
    Ok(if received.is_empty() {
        DetectedDevice::Silent
    } else {
        DetectedDevice::Unknown(printable_text(&received))
    })
}

/// Collects what comes in a time, until it is enough.
fn receive(
    link: &mut dyn Link,
    clock: &HostClock,
    wait: Nanos,
    received: &mut Vec<u8>,
    is_enough: impl Fn(&[u8]) -> bool,
) -> io::Result<()> {
    let start = clock();
    let mut buffer = [0_u8; 256];
    while clock().since(start) < wait && received.len() < BYTES_MAX && !is_enough(received) {
        let count = link.read(&mut buffer, READ_MAX)?;
        received.extend_from_slice(&buffer[..count]);
    }
    Ok(())
}

/// A device that is recognised by its whole lines; a line without its end may be half a line.
fn recognise(received: &[u8]) -> Option<DetectedDevice> {
    let end = received.iter().rposition(|byte| matches!(byte, b'\r' | b'\n'))?;
    let text = String::from_utf8_lossy(&received[..end]);
    let (kind, text) = DeviceKind::recognise_lines(&split_lines(&text))?;
    Some(DetectedDevice::from_kind(kind, text))
}

/// The beginning of what was received, without control characters and bytes that are no text.
fn printable_text(received: &[u8]) -> String {
    let text = String::from_utf8_lossy(received);
    let plain = text.chars().map(|c| if c.is_control() { ' ' } else { c });
    let plain: String = plain.take(SHOWN_MAX).collect();
    plain.trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_are_recognised_by_their_lines() {
        let of = |received: &str| recognise(received.as_bytes()).and_then(|found| found.device());
        // gnea/grbl, doc/markdown/interface.md.
        assert_eq!(of("\r\nGrbl 1.1h ['$' for help]\r\n"), Some("grbl"));
        assert_eq!(of("<Idle|MPos:0.000,0.000,0.000|FS:0,0>\r\nok\r\n"), Some("grbl"));
        // Series 5 user's guide, page 19.
        assert_eq!(of("-18.78 lbF\r\n"), Some("mark10"));
        assert_eq!(of("4.285 N\r\n"), Some("mark10"));
        for nothing in ["", "?", "ok\r\n", "4.285 N", "<>\r\n", "nan N\r\n", "4 X\r\n"] {
            assert_eq!(of(nothing), None, "{nothing:?}");
        }
    }

    #[test]
    fn shown_text_has_no_control_characters() {
        assert_eq!(printable_text(b"\x1b[2Jhello\r\n\xff"), "[2Jhello  \u{fffd}");
    }
}
