//! Sessions as the review screen shows them: read block by block on a thread of their own, shown as they come.

mod facts;
pub mod fit;
mod read;

pub use facts::{SessionEvent, SessionFacts, TimeOrigin};
pub use read::read;

use eframe::egui::Context;
use palpate_analysis::report::session::{SessionNameParts, session_name};
use palpate_model::rig::Phase;
use palpate_model::signal::track::{SignalTrack, TrackSegment};
use palpate_sessions::log::SessionSummary;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};

palpate_model::named! {
    /// A quantity of a session over time; its number is that of its column in a track.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
    pub enum Quantity {
        Force = "Force",
        /// Depth below contact.
        Depth = "Depth",
        /// The raw signal of the load cell.
        Volts = "Raw signal",
        /// Position from home.
        Position = "Position",
    }
}

impl Quantity {
    #[must_use]
    pub const fn axis(self) -> &'static str {
        match self {
            Self::Force => "force above tare (N)",
            Self::Depth => "depth from contact (mm)",
            Self::Volts => "raw signal (V)",
            Self::Position => "position from home (mm)",
        }
    }

    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Force => "N",
            Self::Depth | Self::Position => "mm",
            Self::Volts => "V",
        }
    }
}

/// Samples that have something in common, up to where the next ones begin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackStretch<T> {
    /// Number of the first sample.
    pub first: usize,
    /// Its time in s since the first sample of the session.
    pub t: f64,
    /// What they have in common.
    pub what: T,
}

/// A piece of a session, from the thread that reads it.
pub enum ReadUpdate {
    /// From the first and the last chunk.
    Head(Box<SessionSummary>),
    /// The next samples, and the phases and cycles that begin in them.
    Samples {
        segment: Arc<TrackSegment>,
        phases: Vec<TrackStretch<Phase>>,
        /// 0 for none.
        cycles: Vec<TrackStretch<u32>>,
    },
    /// The session is read to its end.
    Whole(Box<SessionFacts>),
    Failed(String),
}

/// How far a session is read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Stage {
    #[default]
    Waiting,
    Reading,
    Whole,
    Cancelled,
    Failed(String),
}

/// A session as far as it has been read.
#[derive(Default)]
pub struct ReviewRecording {
    pub path: PathBuf,
    /// The analysis by which it is read.
    pub analysis: Option<String>,
    pub track: SignalTrack,
    pub phases: Vec<TrackStretch<Phase>>,
    pub cycles: Vec<TrackStretch<u32>>,
    pub head: Option<Box<SessionSummary>>,
    /// Once it is read to its end.
    pub facts: Option<Box<SessionFacts>>,
    pub stage: Stage,
    /// Raised with every update.
    pub version: u64,
    updates: Option<Receiver<ReadUpdate>>,
}

/// Updates that may wait for the window; with more the reader waits.
const QUEUE: usize = 64;

impl ReviewRecording {
    #[must_use]
    pub fn new(path: &Path, analysis: Option<&str>) -> Self {
        Self { path: path.to_owned(), analysis: analysis.map(str::to_owned), ..Self::default() }
    }

    pub fn start(&mut self, ctx: &Context) {
        let (sender, receiver) = sync_channel(QUEUE);
        let (path, analysis, wake) = (self.path.clone(), self.analysis.clone(), ctx.clone());
        let work = move || {
            let send = |update| {
                let is_received = sender.send(update).is_ok();
                wake.request_repaint();
                is_received
            };
            if let Err(reason) = read(&path, analysis.as_deref(), &send) {
                let _ = send(ReadUpdate::Failed(reason));
            }
        };
        let started = std::thread::Builder::new().name("review-read".into()).spawn(work);
        match started {
            Ok(_) => {
                self.updates = Some(receiver);
                self.stage = Stage::Reading;
            }
            Err(err) => {
                self.stage = Stage::Failed(format!(
                    "the thread that reads the session cannot be started: {err}"
                ))
            }
        }
    }

    pub fn poll(&mut self) {
        let Some(updates) = &self.updates else { return };
        loop {
            let update = match updates.try_recv() {
                Ok(update) => update,
                Err(TryRecvError::Empty) => return,
                Err(TryRecvError::Disconnected) => {
                    if self.stage == Stage::Reading {
                        let gone = "the session was not read to its end; show it again, and report this if it happens twice";
                        self.stage = Stage::Failed(gone.into());
                    }
                    self.updates = None;
                    return;
                }
            };
            self.version += 1;
            match update {
                ReadUpdate::Head(head) => self.head = Some(head),
                ReadUpdate::Samples { segment, phases, cycles } => {
                    self.track.push(segment);
                    self.phases.extend(phases);
                    self.cycles.extend(cycles);
                }
                ReadUpdate::Whole(facts) => {
                    self.facts = Some(facts);
                    self.stage = Stage::Whole;
                }
                ReadUpdate::Failed(reason) => self.stage = Stage::Failed(reason),
            }
        }
    }

    /// Ends the reading; what has come stays.
    pub fn cancel(&mut self) {
        if matches!(self.stage, Stage::Reading | Stage::Waiting) {
            self.updates = None;
            self.stage = Stage::Cancelled;
        }
    }

    pub fn is_reading(&self) -> bool {
        self.stage == Stage::Reading
    }

    /// Share of the samples that is there, 0 to 1.
    pub fn share(&self) -> f64 {
        let all = self.head.as_ref().map_or(0, |head| head.samples);
        match (&self.stage, all) {
            (Stage::Whole, _) => 1.0,
            (_, 0) => 0.0,
            (_, all) => (self.track.len() as f64 / all as f64).min(1.0),
        }
    }

    /// From the first sample to the last, though not all may be there yet, in s.
    pub fn span(&self) -> [f64; 2] {
        let own = self.track.span().unwrap_or([0.0, 0.0]);
        let expected = match (&self.stage, &self.head) {
            (Stage::Reading, Some(head)) => head.last.seconds().0,
            _ => 0.0,
        };
        [own[0], own[1].max(expected)]
    }

    /// Specimen, protocol and time, or the name of its folder until that is read.
    pub fn name(&self) -> String {
        let own = self.head.as_ref().map(|head| session_name(&head.manifest));
        own.unwrap_or_else(|| {
            let name = self.path.file_name().unwrap_or(self.path.as_os_str());
            name.to_string_lossy().into_owned()
        })
    }

    /// The parts of that name, once they are read.
    pub fn name_parts(&self) -> Option<SessionNameParts> {
        self.head.as_ref().map(|head| SessionNameParts::of(&head.manifest))
    }

    /// Time of the first sample of a phase; `None` without one.
    pub fn phase_start(&self, phase: Phase) -> Option<f64> {
        let found = self.phases.iter().find(|one| one.what == phase);
        found.map(|one| one.t)
    }

    /// Start, end and value of each stretch; the last one ends at `end`.
    pub fn ended<T: Copy>(
        stretches: &[TrackStretch<T>],
        end: f64,
    ) -> impl Iterator<Item = (f64, f64, T)> {
        let ends = stretches.iter().skip(1).map(|next| next.t).chain([end]);
        stretches.iter().zip(ends).map(|(one, end)| (one.t, end, one.what))
    }
}
