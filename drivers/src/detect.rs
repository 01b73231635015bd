//! Who is at the other end of a link: one question that moves nothing, and what each device says to it.
//!
//! The question is `?` and an end of line. Grbl reports its status to the `?`, before the line is even read
//! (gnea/grbl, doc/markdown/interface.md); a Mark-10 gauge tells its reading (GCL2, Series 5 user's guide, page 17); the
//! load cell on an HX711 tells its header; a Galil controller refuses the command with a `?` of its own (DMC-1700/1800
//! user manual, chapter 5), after which it may be asked for its revision (`^R^V`).

use crate::galil::GalilBoard;
use crate::wire::{HostClock, Link};
use palpate_model::Nanos;
use std::fmt;
use std::io;
use std::time::Duration;

/// A device may be talking already, or starting anew because its port was opened, as an Arduino does for 1.5 s.
const LISTEN: Nanos = Nanos::from_millis(2_000);
/// An answer takes longer on no link.
const ANSWER_MAX: Nanos = Nanos::from_millis(700);
/// Longest single wait for bytes.
const READ_MAX: Duration = Duration::from_millis(5);
/// More than any of these devices says; what comes after it is not looked at.
const BYTES_MAX: usize = 4096;

/// What answers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Found {
    /// A Galil controller, by its revision.
    Galil(String),
    /// Grbl, by its banner or status report.
    Grbl(String),
    /// A Mark-10 force gauge, by a reading.
    Gauge(String),
    /// Our sketch on a board with an HX711, by its header.
    Hx711(String),
    /// Something that palpate does not know, by what it said.
    Unknown(String),
    /// Nothing answers.
    Silent,
}

impl Found {
    /// The word for it in a rig file, if palpate drives it.
    #[must_use]
    pub const fn device(&self) -> Option<&'static str> {
        match self {
            Self::Galil(_) => Some("galil"),
            Self::Grbl(_) => Some("grbl"),
            Self::Gauge(_) => Some("mark10"),
            Self::Hx711(_) => Some("hx711"),
            Self::Unknown(_) | Self::Silent => None,
        }
    }

    /// What it said of itself.
    #[must_use]
    pub fn said(&self) -> &str {
        match self {
            Self::Galil(said)
            | Self::Grbl(said)
            | Self::Gauge(said)
            | Self::Hx711(said)
            | Self::Unknown(said) => said,
            Self::Silent => "",
        }
    }
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Galil(said) => write!(f, "Galil controller, {said}"),
            Self::Grbl(said) => write!(f, "Grbl, {said}"),
            Self::Gauge(said) => write!(f, "force gauge that reads {said}"),
            Self::Hx711(said) => write!(f, "load cell on an HX711, {said}"),
            Self::Unknown(said) => write!(f, "unknown, says \"{said}\""),
            Self::Silent => f.write_str("silent at this baud rate"),
        }
    }
}

/// Listens, asks, and tells who it is. Nothing moves: what is written is `?`, an end of line, and after an answer like a
/// Galil controller's `^R^V`.
pub fn ask(link: &mut dyn Link, clock: &HostClock) -> io::Result<Found> {
    let mut heard = Vec::new();
    hear(link, clock, LISTEN, &mut heard, |heard| {
        recognise(heard).is_some()
    })?;
    if let Some(found) = recognise(&heard) {
        return Ok(found);
    }
    heard.clear();
    link.write(b"?\r\n")?;
    hear(link, clock, ANSWER_MAX, &mut heard, |heard| {
        recognise(heard).is_some()
    })?;
    if let Some(found) = recognise(&heard) {
        return Ok(found);
    }
    // The `?` of a controller that refuses a line, perhaps behind an echo of it.
    if heard.iter().any(|byte| matches!(byte, b'?' | b':')) {
        let mut answer = Vec::new();
        link.write(b"\x12\x16\r")?;
        hear(link, clock, ANSWER_MAX, &mut answer, |answer| {
            answer.ends_with(b":")
        })?;
        let text = readable(&answer);
        let from = text.find("DMC").or_else(|| text.find("RIO"));
        if let Some(from) = from {
            let revision = text[from..].trim_end_matches([':', '?', ' ']);
            return Ok(Found::Galil(match GalilBoard::parse(revision) {
                Ok(board) => board.revision,
                Err(err) => format!("{revision}: {err}"),
            }));
        }
    }
    Ok(if heard.is_empty() {
        Found::Silent
    } else {
        Found::Unknown(readable(&heard))
    })
}

/// Collects what comes in a time, until it is enough.
fn hear(
    link: &mut dyn Link,
    clock: &HostClock,
    wait: Nanos,
    heard: &mut Vec<u8>,
    is_enough: impl Fn(&[u8]) -> bool,
) -> io::Result<()> {
    let start = clock();
    let mut buffer = [0_u8; 256];
    while clock().since(start) < wait && heard.len() < BYTES_MAX && !is_enough(heard) {
        let count = link.read(&mut buffer, READ_MAX)?;
        heard.extend_from_slice(&buffer[..count]);
    }
    Ok(())
}

/// A device that says who it is in whole lines; a line without its end may be half a line.
fn recognise(heard: &[u8]) -> Option<Found> {
    let end = heard
        .iter()
        .rposition(|byte| matches!(byte, b'\r' | b'\n'))?;
    let text = String::from_utf8_lossy(&heard[..end]);
    text.split(['\r', '\n']).map(str::trim).find_map(|line| {
        let said = || line.chars().take(80).collect::<String>();
        if line.starts_with("Grbl ") || is_status(line) {
            Some(Found::Grbl(said()))
        } else if line.contains("palpate-hx711") {
            Some(Found::Hx711(said()))
        } else if is_reading(line) {
            Some(Found::Gauge(said()))
        } else {
            None
        }
    })
}

/// A status report: `<Idle|MPos:0.000,0.000,0.000|FS:0,0>`.
fn is_status(line: &str) -> bool {
    line.strip_prefix('<')
        .and_then(|rest| rest.strip_suffix('>'))
        .is_some_and(|inside| inside.contains("Pos:"))
}

/// A reading with its unit: `-18.78 lbF`, `4.285 N`.
fn is_reading(line: &str) -> bool {
    const UNITS: [&str; 8] = ["N", "mN", "kN", "lbF", "ozF", "gF", "kgF", "tF"];
    line.split_once(' ').is_some_and(|(number, unit)| {
        number.parse::<f64>().is_ok_and(f64::is_finite) && UNITS.contains(&unit.trim())
    })
}

/// What was heard, fit to be shown: the first line's worth, marks in place of what is no text.
fn readable(heard: &[u8]) -> String {
    let text = String::from_utf8_lossy(heard);
    let plain = text.chars().map(|c| if c.is_control() { ' ' } else { c });
    let plain: String = plain.take(80).collect();
    plain.trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_are_known_by_what_they_say() {
        let of = |heard: &str| recognise(heard.as_bytes()).and_then(|found| found.device());
        // gnea/grbl, doc/markdown/interface.md.
        assert_eq!(of("\r\nGrbl 1.1h ['$' for help]\r\n"), Some("grbl"));
        assert_eq!(
            of("<Idle|MPos:0.000,0.000,0.000|FS:0,0>\r\nok\r\n"),
            Some("grbl")
        );
        // Series 5 user's guide, page 19.
        assert_eq!(of("-18.78 lbF\r\n"), Some("mark10"));
        assert_eq!(of("4.285 N\r\n"), Some("mark10"));
        for nothing in [
            "",
            "?",
            "ok\r\n",
            "4.285 N",
            "<>\r\n",
            "nan N\r\n",
            "4 X\r\n",
        ] {
            assert_eq!(of(nothing), None, "{nothing:?}");
        }
    }

    #[test]
    fn what_is_shown_gives_a_terminal_no_orders() {
        assert_eq!(readable(b"\x1b[2Jhello\r\n\xff"), "[2Jhello  \u{fffd}");
    }
}
