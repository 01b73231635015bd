//! The queue of specimens: which are to be measured, by which protocol, in which order, and what became of each.
//!
//! Its only storage is the journal of its changes, each synchronised with the disk: it survives a crash, and every change
//! keeps its time, author and reason.

mod change;

pub use change::{
    QueueChange, QueueError, QueueRecord, QueueRefusal, QueueVerdict, QueuedSpecimen,
};

use crate::folder::{LOCK_FILE, create_folder};
use crate::journal::{JOURNAL_FILE, Journal, format_time};
use crate::lock::HolderLock;
use palpate_model::random::SplitMix;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Folder of the queue in the library.
pub const QUEUE_FOLDER: &str = "queue";

/// Version of the lines of its journal. A reader refuses a higher one.
pub const QUEUE_VERSION: u32 = 1;

/// Name of a queue that was begun by adding to none.
const USUAL_NAME: &str = "specimens";

palpate_model::named! {
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "lowercase")]
    pub enum SpecimenState {
        Waiting = "waiting",
        /// A run began and has no verdict: it goes on, ended, or a crash ended it.
        Begun = "without a verdict",
        Accepted = "accepted",
        Rejected = "rejected",
        Skipped = "skipped",
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QueueItem {
    /// From 1, in the order in which they were added.
    pub number: u32,
    #[serde(flatten)]
    pub wanted: QueuedSpecimen,
    pub state: SpecimenState,
    /// Of every run, also of rejected ones.
    pub sessions: Vec<PathBuf>,
    /// Runs that were rejected.
    pub rejected: u32,
    /// Of the last change that needed one.
    pub reason: String,
}

/// How many specimens are in which state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct QueueCounts {
    pub waiting: usize,
    pub without_verdict: usize,
    pub accepted: usize,
    pub rejected: usize,
    pub skipped: usize,
    /// Runs, and those among them that were rejected.
    pub runs: usize,
    pub rejected_runs: u32,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SpecimenQueue {
    /// Empty before the first specimen.
    pub name: String,
    pub is_blinded: bool,
    /// Of every shuffle, in order.
    pub seeds: Vec<u64>,
    /// The order in which they are measured.
    pub items: Vec<QueueItem>,
}

impl SpecimenQueue {
    /// Reads the queue of a library; an empty one where there is none.
    pub fn read(library: &Path) -> Result<Self, QueueError> {
        let folder = library.join(QUEUE_FOLDER);
        if !folder.join(JOURNAL_FILE).exists() {
            return Ok(Self::default());
        }
        let (_, records) = Journal::open::<QueueRecord>(&folder)?;
        Self::of(&records).map_err(|(line, refusal)| QueueError::Contradiction {
            line,
            refusal,
            path: folder,
        })
    }

    /// Changes the queue of a library and returns it as it is then. A refused change writes nothing.
    pub fn change(
        library: &Path,
        at: SystemTime,
        by: &str,
        reason: &str,
        change: QueueChange,
    ) -> Result<Self, QueueError> {
        let folder = library.join(QUEUE_FOLDER);
        create_folder(&folder).map_err(|source| QueueError::Io { path: folder.clone(), source })?;
        // Two programs must not decide on the same state.
        let _lock = HolderLock::acquire(&folder.join(LOCK_FILE))?;
        let mut queue = Self::read(library)?;
        let record = |reason: &str, change| QueueRecord {
            at: format_time(at),
            by: by.to_owned(),
            reason: reason.trim().to_owned(),
            change,
        };
        let mut records = Vec::new();
        if queue.name.is_empty() && !matches!(change, QueueChange::Started { .. }) {
            records.push(record("", start(USUAL_NAME, false)));
        }
        records.push(record(reason, change));
        for one in &records {
            queue.apply(one)?;
        }
        let (mut journal, _) = Journal::open::<QueueRecord>(&folder)?;
        for one in &records {
            journal.push(one)?;
        }
        Ok(queue)
    }

    /// The state after these changes, or the first line (from 1) that cannot be.
    pub fn of(records: &[QueueRecord]) -> Result<Self, (usize, QueueRefusal)> {
        let mut queue = Self::default();
        for (index, record) in records.iter().enumerate() {
            queue.apply(record).map_err(|refusal| (index + 1, refusal))?;
        }
        Ok(queue)
    }

    fn apply(&mut self, record: &QueueRecord) -> Result<(), QueueRefusal> {
        let change = &record.change;
        if change.needs_reason() && record.reason.trim().is_empty() {
            return Err(QueueRefusal::NoReason);
        }
        match change {
            QueueChange::Started { queue_version, name, is_blinded } => {
                self.start(*queue_version, name, *is_blinded)?;
            }
            QueueChange::Added { specimens } => self.add(specimens)?,
            QueueChange::Shuffled { seed, order } => self.reorder(*seed, order)?,
            QueueChange::Moved { number, place } => {
                self.require(*number, &[SpecimenState::Waiting], "moved")?;
                self.move_to(*number, *place)?;
            }
            QueueChange::Skipped { number } => {
                self.require(*number, &[SpecimenState::Waiting], "skipped")?;
                self.set(*number, SpecimenState::Skipped);
            }
            QueueChange::Restored { number } => {
                use SpecimenState::{Accepted, Rejected, Skipped};
                self.require(*number, &[Skipped, Accepted, Rejected], "restored")?;
                self.set(*number, SpecimenState::Waiting);
                let item = self.items.remove(self.index(*number)?);
                self.items.push(item);
            }
            QueueChange::Begun { number, session } => self.begin(*number, session)?,
            QueueChange::Judged { number, verdict } => self.judge(*number, *verdict)?,
        }
        // The reason of an earlier rejection is not one for accepting.
        let is_accepted =
            matches!(change, QueueChange::Judged { verdict: QueueVerdict::Accept, .. });
        if let (true, Some(number)) = (change.needs_reason() || is_accepted, number_of(change)) {
            let index = self.index(number)?;
            record.reason.clone_into(&mut self.items[index].reason);
        }
        Ok(())
    }

    fn start(&mut self, version: u32, name: &str, is_blinded: bool) -> Result<(), QueueRefusal> {
        if version > QUEUE_VERSION {
            return Err(QueueRefusal::Newer { version });
        }
        if let Some(open) = self.open_run() {
            return Err(QueueRefusal::Open(open.number));
        }
        if self.next().is_some() {
            return Err(QueueRefusal::Unfinished(self.name.clone()));
        }
        *self = Self { name: name.to_owned(), is_blinded, ..Self::default() };
        Ok(())
    }

    fn add(&mut self, specimens: &[QueuedSpecimen]) -> Result<(), QueueRefusal> {
        for (index, one) in specimens.iter().enumerate() {
            if one.specimen.trim().is_empty() {
                return Err(QueueRefusal::Nameless(index + 1));
            }
            if one.protocol.trim().is_empty() {
                return Err(QueueRefusal::NoProtocol(one.specimen.clone()));
            }
            if self.items.iter().any(|item| item.wanted.specimen == one.specimen) {
                return Err(QueueRefusal::Twice(one.specimen.clone()));
            }
            let number = self.items.len() as u32 + 1;
            self.items.push(QueueItem {
                number,
                wanted: one.clone(),
                state: SpecimenState::Waiting,
                sessions: Vec::new(),
                rejected: 0,
                reason: String::new(),
            });
        }
        Ok(())
    }

    fn reorder(&mut self, seed: u64, order: &[u32]) -> Result<(), QueueRefusal> {
        let mut wanted = order.to_vec();
        let mut present = self.waiting_numbers();
        wanted.sort_unstable();
        present.sort_unstable();
        if wanted != present {
            return Err(QueueRefusal::Order);
        }
        let mut ordered = Vec::with_capacity(order.len());
        for number in order {
            ordered.push(self.items[self.index(*number)?].clone());
        }
        let places = self.items.iter_mut();
        let places = places.filter(|item| item.state == SpecimenState::Waiting);
        for (place, item) in places.zip(ordered) {
            *place = item;
        }
        self.seeds.push(seed);
        Ok(())
    }

    fn move_to(&mut self, number: u32, place: u32) -> Result<(), QueueRefusal> {
        let mut order = self.waiting_numbers();
        if place == 0 || place as usize > order.len() {
            return Err(QueueRefusal::Place { place, waiting: order.len() });
        }
        order.retain(|one| *one != number);
        order.insert(place as usize - 1, number);
        let seeds = self.seeds.len();
        self.reorder(0, &order)?;
        self.seeds.truncate(seeds);
        Ok(())
    }

    fn begin(&mut self, number: u32, session: &Path) -> Result<(), QueueRefusal> {
        if let Some(open) = self.open_run() {
            return Err(QueueRefusal::Open(open.number));
        }
        self.require(number, &[SpecimenState::Waiting], "measured")?;
        self.set(number, SpecimenState::Begun);
        let index = self.index(number)?;
        self.items[index].sessions.push(session.to_owned());
        Ok(())
    }

    fn judge(&mut self, number: u32, verdict: QueueVerdict) -> Result<(), QueueRefusal> {
        self.require(number, &[SpecimenState::Begun], "judged")?;
        let index = self.index(number)?;
        self.items[index].rejected += u32::from(verdict != QueueVerdict::Accept);
        self.set(
            number,
            match verdict {
                QueueVerdict::Accept => SpecimenState::Accepted,
                QueueVerdict::Reject => SpecimenState::Rejected,
                QueueVerdict::Repeat => SpecimenState::Waiting,
            },
        );
        if verdict == QueueVerdict::Repeat {
            self.move_to(number, 1)?;
        }
        Ok(())
    }

    fn index(&self, number: u32) -> Result<usize, QueueRefusal> {
        let found = self.items.iter().position(|item| item.number == number);
        found.ok_or(QueueRefusal::Unknown(number))
    }

    fn set(&mut self, number: u32, state: SpecimenState) {
        if let Some(item) = self.items.iter_mut().find(|item| item.number == number) {
            item.state = state;
        }
    }

    fn require(
        &self,
        number: u32,
        states: &[SpecimenState],
        done: &'static str,
    ) -> Result<(), QueueRefusal> {
        let item = &self.items[self.index(number)?];
        if states.contains(&item.state) {
            return Ok(());
        }
        let needed = match states {
            [SpecimenState::Begun] => SpecimenState::Begun.name(),
            [SpecimenState::Waiting] => SpecimenState::Waiting.name(),
            _ => "skipped, accepted or rejected",
        };
        Err(QueueRefusal::State { number, state: item.state.name(), needed, done })
    }

    fn waiting_numbers(&self) -> Vec<u32> {
        let waiting = self.items.iter().filter(|item| item.state == SpecimenState::Waiting);
        waiting.map(|item| item.number).collect()
    }

    /// The specimen that is measured next.
    pub fn next(&self) -> Option<&QueueItem> {
        self.items.iter().find(|item| item.state == SpecimenState::Waiting)
    }

    /// The one whose run has no verdict.
    pub fn open_run(&self) -> Option<&QueueItem> {
        self.items.iter().find(|item| item.state == SpecimenState::Begun)
    }

    /// The one whose last run is this session.
    pub fn open_run_of(&self, library: &Path, session: &Path) -> Option<&QueueItem> {
        let item = self.open_run()?;
        let is_own = item.sessions.last().is_some_and(|last| library.join(last) == session);
        is_own.then_some(item)
    }

    /// The one with this name.
    pub fn find(&self, specimen: &str) -> Option<&QueueItem> {
        self.items.iter().find(|item| item.wanted.specimen == specimen.trim())
    }

    pub fn counts(&self) -> QueueCounts {
        let mut counts = QueueCounts::default();
        for item in &self.items {
            counts.runs += item.sessions.len();
            counts.rejected_runs += item.rejected;
            *match item.state {
                SpecimenState::Waiting => &mut counts.waiting,
                SpecimenState::Begun => &mut counts.without_verdict,
                SpecimenState::Accepted => &mut counts.accepted,
                SpecimenState::Rejected => &mut counts.rejected,
                SpecimenState::Skipped => &mut counts.skipped,
            } += 1;
        }
        counts
    }

    /// Puts those that wait in a random order: Fisher and Yates's shuffle with the SplitMix64 generator of the seed.
    pub fn shuffle(&self, seed: u64) -> QueueChange {
        let mut order = self.waiting_numbers();
        // From the order of adding, so that a seed gives one order whatever was moved before.
        order.sort_unstable();
        let mut random = SplitMix::seeded(seed);
        for last in (1..order.len()).rev() {
            order.swap(last, random.below(last + 1));
        }
        QueueChange::Shuffled { seed, order }
    }
}

/// A new queue of this name.
#[must_use]
pub fn start(name: &str, is_blinded: bool) -> QueueChange {
    QueueChange::Started { queue_version: QUEUE_VERSION, name: name.to_owned(), is_blinded }
}

fn number_of(change: &QueueChange) -> Option<u32> {
    match change {
        QueueChange::Moved { number, .. }
        | QueueChange::Skipped { number }
        | QueueChange::Restored { number }
        | QueueChange::Begun { number, .. }
        | QueueChange::Judged { number, .. } => Some(*number),
        QueueChange::Started { .. } | QueueChange::Added { .. } | QueueChange::Shuffled { .. } => {
            None
        }
    }
}

#[cfg(test)]
mod tests;
