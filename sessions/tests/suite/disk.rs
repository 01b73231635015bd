//! A disk that remembers every operation, so that the power can be cut after any of them.

use crate::support::Random;
use palpate_sessions::{SegmentSource, Sink, segment_file};
use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard};

/// One thing that was done, in order.
#[derive(Clone, Debug)]
pub enum Step {
    /// A file got its name, which a power cut may take back until the folder is synchronised.
    Create(u32),
    /// Bytes at the end of a file.
    Write(u32, Vec<u8>),
    /// The content of a file is on the disk.
    Sync(u32),
    /// All names are on the disk.
    SyncFolder,
    /// The caller knows that so many samples survive a power cut.
    Reported(usize),
}

/// A step and how many samples had been taken when it was done.
#[derive(Clone, Debug)]
pub struct Traced {
    pub step: Step,
    pub taken: usize,
}

/// A disk with a chosen set of failing operations.
#[derive(Clone, Default)]
pub struct Disk(Arc<Mutex<State>>);

#[derive(Default)]
struct State {
    trace: Vec<Traced>,
    taken: usize,
    operations: u32,
    fail_at: Vec<u32>,
}

impl Disk {
    pub fn new(fail_at: &[u32]) -> Self {
        let disk = Self::default();
        disk.state().fail_at = fail_at.into();
        disk
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().expect("no test thread panics in here")
    }

    /// So many samples were taken by now.
    pub fn set_taken(&self, taken: usize) {
        self.state().taken = taken;
    }

    pub fn tell(&self, samples: usize) {
        self.note(Step::Reported(samples));
    }

    pub fn trace(&self) -> Vec<Traced> {
        self.state().trace.clone()
    }

    fn note(&self, step: Step) {
        let mut state = self.state();
        let taken = state.taken;
        state.trace.push(Traced { step, taken });
    }

    fn count(&self) -> io::Result<()> {
        let mut state = self.state();
        let operation = state.operations;
        state.operations += 1;
        // 5 is EIO.
        match state.fail_at.contains(&operation) {
            true => Err(io::Error::from_raw_os_error(5)),
            false => Ok(()),
        }
    }
}

pub struct DiskSink {
    disk: Disk,
    number: u32,
    /// As a [`palpate_sessions::FileSink`] does: the folder once, after the file's first content.
    has_name: bool,
}

impl Sink for DiskSink {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        let outcome = self.disk.count();
        // A failing write leaves a part of what it was given.
        let length = bytes.len() / if outcome.is_ok() { 1 } else { 3 };
        let bytes = bytes[..length].to_vec();
        self.disk.note(Step::Write(self.number, bytes));
        outcome
    }

    fn sync(&mut self) -> io::Result<()> {
        self.disk.count()?;
        self.disk.note(Step::Sync(self.number));
        if !std::mem::replace(&mut self.has_name, true) {
            self.disk.note(Step::SyncFolder);
        }
        Ok(())
    }
}

impl SegmentSource for Disk {
    type Sink = DiskSink;

    fn path(&self, number: u32) -> String {
        segment_file(number)
    }

    fn create(&mut self, number: u32) -> io::Result<DiskSink> {
        self.count()?;
        self.note(Step::Create(number));
        Ok(DiskSink { disk: self.clone(), number, has_name: false })
    }
}

/// What a power cut does to bytes that were written and not synchronised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// None survives, nor does a name.
    Dropped,
    /// All survive.
    Kept,
    /// Any of the writes survive; zeros stand where one before a survivor did not.
    Reordered,
    /// The file has its length, and zeros for the writes that do not survive.
    Zeroed,
    /// Any sectors of so many bytes survive, zeros stand for the others.
    Torn(usize),
    /// As torn, but what the disk held before stands for the others.
    Stale(usize),
}

pub const FATES: [Fate; 8] = [
    Fate::Dropped,
    Fate::Kept,
    Fate::Reordered,
    Fate::Zeroed,
    Fate::Torn(512),
    Fate::Torn(4096),
    Fate::Stale(512),
    Fate::Stale(4096),
];

#[derive(Default)]
struct File {
    bytes: Vec<u8>,
    /// How much of it is on the disk for certain.
    synced: usize,
    /// Where each write since then begins.
    unsynced: Vec<usize>,
    has_name: bool,
}

impl File {
    fn after_cut(mut self, fate: Fate, random: &mut Random) -> Option<Vec<u8>> {
        let survives = |random: &mut Random| random.below(2) == 0;
        if !self.has_name && (fate == Fate::Dropped || survives(random)) {
            return None;
        }
        let full = self.bytes.len();
        let mut stops = self.unsynced.clone();
        stops.push(full);
        let mut parts: Vec<(usize, usize)> = stops.windows(2).map(|two| (two[0], two[1])).collect();
        if let Fate::Torn(sector) | Fate::Stale(sector) = fate {
            parts.clear();
            let mut from = self.synced;
            while from < full {
                let to = ((from / sector + 1) * sector).min(full);
                parts.push((from, to));
                from = to;
            }
        }
        let mut length = self.synced;
        for (from, to) in parts {
            let is_kept = match fate {
                Fate::Dropped => false,
                Fate::Kept => true,
                _ => survives(random),
            };
            if is_kept {
                length = to;
            } else if matches!(fate, Fate::Stale(_)) {
                self.bytes[from..to].fill_with(|| random.next() as u8);
            } else {
                self.bytes[from..to].fill(0);
            }
        }
        // The length may have reached the disk without the bytes, but in a file system that writes in order.
        let has_length = match fate {
            Fate::Zeroed => true,
            Fate::Torn(_) | Fate::Stale(_) => survives(random),
            _ => false,
        };
        self.bytes.truncate(if has_length { full } else { length });
        Some(self.bytes)
    }
}

/// Files of a folder as a power cut leaves them that comes while step `at` is under way.
pub fn cut(trace: &[Traced], at: usize, fate: Fate, random: &mut Random, folder: &Path) {
    let mut files = BTreeMap::<u32, File>::new();
    for (place, one) in trace[..=at].iter().enumerate() {
        match &one.step {
            Step::Create(number) => {
                files.insert(*number, File::default());
            }
            Step::Write(number, bytes) => {
                let file = files.get_mut(number).expect("made before");
                file.unsynced.push(file.bytes.len());
                file.bytes.extend(bytes);
            }
            // What is under way is not done.
            Step::Sync(_) | Step::SyncFolder if place == at => {}
            Step::Sync(number) => {
                let file = files.get_mut(number).expect("made before");
                file.synced = file.bytes.len();
                file.unsynced.clear();
            }
            Step::SyncFolder => files.values_mut().for_each(|file| file.has_name = true),
            Step::Reported(_) => {}
        }
    }
    for (number, file) in files {
        if let Some(bytes) = file.after_cut(fate, random) {
            fs::write(folder.join(segment_file(number)), bytes).expect("a folder to write in");
        }
    }
}
