//! The dialogue with a sidecar that only measures, beside any rig.

use super::FLOODED;
use super::budget::{FaultLimit, LinkBudget};
use super::connect::ConnectedSidecar;
use super::protocol::{HostMessage, ReceivedItem, SidecarMessage, SidecarParser, SidecarSample};
use super::sensors::SensorReports;
use crate::board_clock::{BoardClock, BoardTime};
use crate::rig::RigEventBody;
use crate::split_rig::CellClock;
use crate::wire::{Dialogue, LinkStats, Waiting};
use palpate_model::Nanos;
use palpate_model::rig::RigCommand;
use std::collections::VecDeque;

const BEAT_EVERY: Nanos = Nanos::from_millis(200);
const DEAD: Nanos = Nanos::from_millis(1_000);
/// Sensors may be slow: the link is dead when so many samples have not come.
const DEAD_PERIODS: u64 = 5;
const GARBLED_MAX: u32 = 50;

pub struct SensorLine {
    has_checksum: bool,
    parser: SidecarParser,
    number: u64,
    beat: Option<(u64, Nanos)>,
    beat_at: Option<Nanos>,
    is_started: bool,
    board_clock: BoardClock,
    host_clock: CellClock,
    reports: SensorReports,
    silence_max: Nanos,
    for_sample: Waiting,
    looked_at: Nanos,
    garbled_in_row: u32,
    budget: LinkBudget,
    fault_limit: FaultLimit,
    /// Why it can no longer be trusted.
    ending: Option<String>,
    events: VecDeque<(Nanos, RigEventBody)>,
    stats: LinkStats,
}

impl SensorLine {
    #[must_use]
    pub fn new(connected: &ConnectedSidecar, reports: SensorReports, now: Nanos) -> Self {
        let about = &connected.description;
        Self {
            has_checksum: about.crc,
            parser: SidecarParser::new(about.crc, false),
            number: connected.number,
            beat: None,
            beat_at: None,
            is_started: false,
            board_clock: BoardClock::new(about.tick_ns),
            host_clock: CellClock::default(),
            reports,
            silence_max: DEAD.max(Nanos(DEAD_PERIODS * about.period().0)),
            for_sample: Waiting::new(now),
            looked_at: now,
            garbled_in_row: 0,
            budget: LinkBudget::new(about.rate, now),
            fault_limit: FaultLimit::default(),
            ending: None,
            events: VecDeque::new(),
            stats: connected.stats,
        }
    }

    fn on_item(&mut self, now: Nanos, item: ReceivedItem) {
        let ReceivedItem::Message(message) = item else {
            return self.on_garbled();
        };
        match message {
            SidecarMessage::Sample(sample) => self.on_sample(now, &sample),
            SidecarMessage::Ok { number, .. } => {
                if let Some((_, sent)) = self.beat.take_if(|(sent, _)| *sent == number) {
                    self.garbled_in_row = 0;
                    self.stats.push(now.since(sent));
                }
            }
            SidecarMessage::No { number: None, .. } => self.stats.resynchronised += 1,
            SidecarMessage::No { why, .. } => {
                self.end(format!("the sidecar refuses to go on: {why}"));
            }
            SidecarMessage::Fault(why) => {
                if self.fault_limit.allows(now) {
                    let why = format!("the sidecar reports: {why}");
                    self.events.push_back((now, RigEventBody::refusal(why)));
                }
            }
            SidecarMessage::Boot(_) | SidecarMessage::Description(_) => {
                self.end("the sidecar has restarted".into());
            }
        }
    }

    fn on_garbled(&mut self) {
        self.stats.resynchronised += 1;
        self.garbled_in_row += 1;
        if self.garbled_in_row >= GARBLED_MAX {
            self.end("the sidecar sends nothing that means anything".into());
        }
    }

    fn end(&mut self, why: String) {
        self.ending.get_or_insert(why);
    }

    fn on_sample(&mut self, now: Nanos, sample: &SidecarSample) {
        let time = match self.board_clock.take(now, sample.ticks) {
            BoardTime::Repeated => return self.on_garbled(),
            BoardTime::At(time) => time,
            BoardTime::Restarted(_) => return self.end("the sidecar's clock ran back".into()),
        };
        self.garbled_in_row = 0;
        self.for_sample = Waiting::new(now);
        let mapped = self.host_clock.map(time, now);
        let half = Nanos(self.stats.round_trip_min.0 / 2);
        self.reports.take(now, now.since(mapped) + half, &sample.values);
    }

    fn write(&mut self, message: HostMessage) -> Vec<u8> {
        self.number += 1;
        self.budget.note_written();
        message.line(self.number, self.has_checksum)
    }
}

impl Dialogue for SensorLine {
    fn note_attendance(&mut self, _at: Nanos) {}

    fn command(&mut self, _now: Nanos, _command: RigCommand) {}

    fn handle_bytes(&mut self, now: Nanos, bytes: &[u8]) {
        self.budget.take_bytes(now, bytes.len());
        for byte in bytes {
            if self.ending.is_some() {
                return;
            }
            if let Some(item) = self.parser.take(*byte) {
                self.budget.take_item(now);
                self.on_item(now, item);
            }
            if self.budget.is_exceeded() {
                self.end(format!("{FLOODED}; correct its program"));
            }
        }
    }

    fn take_line(&mut self, now: Nanos) -> Option<Vec<u8>> {
        // What this computer did not look at was not silence of the sidecar.
        let pause = now.since(std::mem::replace(&mut self.looked_at, now));
        if pause > Nanos::from_millis(20) {
            self.for_sample.excuse(pause);
        }
        if !std::mem::replace(&mut self.is_started, true) {
            return Some(self.write(HostMessage::Start { is_binary: false }));
        }
        if self.beat_at.is_some_and(|at| now.since(at) < BEAT_EVERY) {
            return None;
        }
        self.beat_at = Some(now);
        let line = self.write(HostMessage::Beat);
        self.beat = Some((self.number, now));
        Some(line)
    }

    fn next_at(&self, now: Nanos) -> Nanos {
        now + Nanos::from_millis(1)
    }

    fn take_event(&mut self) -> Option<(Nanos, RigEventBody)> {
        self.events.pop_front()
    }

    fn is_dead(&self, now: Nanos) -> Option<String> {
        let is_silent = self.for_sample.time(now) > self.silence_max;
        let silent = || "the sidecar sends no samples; check its program and cable".to_owned();
        self.ending.clone().or_else(|| is_silent.then(silent))
    }

    fn stats(&self) -> LinkStats {
        self.stats
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sidecar::sensors::SharedValues;
    use std::sync::Arc;

    fn line(rate: u32, values: &SharedValues) -> SensorLine {
        let text = format!(
            r#"{{"ok":1,"sidecar":1,"name":"a","boot":1,"tick_ns":1000,"rate":{rate},"sensors":[{{"name":"one","unit":"1"}}]}}"#
        );
        let description = serde_json::from_str(&text).unwrap();
        let reports = SensorReports::new(&description, (0, 0), Arc::clone(values));
        let stats = LinkStats::default();
        let connected = ConnectedSidecar { description, stats, number: 1, raw: Vec::new() };
        SensorLine::new(&connected, reports, Nanos::ZERO)
    }

    /// Lines of a millisecond each turn, for so long; when the link has ended, and how many events there were.
    fn turns(rate: u32, most: u64, lines: impl Fn(u64) -> String) -> (Option<u64>, usize) {
        let values = SharedValues::default();
        let mut line = line(rate, &values);
        let mut events = 0;
        let ended = (1..=most).find(|ms| {
            let now = Nanos::from_millis(*ms);
            while line.take_line(now).is_some() {}
            line.handle_bytes(now, lines(*ms).as_bytes());
            events += std::iter::from_fn(|| line.take_event()).count();
            line.is_dead(now).is_some()
        });
        (ended, events)
    }

    #[test]
    fn as_many_samples_as_promised_are_taken_and_a_flood_ends_the_link() {
        let sample = |micros: u64| format!("{{\"t\":{micros},\"v\":[1]}}\n");
        let (ended, _) = turns(1_000, 5_000, |ms| sample(ms * 1_000));
        assert_eq!(ended, None);
        // Ten are promised, and 10 000 a second come.
        let many = |ms: u64| (0..10).map(|i| sample(ms * 1_000 + i * 100)).collect();
        let (ended, _) = turns(10, 2_000, many);
        assert!(ended.is_some_and(|ms| ms < 100), "{ended:?}");
    }

    #[test]
    fn a_flood_of_faults_or_answers_ends_the_link_and_fills_nothing() {
        for word in ["{\"ok\":0}\n", "{\"fault\":\"hot\"}\n", "{\"no\":null,\"why\":\"\"}\n"] {
            let lines = |ms: u64| format!("{{\"t\":{}}}\n{}", ms * 1_000, word.repeat(20));
            let (ended, events) = turns(1_000, 2_000, lines);
            assert!(ended.is_some() && events <= 20, "{word}: {ended:?} {events}");
        }
    }
}
