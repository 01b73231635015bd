//! Faults on command: of the line, byte by byte, and of the device.

use palpate_drivers::sim::{Random, RandomStream};
use palpate_model::Nanos;
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// A fault of the device itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceFault {
    /// It restarts, as after a drop of its supply.
    Reset,
    /// The load cell's signal is frozen.
    Stuck,
    /// The load cell's amplifier is saturated.
    Saturated,
    /// Another device of its kind answers in its place.
    WrongDevice,
}

/// A fault of the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineFault {
    /// Bytes are changed or inserted.
    Garbage,
    /// Bytes are dropped.
    Drop,
    /// Bytes arrive twice.
    Duplicate,
    /// Answers end early.
    Partial,
    /// Answers arrive late.
    Late,
    /// No byte reaches the device.
    Deaf,
    /// No byte leaves the device.
    Mute,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    Line(LineFault),
    Device(DeviceFault),
    /// The plug is pulled, and put back at the end.
    Disconnect,
}

const KINDS: [(&str, FaultKind); 12] = [
    ("garbage", FaultKind::Line(LineFault::Garbage)),
    ("drop", FaultKind::Line(LineFault::Drop)),
    ("duplicate", FaultKind::Line(LineFault::Duplicate)),
    ("partial", FaultKind::Line(LineFault::Partial)),
    ("late", FaultKind::Line(LineFault::Late)),
    ("deaf", FaultKind::Line(LineFault::Deaf)),
    ("mute", FaultKind::Line(LineFault::Mute)),
    ("reset", FaultKind::Device(DeviceFault::Reset)),
    ("disconnect", FaultKind::Disconnect),
    ("stuck", FaultKind::Device(DeviceFault::Stuck)),
    ("saturated", FaultKind::Device(DeviceFault::Saturated)),
    ("wrong-device", FaultKind::Device(DeviceFault::WrongDevice)),
];

/// Share of the bytes that a line fault corrupts: one or two of a 20-byte command.
const CORRUPTED_SHARE: f64 = 0.08;
/// Delay of late answers: longer than the half second that impatient clients wait.
const LATENESS: Nanos = Nanos(700_000_000);
/// Duration of a fault that names none.
const DURATION: Nanos = Nanos(500_000_000);
/// Latest start and longest duration: a day.
const SECONDS_MAX: f64 = 86_400.0;

#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("'{0}' is not a fault; give KIND@SECONDS or KIND@SECONDS:DURATION, where KIND is one of {kinds}", kinds = kinds())]
pub struct FaultError(String);

impl FaultError {
    pub(super) fn text(&self) -> &str {
        &self.0
    }
}

pub(super) fn kinds() -> String {
    KINDS.map(|(name, _)| name).join(", ")
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScheduledFault {
    pub kind: FaultKind,
    pub from: Nanos,
    pub until: Nanos,
}

impl ScheduledFault {
    /// Reads `KIND@SECONDS[:DURATION]`, or `KIND[:DURATION]` for one that begins at `now`.
    pub fn parse(text: &str, now: Option<Nanos>) -> Result<Self, FaultError> {
        let refused = || FaultError(text.to_owned());
        let seconds = |text: &str| -> Result<Nanos, FaultError> {
            let seconds: f64 = text.trim().parse().map_err(|_| refused())?;
            if !(0.0..=SECONDS_MAX).contains(&seconds) {
                return Err(refused());
            }
            Ok(Nanos((seconds * 1e9) as u64))
        };
        let (rest, duration) = match text.split_once(':') {
            Some((rest, duration)) => (rest, seconds(duration)?),
            None => (text, DURATION),
        };
        let (name, from) = match (rest.split_once('@'), now) {
            (Some((name, from)), None) => (name, seconds(from)?),
            (None, Some(now)) => (rest, now),
            _ => return Err(refused()),
        };
        let name = name.trim();
        let (_, kind) = KINDS.iter().find(|(known, _)| *known == name).ok_or_else(refused)?;
        Ok(Self { kind: *kind, from, until: from + duration })
    }
}

impl FromStr for ScheduledFault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::parse(text, None)
    }
}

impl fmt::Display for FaultKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = KINDS.iter().find(|(_, kind)| kind == self);
        f.write_str(name.map_or("", |(name, _)| name))
    }
}

/// Pending and active faults, with the random numbers they share.
#[derive(Clone, Debug)]
pub struct FaultPlan {
    pending: Vec<ScheduledFault>,
    active: Vec<ScheduledFault>,
    random: Random,
}

/// A fault has begun or ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultEvent {
    pub kind: FaultKind,
    pub is_on: bool,
}

impl FaultPlan {
    /// The seed decides which bytes are corrupted.
    pub fn new(faults: Vec<ScheduledFault>, seed: u64) -> Self {
        Self { pending: faults, active: Vec::new(), random: Random::new(seed, RandomStream::Fault) }
    }

    pub fn add(&mut self, fault: ScheduledFault) {
        self.pending.push(fault);
    }

    /// Faults that begin or end up to `now`, ends first.
    pub fn advance(&mut self, now: Nanos) -> Vec<FaultEvent> {
        let event = |fault: ScheduledFault, is_on| FaultEvent { kind: fault.kind, is_on };
        let mut events = Vec::new();
        let over = self.active.extract_if(.., |fault| fault.until <= now);
        events.extend(over.map(|fault| event(fault, false)));
        let begun: Vec<_> = self.pending.extract_if(.., |fault| fault.from <= now).collect();
        for fault in begun {
            events.push(event(fault, true));
            self.active.push(fault);
        }
        events
    }

    pub fn is_on(&self, kind: FaultKind) -> bool {
        self.active.iter().any(|fault| fault.kind == kind)
    }

    fn has(&self, fault: LineFault) -> bool {
        self.is_on(FaultKind::Line(fault))
    }

    /// Delay of what is sent now.
    pub fn lateness(&self) -> Nanos {
        if self.has(LineFault::Late) { LATENESS } else { Nanos::ZERO }
    }

    /// Passes bytes through the line faults, to the device or from it.
    pub fn corrupt(&mut self, bytes: Vec<u8>, is_to_device: bool) -> Vec<u8> {
        if self.active.is_empty() {
            return bytes;
        }
        let is_dropped =
            if is_to_device { self.has(LineFault::Deaf) } else { self.has(LineFault::Mute) };
        if is_dropped {
            return Vec::new();
        }
        let mut bytes = bytes;
        if self.has(LineFault::Partial) && !is_to_device && !bytes.is_empty() {
            let length = self.random.between(0.0, bytes.len() as f64) as usize;
            bytes.truncate(length);
        }
        let mut out = Vec::with_capacity(bytes.len());
        for byte in bytes {
            if self.has(LineFault::Drop) && self.random.unit() < CORRUPTED_SHARE {
                continue;
            }
            if self.has(LineFault::Garbage) && self.random.unit() < CORRUPTED_SHARE {
                out.push(self.random.between(0.0, 256.0) as u8);
                if self.random.unit() < 0.5 {
                    continue;
                }
            }
            out.push(byte);
            if self.has(LineFault::Duplicate) && self.random.unit() < CORRUPTED_SHARE {
                out.push(byte);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_parsed_or_refused_by_name() {
        let fault: ScheduledFault = "stuck@2.5:10".parse().unwrap();
        assert_eq!(fault.kind, FaultKind::Device(DeviceFault::Stuck));
        assert_eq!((fault.from.0, fault.until.0), (2_500_000_000, 12_500_000_000));
        let fault = ScheduledFault::parse("mute", Some(Nanos(7))).unwrap();
        assert_eq!((fault.from.0, fault.until.0), (7, 500_000_007));
        for (name, kind) in KINDS {
            let fault: ScheduledFault = format!("{name}@1").parse().unwrap();
            assert_eq!((fault.kind, kind.to_string().as_str()), (kind, name));
        }
        for wrong in
            ["", "stuck", "stuck@", "melt@1", "stuck@-1", "stuck@1:x", "stuck@nan", "stuck@1e9"]
        {
            let err = wrong.parse::<ScheduledFault>().unwrap_err().to_string();
            assert!(err.contains(wrong) && err.contains("garbage, drop"), "{err}");
        }
    }

    #[test]
    fn faults_begin_and_end_and_corrupt_bytes() {
        let all: Vec<u8> = (0..200).collect();
        for (kind, is_to_device) in [
            ("garbage", true),
            ("drop", true),
            ("duplicate", false),
            ("partial", false),
            ("deaf", true),
            ("mute", false),
        ] {
            let fault = format!("{kind}@1:1").parse().unwrap();
            let mut plan = FaultPlan::new(vec![fault], 3);
            assert!(plan.advance(Nanos(999_999_999)).is_empty());
            assert_eq!(plan.corrupt(all.clone(), is_to_device), all);
            assert_eq!(plan.advance(Nanos(1_000_000_000)).len(), 1);
            let corrupted = plan.corrupt(all.clone(), is_to_device);
            assert_ne!(corrupted, all, "{kind}");
            match kind {
                "drop" | "partial" => assert!(corrupted.len() < all.len() && !corrupted.is_empty()),
                "duplicate" => assert!(corrupted.len() > all.len()),
                "deaf" | "mute" => {
                    assert!(corrupted.is_empty());
                    assert_eq!(plan.corrupt(all.clone(), !is_to_device), all);
                }
                _ => {}
            }
            let events = plan.advance(Nanos(2_000_000_000));
            assert!(matches!(events[..], [FaultEvent { is_on: false, .. }]));
            assert_eq!(plan.corrupt(all.clone(), is_to_device), all);
        }
    }

    #[test]
    fn equal_seeds_corrupt_equally() {
        let fault = "garbage@0:1".parse().unwrap();
        let corrupted = |seed| {
            let mut plan = FaultPlan::new(vec![fault], seed);
            plan.advance(Nanos(0));
            plan.corrupt(vec![b'x'; 300], false)
        };
        assert_eq!(corrupted(4), corrupted(4));
        assert_ne!(corrupted(4), corrupted(5));
    }
}
