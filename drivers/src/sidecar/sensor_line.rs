//! The dialogue with a sidecar that only measures, beside any rig.

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
                let why = format!("the sidecar reports: {why}");
                self.events.push_back((now, RigEventBody::refusal(why)));
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
        message.line(self.number, self.has_checksum)
    }
}

impl Dialogue for SensorLine {
    fn note_attendance(&mut self, _at: Nanos) {}

    fn command(&mut self, _now: Nanos, _command: RigCommand) {}

    fn handle_bytes(&mut self, now: Nanos, bytes: &[u8]) {
        for byte in bytes {
            if let Some(item) = self.parser.take(*byte) {
                self.on_item(now, item);
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
