//! A link to a sidecar during the suite: lines, answers with their latency, samples with their arrival.

use super::ConformError;
use crate::board_clock::{BoardClock, BoardTime};
use crate::sidecar::connect::DEVICE;
use crate::sidecar::description::SidecarDescription;
use crate::sidecar::protocol::{
    HostMessage, ReceivedItem, SidecarMessage, SidecarParser, SidecarSample, finish_line,
};
use crate::text::DeviceError;
use crate::wire::{HostClock, Link};
use palpate_model::Nanos;
use palpate_model::rig::AxisStatus;
use std::io;
use std::time::Duration;

const READ_MAX: Duration = Duration::from_micros(500);
const ANSWER_MAX: Nanos = Nanos::from_millis(1_000);
const START_MAX: Nanos = Nanos::from_millis(10_000);
/// The slowest sensors send a value in ten seconds.
const SAMPLE_MAX: Nanos = Nanos::from_millis(25_000);
const ASK_EVERY: Nanos = Nanos::from_millis(300);

/// An answer, with the time that it took.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    pub is_ok: bool,
    pub why: String,
    pub latency: Nanos,
}

#[derive(Clone, Debug)]
pub struct TimedSample {
    /// Arrival.
    pub at: Nanos,
    /// The device's clock without wraps.
    pub time: Nanos,
    pub sample: SidecarSample,
}

impl TimedSample {
    pub fn pulses(&self) -> i64 {
        self.sample.pulses.unwrap_or(0)
    }

    pub fn is_moving(&self) -> bool {
        AxisStatus(self.sample.status).has(AxisStatus::MOVING)
    }

    pub fn is_stopping(&self) -> bool {
        AxisStatus(self.sample.status).has(AxisStatus::STOPPING)
    }
}

pub struct Talk {
    link: Box<dyn Link>,
    clock: HostClock,
    parser: SidecarParser,
    has_checksum: bool,
    has_frames: bool,
    number: u64,
    board_clock: BoardClock,
    /// `None` while the suite is silent on purpose.
    beat_every: Option<Nanos>,
    beat_at: Nanos,
    /// The number of a beat that was written by itself.
    own_beats: Vec<u64>,
    answers: Vec<(u64, Answer)>,
    sent: Vec<(u64, Nanos)>,
    pub samples: Vec<TimedSample>,
    pub garbled: u64,
    pub refused_lines: u64,
    /// Samples whose clock did not go forward.
    pub backward: u64,
    pub faults: Vec<String>,
    description: Option<SidecarDescription>,
    /// The name of the check that goes on, for errors.
    pub check: &'static str,
}

impl Talk {
    pub fn begin(link: Box<dyn Link>, clock: &HostClock) -> Self {
        Self {
            link,
            clock: HostClock::clone(clock),
            parser: SidecarParser::default(),
            has_checksum: false,
            has_frames: false,
            number: 0,
            board_clock: BoardClock::new(1),
            beat_every: None,
            beat_at: Nanos::ZERO,
            own_beats: Vec::new(),
            answers: Vec::new(),
            sent: Vec::new(),
            samples: Vec::new(),
            garbled: 0,
            refused_lines: 0,
            backward: 0,
            faults: Vec::new(),
            description: None,
            check: "introduction",
        }
    }

    pub fn now(&self) -> Nanos {
        (self.clock)()
    }

    fn lost(&self, err: &io::Error) -> ConformError {
        ConformError::Lost { check: self.check, detail: err.to_string() }
    }

    /// Asks the sidecar who it is.
    pub fn introduce(&mut self) -> Result<SidecarDescription, ConformError> {
        let start = self.now();
        self.write_raw(b"\n")?;
        let about = loop {
            if let Some(about) = self.description.take() {
                break about;
            }
            if self.now().since(start) > START_MAX {
                let hint = "it does not answer hello; check that it runs, and its port";
                return Err(DeviceError::Silent { device: DEVICE, hint }.into());
            }
            self.write(HostMessage::Hello)?;
            let until = self.now() + ASK_EVERY;
            while self.description.is_none() && self.now() < until {
                self.turn()?;
            }
        };
        about.check().map_err(|detail| DeviceError::unfit(DEVICE, detail))?;
        self.parser = SidecarParser::new(about.crc, about.binary);
        self.has_checksum = about.crc;
        self.has_frames = about.binary;
        self.board_clock = BoardClock::new(about.tick_ns);
        self.beat_every = Some(Nanos(about.silence().0 / 4));
        Ok(about)
    }

    /// Writes a message; gives its number.
    pub fn write(&mut self, message: HostMessage) -> Result<u64, ConformError> {
        self.number += 1;
        let line = message.line(self.number, self.has_checksum);
        self.sent.push((self.number, self.now()));
        self.write_raw(&line)?;
        Ok(self.number)
    }

    pub fn write_raw(&mut self, bytes: &[u8]) -> Result<(), ConformError> {
        let result = self.link.write(bytes);
        result.map_err(|err| self.lost(&err))
    }

    /// Writes a message and waits for its answer; `None` when none comes within a second.
    pub fn ask(&mut self, message: HostMessage) -> Result<Option<Answer>, ConformError> {
        let number = self.write(message)?;
        self.answer(number)
    }

    /// Asks for a word that no sidecar knows.
    pub fn ask_raw(&mut self, word: &str) -> Result<Option<Answer>, ConformError> {
        self.number += 1;
        let text = format!(r#"{{"n":{},"do":{word}}}"#, self.number);
        self.sent.push((self.number, self.now()));
        self.write_raw(&finish_line(&text, self.has_checksum))?;
        self.answer(self.number)
    }

    /// Lets the sidecar send samples; whether one comes.
    pub fn start_samples(&mut self) -> Result<bool, ConformError> {
        let is_binary = self.has_frames;
        let is_ok = self.ask(HostMessage::Start { is_binary })?.is_some_and(|answer| answer.is_ok);
        Ok(is_ok && self.until(SAMPLE_MAX, |_| true)?)
    }

    fn answer(&mut self, number: u64) -> Result<Option<Answer>, ConformError> {
        let until = self.now() + ANSWER_MAX;
        loop {
            if let Some(index) = self.answers.iter().position(|(of, _)| *of == number) {
                return Ok(Some(self.answers.remove(index).1));
            }
            if self.now() >= until {
                return Ok(None);
            }
            self.turn()?;
        }
    }

    /// Lets time pass.
    pub fn pass(&mut self, time: Nanos) -> Result<(), ConformError> {
        let until = self.now() + time;
        while self.now() < until {
            self.turn()?;
        }
        Ok(())
    }

    /// Waits until the newest sample is as wanted; whether one is, in time.
    pub fn until(
        &mut self,
        within: Nanos,
        is_so: impl Fn(&TimedSample) -> bool,
    ) -> Result<bool, ConformError> {
        let until = self.now() + within;
        let from = self.samples.len();
        while self.now() < until {
            if self.samples[from.min(self.samples.len())..].iter().any(&is_so) {
                return Ok(true);
            }
            self.turn()?;
        }
        Ok(false)
    }

    /// No beats from now on, or again.
    pub fn set_silent(&mut self, is_silent: bool, about_silence: Nanos) {
        self.beat_every = (!is_silent).then_some(Nanos(about_silence.0 / 4));
    }

    /// Ends the input of the sidecar; whether the link can do that.
    pub fn close_input(&mut self) -> bool {
        self.beat_every = None;
        self.link.close_input().is_ok()
    }

    /// One wait for bytes; a beat where one is due.
    pub fn turn(&mut self) -> Result<(), ConformError> {
        let now = self.now();
        if self.beat_every.is_some_and(|every| now.since(self.beat_at) >= every) {
            self.beat_at = now;
            let number = self.write(HostMessage::Beat)?;
            self.own_beats.push(number);
        }
        let mut buffer = [0_u8; 4096];
        let count = self.link.read(&mut buffer, READ_MAX).map_err(|err| self.lost(&err))?;
        let now = self.now();
        for byte in &buffer[..count] {
            let mut item = self.parser.take(*byte);
            while let Some(received) = item {
                self.on_item(now, received);
                item = self.parser.next_ready();
            }
        }
        Ok(())
    }

    fn on_item(&mut self, now: Nanos, item: ReceivedItem) {
        match item {
            ReceivedItem::Garbled => self.garbled += 1,
            ReceivedItem::Message(SidecarMessage::Ok { number, .. }) => {
                self.note_answer(now, number, true, String::new());
            }
            ReceivedItem::Message(SidecarMessage::No { number: Some(number), why }) => {
                self.note_answer(now, number, false, why);
            }
            ReceivedItem::Message(SidecarMessage::No { number: None, .. }) => {
                self.refused_lines += 1
            }
            ReceivedItem::Message(SidecarMessage::Description(about)) => {
                self.description = Some(*about);
            }
            ReceivedItem::Message(SidecarMessage::Sample(sample))
                if !sample.has_possible_pulses() =>
            {
                self.garbled += 1;
            }
            ReceivedItem::Message(SidecarMessage::Sample(sample)) => {
                match self.board_clock.take(now, sample.ticks) {
                    BoardTime::At(time) => self.samples.push(TimedSample { at: now, time, sample }),
                    BoardTime::Repeated | BoardTime::Restarted(_) => self.backward += 1,
                }
            }
            ReceivedItem::Message(SidecarMessage::Fault(why)) => self.faults.push(why),
            ReceivedItem::Message(SidecarMessage::Boot(_)) => {}
        }
    }

    fn note_answer(&mut self, now: Nanos, number: u64, is_ok: bool, why: String) {
        let Some(index) = self.sent.iter().position(|(sent, _)| *sent == number) else {
            return;
        };
        let (_, sent) = self.sent.remove(index);
        if let Some(index) = self.own_beats.iter().position(|own| *own == number) {
            self.own_beats.remove(index);
            return;
        }
        let latency = now.since(sent);
        self.answers.push((number, Answer { is_ok, why, latency }));
    }
}
