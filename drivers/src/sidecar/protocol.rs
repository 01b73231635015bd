//! Lines and frames of a sidecar, version 1 (docs/sidecar-protocol.md), as values; without port, thread or clock.

use super::description::SidecarDescription;
use crate::hx711::protocol::crc;
use palpate_model::units::{MmPerS, MmPerS2};
use serde::Deserialize;
use serde_json::Value;
use std::collections::VecDeque;

pub const VERSION: u64 = 1;
/// Longest line of the host and of the sidecar, without its end.
pub const HOST_LINE_MAX: usize = 200;
pub const LINE_MAX: usize = 1_500;
/// First byte of a frame; no line has it.
pub const FRAME_START: u8 = 0xa5;
/// Bytes of a frame behind its length: tick, counts, pulses, status.
const FRAME_CONTENT: u8 = 13;
/// Bytes of a frame behind its first: length, content, checksum.
const FRAME_REST: usize = FRAME_CONTENT as usize + 3;
/// All bits of a status (`AxisStatus`).
const STATUS_MAX: u32 = 0x3f;
/// As far as a counter of 32 bits goes, which a frame has: with it no sum of positions overflows.
const PULSES_MAX: u64 = i32::MAX as u64;

/// What the host says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HostMessage {
    Hello,
    Start { is_binary: bool },
    Beat,
    Enable,
    Move { to: i64, speed: MmPerS, acceleration: MmPerS2 },
    Sine { amplitude: i64, period: u32, cycles: u32, acceleration: MmPerS2 },
    Stop,
    Halt,
    Bye,
}

impl HostMessage {
    /// The line with its number and its end.
    #[must_use]
    pub fn line(&self, number: u64, has_checksum: bool) -> Vec<u8> {
        let rest = match self {
            Self::Hello => format!(r#""hello","version":{VERSION}"#),
            Self::Start { is_binary } => format!(r#""start","binary":{is_binary}"#),
            Self::Beat => r#""beat""#.to_owned(),
            Self::Enable => r#""enable""#.to_owned(),
            // A float is written without exponent, which boards find easier to read.
            Self::Move { to, speed, acceleration } => {
                format!(r#""move","to":{to},"speed":{},"acceleration":{}"#, speed.0, acceleration.0)
            }
            Self::Sine { amplitude, period, cycles, acceleration } => format!(
                r#""sine","amplitude":{amplitude},"period":{period},"cycles":{cycles},"acceleration":{}"#,
                acceleration.0
            ),
            Self::Stop => r#""stop""#.to_owned(),
            Self::Halt => r#""halt""#.to_owned(),
            Self::Bye => r#""bye""#.to_owned(),
        };
        let has_checksum = has_checksum && *self != Self::Hello;
        finish_line(&format!(r#"{{"n":{number},"do":{rest}}}"#), has_checksum)
    }

    /// Reads a line without its end, as a sidecar does: its number and what it says.
    pub fn parse(line: &str, has_checksum: bool) -> Result<(u64, Self), HostLineError> {
        let refused = |why: &str| HostLineError { number: None, why: why.to_owned() };
        let is_plain = line.contains(r#""do":"hello""#) || !has_checksum;
        let text = if is_plain { Some(line) } else { checked(line) };
        let text = text.ok_or_else(|| refused("the checksum is wrong"))?;
        let raw: RawHostMessage = serde_json::from_str(text).map_err(|_| refused("not JSON"))?;
        let number = raw.n;
        let message = raw.message();
        let message = message.map_err(|why| HostLineError { number: Some(number), why })?;
        Ok((number, message))
    }
}

/// Why a line of the host is not obeyed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HostLineError {
    /// `None` where the line was not understood.
    pub number: Option<u64>,
    pub why: String,
}

#[derive(Deserialize)]
struct RawHostMessage {
    n: u64,
    #[serde(rename = "do")]
    word: String,
    version: Option<u64>,
    binary: Option<bool>,
    to: Option<i64>,
    speed: Option<f64>,
    acceleration: Option<f64>,
    amplitude: Option<i64>,
    period: Option<u32>,
    cycles: Option<u32>,
}

impl RawHostMessage {
    fn message(&self) -> Result<HostMessage, String> {
        let missing = || "a key is missing".to_owned();
        let positive = |value: Option<f64>| value.filter(|v| *v > 0.0).ok_or_else(missing);
        Ok(match self.word.as_str() {
            "hello" if self.version == Some(VERSION) => HostMessage::Hello,
            "hello" => return Err(format!("only version {VERSION} is spoken")),
            "start" => HostMessage::Start { is_binary: self.binary.unwrap_or(false) },
            "beat" => HostMessage::Beat,
            "enable" => HostMessage::Enable,
            "move" => HostMessage::Move {
                to: self.to.ok_or_else(missing)?,
                speed: MmPerS(positive(self.speed)?),
                acceleration: MmPerS2(positive(self.acceleration)?),
            },
            "sine" => HostMessage::Sine {
                amplitude: self.amplitude.ok_or_else(missing)?,
                period: self.period.ok_or_else(missing)?,
                cycles: self.cycles.ok_or_else(missing)?,
                acceleration: MmPerS2(positive(self.acceleration)?),
            },
            "stop" => HostMessage::Stop,
            "halt" => HostMessage::Halt,
            "bye" => HostMessage::Bye,
            other => return Err(format!("'{other}' is not known")),
        })
    }
}

/// A sample as it came.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SidecarSample {
    /// The device's clock, which wraps.
    pub ticks: u32,
    pub counts: Option<i32>,
    pub pulses: Option<i64>,
    /// Bits of `AxisStatus`.
    pub status: u32,
    /// Values of the sensors, in the order of the description.
    pub values: Vec<Option<f64>>,
}

impl SidecarSample {
    /// Whether its position is one that a counter can have, if it has one.
    #[must_use]
    pub fn has_possible_pulses(&self) -> bool {
        self.pulses.is_none_or(|pulses| pulses.unsigned_abs() <= PULSES_MAX)
    }

    /// The line of a sample with its end.
    #[must_use]
    pub fn line(&self, has_checksum: bool) -> Vec<u8> {
        let mut text = format!(r#"{{"t":{}"#, self.ticks);
        if let Some(counts) = self.counts {
            text += &format!(r#","c":{counts}"#);
        }
        if let Some(pulses) = self.pulses {
            text += &format!(r#","p":{pulses},"s":{}"#, self.status);
        }
        if !self.values.is_empty() {
            let one = |value: &Option<f64>| value.map_or_else(|| "null".into(), |v| v.to_string());
            let values: Vec<String> = self.values.iter().map(one).collect();
            text += &format!(r#","v":[{}]"#, values.join(","));
        }
        finish_line(&(text + "}"), has_checksum)
    }

    /// The frame of a sample; its values are left out.
    #[must_use]
    pub fn frame(&self) -> Vec<u8> {
        let mut frame = vec![FRAME_START, FRAME_CONTENT];
        frame.extend(self.ticks.to_le_bytes());
        frame.extend(self.counts.unwrap_or(0).to_le_bytes());
        let pulses = i32::try_from(self.pulses.unwrap_or(0)).unwrap_or(i32::MAX);
        frame.extend(pulses.to_le_bytes());
        frame.push(self.status as u8);
        let sum = crc(&frame[1..]);
        frame.extend(sum.to_le_bytes());
        frame
    }

    /// What is in a frame, without its first byte.
    fn from_frame(rest: &[u8; FRAME_REST]) -> Option<Self> {
        let (content, sum) = rest.split_at(FRAME_REST - 2);
        if sum != crc(content).to_le_bytes() || u32::from(content[13]) > STATUS_MAX {
            return None;
        }
        let word = |at: usize| [content[at], content[at + 1], content[at + 2], content[at + 3]];
        Some(Self {
            ticks: u32::from_le_bytes(word(1)),
            counts: Some(i32::from_le_bytes(word(5))),
            pulses: Some(i64::from(i32::from_le_bytes(word(9)))),
            status: u32::from(content[13]),
            values: Vec::new(),
        })
    }
}

/// What a sidecar says.
#[derive(Clone, Debug, PartialEq)]
pub enum SidecarMessage {
    Ok {
        number: u64,
        /// Its clock, in the answer to a beat.
        ticks: Option<u32>,
    },
    No {
        /// `None` for a line that it did not understand.
        number: Option<u64>,
        why: String,
    },
    Description(Box<SidecarDescription>),
    Sample(SidecarSample),
    Fault(String),
    /// It has started.
    Boot(u64),
}

#[derive(Deserialize)]
struct RawMessage {
    ok: Option<u64>,
    no: Option<Value>,
    why: Option<String>,
    sidecar: Option<u64>,
    t: Option<u32>,
    c: Option<i32>,
    p: Option<i64>,
    s: Option<u32>,
    v: Option<Vec<Option<f64>>>,
    fault: Option<String>,
    boot: Option<u64>,
}

/// Longest text of a device that is passed on.
const WORDS_MAX: usize = 120;

/// Text of a device, without what a terminal would do.
fn words(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).take(WORDS_MAX).collect()
}

impl SidecarMessage {
    /// Reads a line without its end and checksum; `None` where it is garbled.
    #[must_use]
    pub fn parse(line: &str) -> Option<Self> {
        let raw: RawMessage = serde_json::from_str(line).ok()?;
        Some(match raw {
            RawMessage { sidecar: Some(_), .. } => {
                Self::Description(Box::new(serde_json::from_str(line).ok()?))
            }
            RawMessage { ok: Some(number), t: ticks, .. } => Self::Ok { number, ticks },
            RawMessage { no: Some(Value::Number(number)), why, .. } => {
                Self::No { number: Some(number.as_u64()?), why: words(&why.unwrap_or_default()) }
            }
            RawMessage { why: Some(why), .. } => Self::No { number: None, why: words(&why) },
            RawMessage { fault: Some(text), .. } => Self::Fault(words(&text)),
            RawMessage { t: Some(ticks), c: counts, p: pulses, s, v, .. } => {
                let status = s.unwrap_or(0);
                if status > STATUS_MAX {
                    return None;
                }
                let values = v.unwrap_or_default();
                Self::Sample(SidecarSample { ticks, counts, pulses, status, values })
            }
            RawMessage { boot: Some(boot), .. } => Self::Boot(boot),
            _ => return None,
        })
    }
}

/// A text with its checksum, if it has one, and its end.
#[must_use]
pub fn finish_line(text: &str, has_checksum: bool) -> Vec<u8> {
    match has_checksum {
        true => format!("{text}*{:04X}\n", crc(text.as_bytes())).into_bytes(),
        false => format!("{text}\n").into_bytes(),
    }
}

/// What is before a right checksum.
fn checked(line: &str) -> Option<&str> {
    let (text, sum) = line.rsplit_once('*')?;
    let is_hex = sum.len() == 4 && sum.bytes().all(|b| b.is_ascii_hexdigit());
    (is_hex && u16::from_str_radix(sum, 16).ok()? == crc(text.as_bytes())).then_some(text)
}

#[derive(Clone, Debug, PartialEq)]
pub enum ReceivedItem {
    Message(SidecarMessage),
    /// Bytes that mean nothing.
    Garbled,
}

/// Cuts bytes, which come in any pieces, into lines and frames.
#[derive(Clone, Debug, Default)]
pub struct SidecarParser {
    line: Vec<u8>,
    is_spoiled: bool,
    /// What has come of a frame behind its first byte.
    frame: Option<Vec<u8>>,
    has_checksum: bool,
    has_frames: bool,
    ready: VecDeque<ReceivedItem>,
}

impl SidecarParser {
    /// Of a device after its description.
    #[must_use]
    pub fn new(has_checksum: bool, has_frames: bool) -> Self {
        Self { has_checksum, has_frames, ..Self::default() }
    }

    /// Takes a byte and gives an item, if one is ready: more than one becomes ready at a time only among frames.
    pub fn take(&mut self, byte: u8) -> Option<ReceivedItem> {
        self.push(byte);
        self.ready.pop_front()
    }

    /// Items that are ready.
    pub fn next_ready(&mut self) -> Option<ReceivedItem> {
        self.ready.pop_front()
    }

    fn push(&mut self, byte: u8) {
        if let Some(frame) = &mut self.frame {
            frame.push(byte);
            if frame[0] != FRAME_CONTENT || frame.len() == FRAME_REST {
                self.end_frame();
            }
            return;
        }
        match byte {
            FRAME_START if self.has_frames => {
                if !self.line.is_empty() || self.is_spoiled {
                    self.spoil();
                    self.end_line();
                }
                self.frame = Some(Vec::with_capacity(FRAME_REST));
            }
            b'\n' => self.end_line(),
            b'\r' => {}
            b' '..=b'~' if self.line.len() < LINE_MAX && !self.is_spoiled => self.line.push(byte),
            _ => self.spoil(),
        }
    }

    fn spoil(&mut self) {
        self.is_spoiled = true;
        self.line.clear();
    }

    fn end_line(&mut self) {
        let line = std::mem::take(&mut self.line);
        let is_spoiled = std::mem::take(&mut self.is_spoiled);
        if line.is_empty() && !is_spoiled {
            return;
        }
        let line = String::from_utf8_lossy(&line);
        let text = if self.has_checksum { checked(&line) } else { Some(&*line) };
        let message = text.filter(|_| !is_spoiled).and_then(SidecarMessage::parse);
        if let Some(SidecarMessage::Description(description)) = &message {
            self.has_checksum = description.crc;
        }
        self.ready.push_back(message.map_or(ReceivedItem::Garbled, ReceivedItem::Message));
    }

    fn end_frame(&mut self) {
        let Some(frame) = self.frame.take() else {
            return;
        };
        let whole = <&[u8; FRAME_REST]>::try_from(frame.as_slice());
        let sample = whole.ok().and_then(SidecarSample::from_frame);
        if let Some(sample) = sample {
            let message = SidecarMessage::Sample(sample);
            return self.ready.push_back(ReceivedItem::Message(message));
        }
        // A byte was lost or changed: the next frame or line may have begun within this one.
        self.ready.push_back(ReceivedItem::Garbled);
        self.is_spoiled = false;
        for byte in frame {
            self.push(byte);
        }
    }
}

#[cfg(test)]
mod tests;
