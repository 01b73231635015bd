//! A load cell's dialogue on a line of its own: samples with their time on the host's clock.

use super::cell_clock::CellClock;
use super::track::Track;
use crate::cell::CellDialogue;
use crate::rig::RigEventBody;
use crate::wire::{Dialogue, LinkStats};
use palpate_model::Nanos;
use palpate_model::rig::{Age, AxisStatus, Fault, Reading, RigCommand};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Samples are told on this grid: a thousandth of a second, which both clocks are good for.
pub const TICK: Nanos = Nanos::from_millis(1);
/// So many samples may be missing before the cell counts as gone.
const SILENT_PERIODS: f64 = 5.0;
/// Computers and USB converters pause for so long now and then.
const SILENT_MIN: Nanos = Nanos::from_millis(250);
/// This thread looks every half a millisecond. When it did not for so long, it was not the cell that was silent.
const PAUSE: Nanos = Nanos::from_millis(20);

/// A load cell in progress.
pub struct CellLine {
    cell: Box<dyn CellDialogue>,
    track: Arc<Mutex<Track>>,
    clock: CellClock,
    start: Nanos,
    last_tick: Option<u64>,
    heard: Nanos,
    looked: Nanos,
    silence: Nanos,
    is_silent: bool,
    events: VecDeque<(Nanos, RigEventBody)>,
    stats: LinkStats,
}

impl CellLine {
    /// A cell of so many values a second. Ticks count from `start`.
    pub fn new(
        cell: Box<dyn CellDialogue>,
        rate: f64,
        track: Arc<Mutex<Track>>,
        start: Nanos,
    ) -> Self {
        let silence = Nanos((SILENT_PERIODS / rate.max(1e-3) * 1e9) as u64);
        Self {
            cell,
            track,
            clock: CellClock::default(),
            start,
            last_tick: None,
            heard: start,
            looked: start,
            silence: silence.max(SILENT_MIN),
            is_silent: false,
            events: VecDeque::new(),
            stats: LinkStats::default(),
        }
    }

    /// Whatever has gone wrong with the cell, the axis is not to press on blindly.
    fn stop_axis(&self) {
        let mut track = self.track.lock().unwrap_or_else(PoisonError::into_inner);
        track.is_stop_wanted = true;
    }

    fn fault(&mut self, now: Nanos, detail: String) {
        self.stop_axis();
        let fault = Fault::CommandRefused { detail };
        self.events.push_back((now, RigEventBody::Fault(fault)));
    }

    fn take_samples(&mut self, now: Nanos) {
        while let Some(sample) = self.cell.take_sample() {
            self.heard = now;
            self.is_silent = false;
            let taken = match sample.device_time {
                Some(device) => self.clock.map(device, sample.at),
                None => sample.at,
            };
            let tick = (taken.since(self.start).0 + TICK.0 / 2) / TICK.0;
            // Two in one thousandth of a second: the second is told for the next.
            let tick = self.last_tick.map_or(tick, |last| tick.max(last + 1));
            self.last_tick = Some(tick);
            let reading = Reading {
                tick,
                counts: Some(sample.counts),
                volts: sample.volts,
                pulses: 0,
                status: AxisStatus(0),
                age: sample.device_time.map(|_| Age {
                    by: now.since(taken),
                    within: self.clock.spread(),
                }),
            };
            self.events.push_back((now, RigEventBody::Reading(reading)));
        }
        if let Some(trouble) = self.cell.take_trouble() {
            self.fault(now, format!("load cell: {trouble}"));
        }
        self.stats.resynchronised = self.cell.garbled();
    }
}

impl Dialogue for CellLine {
    fn attended(&mut self, _at: Nanos) {}

    fn command(&mut self, _now: Nanos, _command: RigCommand) {}

    fn overtaken(&mut self, _now: Nanos, _command: RigCommand) {}

    fn received(&mut self, now: Nanos, bytes: &[u8]) {
        self.cell.received(now, bytes);
        self.take_samples(now);
    }

    fn take_line(&mut self, now: Nanos) -> Option<Vec<u8>> {
        let pause = now.since(std::mem::replace(&mut self.looked, now));
        if pause > PAUSE {
            self.heard = self.heard + pause;
        }
        if now.since(self.heard) > self.silence && !std::mem::replace(&mut self.is_silent, true) {
            let ms = self.silence.0 / 1_000_000;
            self.fault(
                now,
                format!("the load cell has sent nothing for {ms} ms; check its cable and power"),
            );
        }
        self.take_samples(now);
        self.cell.take_line(now)
    }

    fn next_at(&self, now: Nanos) -> Nanos {
        now + Nanos::from_millis(1)
    }

    fn take_event(&mut self) -> Option<(Nanos, RigEventBody)> {
        self.events.pop_front()
    }

    fn is_dead(&self, now: Nanos) -> Option<String> {
        let why = self.cell.is_dead(now)?;
        self.stop_axis();
        Some(format!("load cell: {why}"))
    }

    fn stats(&self) -> LinkStats {
        self.stats
    }
}

impl Drop for CellLine {
    /// However its thread ends, such as with a port that is gone.
    fn drop(&mut self) {
        self.stop_axis();
    }
}
