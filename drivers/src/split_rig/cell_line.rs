//! A load cell's dialogue on a link of its own: samples with their time on the host's clock.

use super::cell_clock::CellClock;
use super::track::AxisTrack;
use crate::cell::CellDialogue;
use crate::rig::RigEventBody;
use crate::wire::{Dialogue, LinkStats, Waiting, lock};
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Reading, RigCommand, SampleAge};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

/// Samples are reported on this grid: a thousandth of a second, which both clocks are good for.
pub const TICK: Nanos = Nanos::from_millis(1);
/// The cell counts as gone after so many missing samples.
const SILENT_PERIODS: f64 = 5.0;
/// Computers and USB converters pause for so long now and then.
const SILENT_MIN: Nanos = Nanos::from_millis(250);
/// This thread looks every half a millisecond. When it did not for so long, it was not the cell that was silent.
const PAUSE: Nanos = Nanos::from_millis(20);

pub struct CellLine {
    cell: Box<dyn CellDialogue>,
    track: Arc<Mutex<AxisTrack>>,
    clock: CellClock,
    start: Nanos,
    period: Nanos,
    /// Age of a sample when it is sent.
    delay: Nanos,
    last_tick: Option<u64>,
    for_sample: Waiting,
    looked_at: Nanos,
    silence: Nanos,
    is_silent: bool,
    events: VecDeque<(Nanos, RigEventBody)>,
    stats: LinkStats,
}

impl CellLine {
    /// A cell with so many values a second, each so old when it is sent. Ticks count from `start`.
    pub fn new(
        cell: Box<dyn CellDialogue>,
        (rate, delay): (f64, Nanos),
        track: Arc<Mutex<AxisTrack>>,
        start: Nanos,
    ) -> Self {
        let period = Nanos((1e9 / rate.max(1e-3)) as u64);
        let silence = Nanos((SILENT_PERIODS * period.0 as f64) as u64);
        Self {
            cell,
            track,
            clock: CellClock::default(),
            start,
            period,
            delay,
            last_tick: None,
            for_sample: Waiting::new(start),
            looked_at: start,
            silence: silence.max(SILENT_MIN),
            is_silent: false,
            events: VecDeque::new(),
            stats: LinkStats::default(),
        }
    }

    /// Any failure of the cell stops the axis: it must not press without a force.
    fn stop_axis(&self) {
        lock(&self.track).is_stop_wanted = true;
    }

    fn fault(&mut self, now: Nanos, detail: String) {
        self.stop_axis();
        self.events.push_back((now, RigEventBody::refusal(detail)));
    }

    /// The time at which a cell without a clock sent a sample that came with `newer` ones behind it: the newest just
    /// now, those before it a period apart, or closer where there is less time since the last one.
    fn sending_time(&self, at: Nanos, newer: u64) -> Nanos {
        let newest = self.last_tick.map_or(self.start, |tick| self.start + Nanos(tick * TICK.0));
        // The samples that are left share what is left of the time.
        let apart = self.period.min(Nanos(at.since(newest).0 / (newer + 1)));
        Nanos(at.0 - apart.0 * newer)
    }

    fn take_samples(&mut self, now: Nanos) {
        let burst: Vec<_> = std::iter::from_fn(|| self.cell.take_sample()).collect();
        for (place, sample) in burst.iter().enumerate() {
            self.for_sample = Waiting::new(now);
            self.is_silent = false;
            let newer = burst.len() - 1 - place;
            let (taken, within) = match sample.device_time {
                Some(device) => {
                    let taken = self.clock.map(device, sample.at);
                    (taken, self.clock.spread())
                }
                // It was taken at any time of its period, and reported on the grid.
                None => {
                    (self.sending_time(sample.at, newer as u64), Nanos(self.period.0 / 2 + TICK.0))
                }
            };
            let taken = Nanos(taken.0.saturating_sub(self.delay.0));
            let tick = (taken.since(self.start).0 + TICK.0 / 2) / TICK.0;
            // Two in one thousandth of a second: the second is reported for the next.
            let tick = self.last_tick.map_or(tick, |last| tick.max(last + 1));
            self.last_tick = Some(tick);
            let reading = Reading {
                tick,
                counts: Some(sample.counts),
                volts: sample.volts,
                pulses: 0,
                status: AxisStatus(0),
                age: Some(SampleAge { by: now.since(taken), within }),
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
    fn note_attendance(&mut self, _at: Nanos) {}

    fn command(&mut self, _now: Nanos, _command: RigCommand) {}

    fn handle_bytes(&mut self, now: Nanos, bytes: &[u8]) {
        self.cell.handle_bytes(now, bytes);
        self.take_samples(now);
    }

    fn take_line(&mut self, now: Nanos) -> Option<Vec<u8>> {
        let pause = now.since(std::mem::replace(&mut self.looked_at, now));
        if pause > PAUSE {
            self.for_sample.excuse(pause);
        }
        let is_silent = self.for_sample.time(now) > self.silence;
        if is_silent && !std::mem::replace(&mut self.is_silent, true) {
            let ms = self.silence.0 / 1_000_000;
            let words =
                format!("the load cell has sent nothing for {ms} ms; check its cable and power");
            self.fault(now, words);
        }
        self.take_samples(now);
        None
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
    /// Also when its thread ends by itself, such as when the port is gone.
    fn drop(&mut self) {
        self.stop_axis();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::CellSample;
    use palpate_model::units::Volts;

    #[derive(Default)]
    struct Bytes(VecDeque<CellSample>);

    impl CellDialogue for Bytes {
        fn handle_bytes(&mut self, now: Nanos, bytes: &[u8]) {
            self.0.extend(bytes.iter().map(|byte| CellSample {
                at: now,
                device_time: None,
                counts: i32::from(*byte),
                volts: Volts(0.0),
            }));
        }

        fn take_sample(&mut self) -> Option<CellSample> {
            self.0.pop_front()
        }

        fn take_trouble(&mut self) -> Option<String> {
            None
        }

        fn garbled(&self) -> u64 {
            0
        }

        fn is_dead(&self, _now: Nanos) -> Option<String> {
            None
        }
    }

    #[test]
    fn a_sample_is_as_old_as_the_filter_of_its_cell_makes_it() {
        let ms = Nanos::from_millis;
        let track = Arc::new(Mutex::new(AxisTrack::at_rest(0)));
        let mut line = CellLine::new(Box::<Bytes>::default(), (80.0, ms(25)), track, ms(1_000));
        line.handle_bytes(ms(1_100), &[0]);
        let Some((_, RigEventBody::Reading(reading))) = line.take_event() else {
            panic!("no reading");
        };
        assert_eq!(reading.tick, 75);
        assert_eq!(reading.age.map(|age| age.by), Some(ms(25)));
    }

    #[test]
    fn a_burst_is_laid_backwards_and_never_into_the_future() {
        let ms = Nanos::from_millis;
        let track = Arc::new(Mutex::new(AxisTrack::at_rest(0)));
        let mut line = CellLine::new(Box::<Bytes>::default(), (250.0, ms(0)), track, ms(1_000));
        let mut ticks = Vec::new();
        // One, four that a converter has held back, then two that come closer than the rate.
        for (at, bytes) in [(1_010, &[0][..]), (1_026, &[0, 0, 0, 0]), (1_028, &[0, 0])] {
            line.handle_bytes(ms(at), bytes);
            while let Some((now, RigEventBody::Reading(reading))) = line.take_event() {
                let age = reading.age.expect("it is known");
                assert_eq!(age.within, ms(3));
                assert_eq!(now.since(ms(1_000 + reading.tick)), age.by);
                ticks.push(reading.tick);
            }
        }
        assert_eq!(ticks, [10, 14, 18, 22, 26, 27, 28]);
    }
}
