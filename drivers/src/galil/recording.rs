//! Record arrays: the controller takes samples by itself, palpate fetches them (`RA`, `RD`, `RC`, `QU`).
//!
//! The controller writes one element of each array every 2^n samples, round and round. `_RD` is the element that comes
//! next and `TIME` the sample it is now, so that the sample of every element is known exactly: element k was taken at
//! `base + k * 2^n`. Every later pair of `_RD` and `TIME` is checked against that.
//!
//! DMC-1700/1800 user manual, page 159: of a recorded `_TS` only bits 0 to 4 are valid. Whether the motor is on, and
//! whether the axis moves when its stop code does not show it, is therefore taken from the question that comes with
//! every fetch.

use super::sampling::{self, parse_register, parse_whole, ts};
use super::settings::GalilSettings;
use crate::rig::RigEventBody;
use palpate_model::Nanos;
use std::collections::VecDeque;

/// Names of the arrays: signal, pulses, switches, stop code.
pub const ARRAYS: [&str; 4] = ["plpf", "plpd", "plps", "plpc"];
/// Elements that will be written over in this share of the ring's time are not fetched any more.
const MARGIN: i64 = 4;
/// Elements of one array fetched at once: a stop is answered behind them. Of a small ring fewer.
const CHUNK_MAX: i64 = 64;
const CHUNKS_OF_A_RING: i64 = 8;
/// Samples from a command to the question behind it in the same line, on slow boards.
const SETTING_MAX: i64 = 8;
/// Stop codes of an axis under way: independent, PVT, contour, ECAM, vector (DMC-40x0 command reference, `SC`).
const RUNNING: [u32; 5] = [0, 30, 50, 60, 100];

/// A recording that runs, as it was found when it was started.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordingPlan {
    /// Samples from one element to the next: 2^n.
    pub interval: i64,
    pub ring: i64,
    /// `TIME` of element 0, had it been there from the beginning.
    pub base: i64,
    pub first: i64,
    pub tick: Nanos,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordingStatus {
    pub poll: [f64; 6],
    /// `TIME`.
    pub time: i64,
    /// `_RD`.
    pub next: i64,
    commanded: f64,
    is_moving: bool,
    is_off: bool,
}

impl RecordingStatus {
    /// Reads the answer to [`question`].
    pub fn read(numbers: &[f64]) -> Option<Self> {
        let &[volts, pulses_given, commanded, switches, stop_code, next, time] = numbers else {
            return None;
        };
        let bits = parse_whole(switches)? as u32;
        Some(Self {
            poll: [volts, pulses_given, commanded, switches, stop_code, time],
            time: i64::try_from(parse_whole(time)?).ok()?,
            next: i64::try_from(parse_whole(next)?).ok()?,
            commanded,
            is_moving: bits & ts::MOVING != 0 || pulses_given != commanded,
            is_off: bits & ts::MOTOR_OFF != 0,
        })
    }
}

/// Output in the order of the controller's clock.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordingOutput {
    /// The numbers of a poll, and whether a motion was begun just before.
    Sample([f64; 6], bool),
    /// A report that belongs behind all samples before it.
    Event(RigEventBody),
}

/// A report or a sample out of line, which waits for the samples before it.
#[derive(Clone, Debug)]
struct HeldOutput {
    time: Option<i64>,
    out: RecordingOutput,
}

#[derive(Clone, Debug)]
struct Chunk {
    first: i64,
    count: i64,
    columns: Vec<Vec<f64>>,
}

#[derive(Clone, Debug)]
pub struct ArrayRecording {
    plan: RecordingPlan,
    /// The next element to be asked for, and the newest that there is.
    next: i64,
    newest: i64,
    status: Option<RecordingStatus>,
    status_asked_at: Nanos,
    earlier: Option<RecordingStatus>,
    chunk: Option<Chunk>,
    waiting: VecDeque<HeldOutput>,
    /// Pulses of the newest sample given out, and whether the axis moved.
    pulses_given: Option<f64>,
    is_moving: bool,
    newest_output: i64,
    /// Elements that were written over before they were fetched.
    pub samples_lost: u64,
}

/// The question while recording: that of polls, and the next element before the clock.
#[must_use]
pub fn question(settings: &GalilSettings) -> String {
    let (input, a) = (settings.input, settings.axis);
    format!("MG @AN[{input}]{{F2.4}},_TD{a},_RP{a},_TS{a},_SC{a},_RD,TIME")
}

impl ArrayRecording {
    #[must_use]
    pub fn new(plan: RecordingPlan) -> Self {
        Self {
            next: plan.first,
            newest: plan.first - 1,
            plan,
            status: None,
            status_asked_at: Nanos::ZERO,
            earlier: None,
            chunk: None,
            waiting: VecDeque::new(),
            pulses_given: None,
            is_moving: false,
            newest_output: i64::MIN,
            samples_lost: 0,
        }
    }

    fn time_of(&self, element: i64) -> i64 {
        self.plan.base + element * self.plan.interval
    }

    /// A report that belongs behind all samples that the controller has taken so far.
    pub fn hold(&mut self, event: RigEventBody) {
        self.waiting.push_back(HeldOutput { time: None, out: RecordingOutput::Event(event) });
    }

    /// Everything that waits, whatever samples are missing before it.
    pub fn drain(&mut self) -> Vec<RecordingOutput> {
        let waiting = std::mem::take(&mut self.waiting);
        waiting.into_iter().map(|waiting| waiting.out).collect()
    }

    /// Takes an answer; a `marked` one becomes a sample of its own, behind what waits. Returns whether it fits the
    /// recording.
    pub fn take_status(
        &mut self,
        status: RecordingStatus,
        asked_at: Nanos,
        marked: Option<bool>,
    ) -> bool {
        let expected = (status.time - self.plan.base).div_euclid(self.plan.interval);
        // The clock may have gone on by a sample between `_RD` and `TIME`.
        let behind = (expected - (status.next - 1)).rem_euclid(self.plan.ring);
        let is_late =
            behind == 1 && (status.time - self.plan.base).rem_euclid(self.plan.interval) == 0;
        if behind != 0 && !is_late {
            return false;
        }
        self.newest = expected - behind;
        self.status_asked_at = asked_at;
        let oldest = self.newest - self.plan.ring + self.plan.ring / MARGIN;
        if self.next < oldest {
            self.samples_lost += (oldest - self.next).unsigned_abs();
            self.next = oldest;
            self.chunk = None;
        }
        for waiting in self.waiting.iter_mut().filter(|one| one.time.is_none()) {
            waiting.time = Some(status.time);
        }
        if let Some(is_begun) = marked {
            self.waiting.push_back(HeldOutput {
                time: Some(status.time),
                out: RecordingOutput::Sample(status.poll, is_begun),
            });
        }
        self.earlier = self.status.replace(status);
        true
    }

    /// The commands that fetch the next elements, if there are any; nothing while others are on their way.
    pub fn fetch(&mut self) -> Option<Vec<String>> {
        if self.chunk.is_some() || self.next > self.newest {
            return None;
        }
        let first = self.next.rem_euclid(self.plan.ring);
        let count = (self.newest - self.next + 1)
            .min(CHUNK_MAX)
            .min(self.plan.ring / CHUNKS_OF_A_RING)
            .min(self.plan.ring - first);
        self.chunk = Some(Chunk { first: self.next, count, columns: Vec::new() });
        let last = first + count - 1;
        let fetch = |name| format!("QU {name}[],{first},{last},1");
        Some(ARRAYS.map(fetch).into())
    }

    pub fn is_fetching(&self) -> bool {
        self.chunk.is_some()
    }

    /// Forgets a fetch whose answers were lost; it will be done again.
    pub fn abandon_fetch(&mut self) {
        self.chunk = None;
    }

    /// Whether elements that came now may have been written over since it was known that they were there.
    fn is_stale(&self, first: i64, now: Nanos) -> bool {
        let since = now.since(self.status_asked_at).0 as f64;
        let written = since / (self.plan.interval as f64 * self.plan.tick.0 as f64);
        (self.newest - first) as f64 + written.ceil() + 1.0 >= self.plan.ring as f64
    }

    /// Takes one array's elements; `None` when they are not what was asked for. What is complete comes out.
    pub fn take(
        &mut self,
        now: Nanos,
        column: Vec<f64>,
        settings: &GalilSettings,
    ) -> Option<Vec<RecordingOutput>> {
        let chunk = self.chunk.as_mut()?;
        if i64::try_from(column.len()) != Ok(chunk.count) {
            return None;
        }
        chunk.columns.push(column);
        if chunk.columns.len() < ARRAYS.len() {
            return Some(Vec::new());
        }
        let chunk = self.chunk.take()?;
        if self.is_stale(chunk.first, now) {
            // The next status shows from where on they are whole, and counts the others as lost.
            self.newest = self.next - 1;
            return Some(Vec::new());
        }
        self.next = chunk.first + chunk.count;
        let mut out = Vec::new();
        for at in 0..chunk.count {
            let time = self.time_of(chunk.first + at);
            // `at` is below the length of every column.
            let row = |column: usize| chunk.columns[column][at as usize];
            self.release_due(time, &mut out);
            if time > self.newest_output && !self.belongs_after_waiting(time, row(1)) {
                let poll = self.sample(time, [row(0), row(1), row(2), row(3)], settings)?;
                self.newest_output = time;
                out.push(RecordingOutput::Sample(poll, false));
            }
        }
        out.extend(self.release_settled());
        Some(out)
    }

    /// Reports that wait for no more elements, when all elements were fetched.
    pub fn release_settled(&mut self) -> Vec<RecordingOutput> {
        let mut out = Vec::new();
        if self.next > self.newest
            && let Some(status) = self.status
        {
            self.release_due(status.time, &mut out);
        }
        out
    }

    /// Releases what waits for samples before `time`.
    fn release_due(&mut self, time: i64, out: &mut Vec<RecordingOutput>) {
        let is_due = |one: &mut HeldOutput| one.time.is_some_and(|at| at <= time);
        while let Some(waiting) = self.waiting.pop_front_if(is_due) {
            if let (RecordingOutput::Sample(poll, is_begun), Some(at)) =
                (&waiting.out, waiting.time)
            {
                if at <= self.newest_output {
                    continue;
                }
                self.newest_output = at;
                self.pulses_given = Some(poll[1]);
                let is_high =
                    parse_whole(poll[3]).is_some_and(|bits| bits as u32 & ts::MOVING != 0);
                self.is_moving = *is_begun || is_high || poll[1] != poll[2];
            }
            out.push(waiting.out);
        }
    }

    /// A counter that was set again while the axis rested shows it a little before the sample behind the command, and
    /// before its acknowledgement.
    fn belongs_after_waiting(&self, time: i64, pulses_given: f64) -> bool {
        let is_set_now = |one: &HeldOutput| {
            let RecordingOutput::Sample(poll, _) = &one.out else {
                return false;
            };
            one.time.is_some_and(|at| at - time <= SETTING_MAX) && poll[1] == pulses_given
        };
        !self.is_moving
            && self.pulses_given.is_some_and(|last| last != pulses_given)
            && self.waiting.iter().any(is_set_now)
    }

    fn sample(
        &mut self,
        time: i64,
        [signal, pulses_given, switches, stop_code]: [f64; 4],
        settings: &GalilSettings,
    ) -> Option<[f64; 6]> {
        let status = self.status?;
        let code = parse_whole(stop_code)? as u32;
        parse_register(pulses_given)?;
        let was_moving = self.is_moving;
        let is_near_motion = status.is_moving || self.earlier.is_some_and(|one| one.is_moving);
        let is_moving = (RUNNING.contains(&code) && is_near_motion)
            || (was_moving
                && (pulses_given != status.commanded
                    || (sampling::EARLY.contains(&code) && status.is_moving)))
            || self.pulses_given.is_some_and(|last| last != pulses_given);
        self.pulses_given = Some(pulses_given);
        self.is_moving = is_moving;
        let mut bits = parse_whole(switches)? as u32 & 0x1f;
        if is_moving {
            bits |= ts::MOVING;
        }
        if status.is_off {
            bits |= ts::MOTOR_OFF;
        }
        let volts = settings.range.volts_of_recorded(signal);
        Some([volts, pulses_given, pulses_given, f64::from(bits), stop_code, time as f64])
    }
}
