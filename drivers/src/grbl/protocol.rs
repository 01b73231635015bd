//! Lines that Grbl 1.1 writes (gnea/grbl, doc/markdown/interface.md): answers, alarms, status reports, messages.
//!
//! Bytes in, [`GrblLine`] out; nothing else. Forms that older firmware or other compile options give are read too where
//! the documents allow them.

use super::error::GrblCode;

/// Longer lines are none of Grbl's: its own are at most 80 characters and a status report about 120.
pub const LINE_MAX: usize = 256;

/// Status query (doc/markdown/commands.md, real-time commands).
pub const QUERY: u8 = b'?';
pub const RESET: u8 = 0x18;
pub const JOG_CANCEL: u8 = 0x85;
/// Cycle start. A cancel that is heard in a jog and looked at when that has ended leaves Grbl suspended, though it says
/// `Idle`, and it takes no line until this comes (protocol.c, `protocol_exec_rt_system`; observed with 1.1h). It does
/// nothing to a board at rest.
pub const CYCLE_START: u8 = b'~';

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GrblState {
    Idle,
    Run,
    Jog,
    /// Held, `true` when at rest.
    Hold(bool),
    Alarm,
    Door,
    Check,
    /// Looking for home by itself.
    Home,
    Sleep,
}

impl GrblState {
    #[must_use]
    pub const fn is_moving(self) -> bool {
        matches!(self, Self::Run | Self::Jog | Self::Home)
    }

    fn parse(text: &str) -> Option<Self> {
        let (name, part) = text.split_once(':').unwrap_or((text, ""));
        Some(match name {
            "Idle" => Self::Idle,
            "Run" => Self::Run,
            "Jog" => Self::Jog,
            "Hold" => Self::Hold(part == "0"),
            "Alarm" => Self::Alarm,
            "Door" => Self::Door,
            "Check" => Self::Check,
            "Home" => Self::Home,
            "Sleep" => Self::Sleep,
            _ => return None,
        })
    }
}

/// A status report. Units are those of `$13`.
#[derive(Clone, Debug, PartialEq)]
pub struct GrblStatus {
    pub state: GrblState,
    /// Machine position of each axis, if the report has it.
    pub machine: Option<Vec<f64>>,
    /// Work position of each axis, if the report has it instead.
    pub work: Option<Vec<f64>>,
    /// Pins that are closed: `X`, `Y`, `Z`, `P` and others.
    pub pins: String,
}

impl GrblStatus {
    /// Reads what is between `<` and `>`.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let mut fields = text.split('|');
        let mut status = Self {
            state: GrblState::parse(fields.next()?)?,
            machine: None,
            work: None,
            pins: String::new(),
        };
        for field in fields {
            // Fields may come in any order, and new ones may come.
            let Some((name, values)) = field.split_once(':') else {
                continue;
            };
            match name {
                "MPos" => status.machine = Some(numbers(values)?),
                "WPos" => status.work = Some(numbers(values)?),
                "Pn" => status.pins = values.to_owned(),
                // Not used, but a garbled number spoils the report.
                "WCO" | "Bf" => drop(numbers(values)?),
                _ => {}
            }
        }
        // The position is in every report.
        (status.machine.is_some() || status.work.is_some()).then_some(status)
    }

    pub fn has_pin(&self, pin: char) -> bool {
        self.pins.contains(pin)
    }
}

/// Numbers with commas between them; `None` when one is none.
fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(number).collect()
}

fn number(text: &str) -> Option<f64> {
    let text = text.trim();
    let is_plain = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+');
    if !text.chars().all(is_plain) {
        return None;
    }
    text.parse().ok().filter(|number: &f64| number.is_finite())
}

#[derive(Clone, Debug, PartialEq)]
pub enum GrblLine {
    Ok,
    Refused(GrblCode),
    Alarm(GrblCode),
    /// An answer to [`QUERY`].
    Status(GrblStatus),
    Hello(String),
    Setting(u16, f64),
    /// What is between `[` and `]`.
    Message(String),
    Other(String),
    Flood,
}

impl GrblLine {
    /// Reads a line without its end.
    #[must_use]
    pub fn parse(line: &str) -> Self {
        let other = || Self::Other(line.to_owned());
        if line == "ok" {
            return Self::Ok;
        }
        // Words without numbers are those of version 0.9 and of some compile options: "error: Bad number format".
        if let Some(code) = line.strip_prefix("error:") {
            return Self::Refused(GrblCode::parse(false, code));
        }
        if let Some(code) = line.strip_prefix("ALARM:") {
            return Self::Alarm(GrblCode::parse(true, code));
        }
        if let Some(inner) = line.strip_prefix('<') {
            let inner = inner.strip_suffix('>');
            return inner.and_then(GrblStatus::parse).map_or_else(other, Self::Status);
        }
        if let Some(inner) = line.strip_prefix('[') {
            let inner = inner.strip_suffix(']');
            return inner.map_or_else(other, |inner| Self::Message(inner.to_owned()));
        }
        // grblHAL says `GrblHAL 1.1f ['$' or '$HELP' for help]` (grblHAL/core, report.c).
        let welcome = line.strip_prefix("Grbl ").or_else(|| line.strip_prefix("GrblHAL "));
        if let Some(rest) = welcome {
            let version = rest.split(' ').next().unwrap_or_default();
            return Self::Hello(version.to_owned());
        }
        if let Some((key, value)) = line.strip_prefix('$').and_then(|rest| rest.split_once('=')) {
            // Version 0.9 has a description behind the value.
            let value = value.split(' ').next().and_then(number);
            if let (Ok(key), Some(value)) = (key.parse(), value) {
                return Self::Setting(key, value);
            }
        }
        other()
    }
}

/// Takes a line apart from the bytes before and behind it.
#[derive(Clone, Debug, Default)]
pub struct GrblParser {
    line: Vec<u8>,
    is_flooded: bool,
}

impl GrblParser {
    pub fn take(&mut self, byte: u8) -> Option<GrblLine> {
        match byte {
            b'\r' | b'\n' => {
                let line = std::mem::take(&mut self.line);
                if std::mem::take(&mut self.is_flooded) {
                    return Some(GrblLine::Flood);
                }
                let line = String::from_utf8_lossy(&line);
                let line = line.trim();
                (!line.is_empty()).then(|| GrblLine::parse(line))
            }
            _ if self.line.len() >= LINE_MAX => {
                self.is_flooded = true;
                None
            }
            _ => {
                self.line.push(byte);
                None
            }
        }
    }
}

/// An absolute jog in machine coordinates: axis letter, place in mm, speed in mm/min (doc/markdown/jogging.md).
#[must_use]
pub fn jog(axis: char, mm: f64, mm_per_min: f64) -> String {
    // A tenth of a micrometre is below any step; Grbl reads at most eight digits.
    format!("$J=G21G90G53{axis}{mm:.4}F{mm_per_min:.2}\n")
}

#[cfg(test)]
mod tests;
