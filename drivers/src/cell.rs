//! A load cell on a link of its own: what every such device provides, whatever its protocol.

use crate::text::{DeviceError, Lines, ReceivedLine};
use crate::wire::{HostClock, Link};
use palpate_model::Nanos;
use palpate_model::rig::{AdcDescription, RawBytes};
use palpate_model::units::Volts;
use std::collections::VecDeque;
use std::fmt::Debug;
use std::sync::Arc;

/// Values that may wait to be taken: a minute at 80 a second, 15 s at the fastest rate of a gauge.
const SAMPLES_MAX: usize = 4_800;
const TROUBLES_MAX: usize = 16;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellSample {
    /// Arrival of its last byte on the host's clock.
    pub at: Nanos,
    /// The device's own clock when it was taken, where it has one; it never goes back and never wraps.
    pub device_time: Option<Nanos>,
    pub counts: i32,
    /// The same in volts. A gauge that reads newtons counts as one volt per newton.
    pub volts: Volts,
}

/// What a load cell is, as it was found when it was connected.
#[derive(Clone, Debug, PartialEq)]
pub struct CellDescription {
    /// Model, firmware and settings, for the operator and the log.
    pub identity: String,
    pub adc: AdcDescription,
    /// Standard deviation at rest, as far as is known.
    pub noise_expected: Volts,
    /// Values per second.
    pub rate: f64,
    /// Age of a value when it is sent: half of the time that the filter of the device looks back.
    pub delay: Nanos,
    /// Newtons per volt where the device itself is calibrated, as a force gauge is.
    pub newtons_per_volt: Option<f64>,
}

/// A cell counts as gone when so many values in a row have not come, and at least a second.
const VALUES_MISSED: f64 = 5.0;

/// Longest silence of a cell with so many values per second.
pub(crate) fn silence_max(rate: f64) -> Nanos {
    Nanos::from_millis(1_000).max(Nanos((VALUES_MISSED * 1e9 / rate) as u64))
}

/// A load cell that has been identified and set up.
pub struct OpenedCell {
    pub description: CellDescription,
    /// It sends values from now on.
    pub dialogue: Box<dyn CellDialogue>,
    /// Bytes exchanged, by the host's clock.
    pub raw: Vec<RawBytes>,
    /// Written when the link is closed, so that the device falls silent; may be empty.
    pub closing_bytes: Vec<u8>,
}

/// A load cell beside an axis, as its rig file describes it.
pub trait CellDevice: Debug + Send + Sync {
    /// Checks the identity of the device on a link, sets it up and lets it send. `name` stands in the log of bytes.
    fn open(
        &self,
        link: &mut dyn Link,
        clock: &HostClock,
        name: &Arc<str>,
    ) -> Result<OpenedCell, DeviceError>;
}

/// A load cell that sends values by itself, in progress. It must neither wait nor read a clock.
pub trait CellDialogue: Send {
    fn handle_bytes(&mut self, now: Nanos, bytes: &[u8]);

    /// The oldest value not taken yet.
    fn take_sample(&mut self) -> Option<CellSample>;

    /// What went wrong since the last call, in words: a restart, a value out of range. Garbled lines are only counted.
    fn take_trouble(&mut self) -> Option<String>;

    /// Count of lines that were not values.
    fn garbled(&self) -> u64;

    /// Why the device counts as gone, if it does.
    fn is_dead(&self, now: Nanos) -> Option<String>;
}

/// What the lines of a load cell mean.
pub trait CellProtocol: Send {
    /// A whole line. `false` where it means nothing, so that it counts as garbled.
    fn take(&mut self, now: Nanos, line: &str, reports: &mut CellReports) -> bool;

    /// Why the device counts as gone, if it does; `newest` is when its newest value came.
    fn is_dead(&self, now: Nanos, newest: Nanos) -> Option<String>;
}

/// Values and troubles of a load cell that wait to be taken.
pub struct CellReports {
    samples: VecDeque<CellSample>,
    troubles: VecDeque<String>,
    newest: Nanos,
    is_beyond_range: bool,
}

impl CellReports {
    pub(crate) const fn new(now: Nanos) -> Self {
        Self {
            samples: VecDeque::new(),
            troubles: VecDeque::new(),
            newest: now,
            is_beyond_range: false,
        }
    }

    /// When the newest value came.
    pub(crate) const fn newest(&self) -> Nanos {
        self.newest
    }

    pub(crate) fn take_sample(&mut self) -> Option<CellSample> {
        self.samples.pop_front()
    }

    pub(crate) fn take_trouble(&mut self) -> Option<String> {
        self.troubles.pop_front()
    }

    /// Adds a value that has arrived now. Without room the oldest one goes.
    pub fn push_counts(
        &mut self,
        now: Nanos,
        device_time: Option<Nanos>,
        counts: i32,
        volts_per_count: f64,
    ) {
        self.newest = now;
        if self.samples.len() >= SAMPLES_MAX {
            self.samples.pop_front();
        }
        let volts = Volts(f64::from(counts) * volts_per_count);
        self.samples.push_back(CellSample { at: now, device_time, counts, volts });
    }

    pub fn push_trouble(&mut self, words: &str) {
        if self.troubles.len() < TROUBLES_MAX {
            self.troubles.push_back(words.to_owned());
        }
    }

    /// Reports the first of several values beyond the range.
    pub fn set_beyond_range(&mut self, is_beyond: bool, words: &str) {
        if is_beyond && !self.is_beyond_range {
            self.push_trouble(words);
        }
        self.is_beyond_range = is_beyond;
    }
}

/// A load cell that sends lines by itself.
pub struct LineCell<P> {
    protocol: P,
    lines: Lines,
    reports: CellReports,
    garbled: u64,
}

impl<P: CellProtocol> LineCell<P> {
    #[must_use]
    pub fn start(protocol: P, now: Nanos) -> Self {
        let reports = CellReports::new(now);
        Self { protocol, lines: Lines::default(), reports, garbled: 0 }
    }
}

impl<P: CellProtocol> CellDialogue for LineCell<P> {
    fn handle_bytes(&mut self, now: Nanos, bytes: &[u8]) {
        for byte in bytes {
            let is_garbled = match self.lines.take(*byte) {
                None => false,
                Some(ReceivedLine::Garbled) => true,
                Some(ReceivedLine::Line(line)) => {
                    !self.protocol.take(now, &line, &mut self.reports)
                }
            };
            self.garbled += u64::from(is_garbled);
        }
    }

    fn take_sample(&mut self) -> Option<CellSample> {
        self.reports.take_sample()
    }

    fn take_trouble(&mut self) -> Option<String> {
        self.reports.take_trouble()
    }

    fn garbled(&self) -> u64 {
        self.garbled
    }

    fn is_dead(&self, now: Nanos) -> Option<String> {
        self.protocol.is_dead(now, self.reports.newest)
    }
}
