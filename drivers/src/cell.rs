//! A load cell on a wire of its own: what every such device gives, whatever it speaks.

use crate::text::{DeviceError, Lines, OpenedCell, Taken};
use crate::wire::{HostClock, Link};
use palpate_model::Nanos;
use palpate_model::rig::AdcDescription;
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
    /// As the device counts.
    pub counts: i32,
    /// The same in volts. A gauge that tells newtons counts as one volt a newton.
    pub volts: Volts,
}

/// What a load cell is, as it was found when it was connected.
#[derive(Clone, Debug, PartialEq)]
pub struct CellDescription {
    /// Model, firmware and settings, for the operator and the log.
    pub identity: String,
    /// Range and step of its counts.
    pub adc: AdcDescription,
    /// Standard deviation of its values at rest, as far as is known.
    pub noise_expected: Volts,
    pub rate: f64,
    /// How long before it was sent a value was felt: half of the time that its filter looks back.
    pub delay: Nanos,
    /// Newtons of a volt where the device itself is calibrated, as a force gauge is.
    pub newtons_per_volt: Option<f64>,
}

/// A load cell beside an axis, as its rig file describes it.
pub trait CellDevice: Debug + Send + Sync {
    /// Makes sure who answers on a link, sets it up and lets it send. `name` is what the log of bytes calls it.
    fn open(
        &self,
        link: &mut dyn Link,
        clock: &HostClock,
        name: &Arc<str>,
    ) -> Result<OpenedCell, DeviceError>;
}

/// A load cell that sends values by itself, in progress. It must neither wait nor read a clock.
pub trait CellDialogue: Send {
    fn received(&mut self, now: Nanos, bytes: &[u8]);

    fn take_sample(&mut self) -> Option<CellSample>;

    /// What went wrong since this was last asked, in words: a restart, a value out of range. Garbled lines are counted,
    /// not told one by one.
    fn take_trouble(&mut self) -> Option<String>;

    fn garbled(&self) -> u64;

    /// Why the device counts as gone, if it does.
    fn is_dead(&self, now: Nanos) -> Option<String>;
}

pub trait CellProtocol: Send {
    /// A whole line. `false` where it means nothing, so that it counts as garbled.
    fn take(&mut self, now: Nanos, line: &str, reports: &mut CellReports) -> bool;

    /// Why the device counts as gone, if it does; `newest` is when its newest value came.
    fn is_dead(&self, now: Nanos, newest: Nanos) -> Option<String>;
}

/// What a load cell has told and nobody has taken.
pub struct CellReports {
    samples: VecDeque<CellSample>,
    troubles: VecDeque<String>,
    newest: Nanos,
}

impl CellReports {
    /// One more value. Where there is no room left the oldest goes.
    pub fn push_sample(&mut self, sample: CellSample) {
        self.newest = sample.at;
        if self.samples.len() >= SAMPLES_MAX {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
    }

    pub fn push_trouble(&mut self, words: &str) {
        if self.troubles.len() < TROUBLES_MAX {
            self.troubles.push_back(words.to_owned());
        }
    }
}

pub struct LineCell<P> {
    protocol: P,
    lines: Lines,
    reports: CellReports,
    garbled: u64,
}

impl<P: CellProtocol> LineCell<P> {
    /// Goes on with a cell from `now`.
    #[must_use]
    pub fn start(protocol: P, now: Nanos) -> Self {
        Self {
            protocol,
            lines: Lines::default(),
            reports: CellReports {
                samples: VecDeque::new(),
                troubles: VecDeque::new(),
                newest: now,
            },
            garbled: 0,
        }
    }
}

impl<P: CellProtocol> CellDialogue for LineCell<P> {
    fn received(&mut self, now: Nanos, bytes: &[u8]) {
        for byte in bytes {
            let is_garbled = match self.lines.take(*byte) {
                None => false,
                Some(Taken::Garbled) => true,
                Some(Taken::Line(line)) => !self.protocol.take(now, &line, &mut self.reports),
            };
            self.garbled += u64::from(is_garbled);
        }
    }

    fn take_sample(&mut self) -> Option<CellSample> {
        self.reports.samples.pop_front()
    }

    fn take_trouble(&mut self) -> Option<String> {
        self.reports.troubles.pop_front()
    }

    fn garbled(&self) -> u64 {
        self.garbled
    }

    fn is_dead(&self, now: Nanos) -> Option<String> {
        self.protocol.is_dead(now, self.reports.newest)
    }
}
