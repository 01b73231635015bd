//! Power cuts: recorded traces of writes and synchronisations, cut anywhere, with everything that was not
//! synchronised dropped, reordered, zeroed, torn or replaced by what the disk held before.

use crate::disk::{Disk, FATES, Fate, Step, Traced, cut};
use crate::support::{
    Random, check_raw, check_raw_begins, count_from, end, entries, manifest, quick_folder, raw_of,
    read_raw, rows, same_bits,
};
use palpate_model::Nanos;
use palpate_sessions::recover::{Salvage, recover, salvage};
use palpate_sessions::{
    EntryKind, LogBatch, LogEntry, LogError, LogWriter, ReadError, RecordingPace, SampleRow,
    Session, SessionWriter,
};
use std::path::Path;

/// Samples in a batch: 100 ms at 1 kHz.
const BATCH: usize = 100;
/// Batches between two synchronisations when there is no event; `log::scribe` tests that it is no more.
const BATCHES_PER_SYNC: usize = 9;

pub struct Recording {
    pub rows: Vec<SampleRow>,
    pub entries: Vec<LogEntry>,
    pub trace: Vec<Traced>,
}

impl Recording {
    pub fn new(samples: usize, seed: u64) -> Self {
        let rows = rows(samples, seed);
        // Answers of the live fit, which wait for the next synchronisation, and a few events, which do not.
        let mut entries = entries(&rows, 130);
        for (number, entry) in entries.iter_mut().enumerate() {
            if number % 13 != 5 {
                entry.kind = EntryKind::Fit;
            }
        }
        Self { rows, entries, trace: Vec::new() }
    }

    /// Writes like the writer thread, but step by step, and reports every synchronisation to the caller.
    pub fn by_log(mut self, batches_per_segment: u32, fail_at: &[u32]) -> Self {
        let disk = Disk::new(fail_at);
        let outcome = self.write(&disk, batches_per_segment);
        assert!(outcome.is_ok() || !fail_at.is_empty(), "{outcome:?}");
        self.trace = disk.trace();
        self
    }

    fn write(&self, disk: &Disk, batches_per_segment: u32) -> Result<(), LogError> {
        let source = Box::new(disk.clone());
        let mut log = LogWriter::begin_in_segments(source, batches_per_segment, &manifest())?;
        disk.tell(0);
        let raw: Vec<_> = self.rows.chunks(BATCH).map(raw_of).collect();
        let mut since_sync: Vec<LogBatch<'_>> = Vec::new();
        let mut rest = &self.entries[..];
        for (number, batch) in self.rows.chunks(BATCH).enumerate() {
            // While this one is written, the next is taken.
            disk.set_taken(((number + 2) * BATCH).min(self.rows.len()));
            let stop = ((number + 1) * BATCH) as u64;
            let (due, later) =
                rest.split_at(rest.partition_point(|entry| entry.after_sample < stop));
            rest = later;
            let parts = LogBatch { rows: batch, entries: due, raw: &raw[number], health: &[] };
            since_sync.push(parts);
            let is_event = due.iter().any(|entry| entry.kind != EntryKind::Fit);
            let mut outcome = log.append_batch(&parts);
            if outcome.is_ok() && (is_event || since_sync.len() >= BATCHES_PER_SYNC) {
                outcome = log.sync();
                if outcome.is_err() {
                    log.rewrite(&since_sync)?;
                    outcome = Ok(());
                }
                disk.tell((number + 1) * BATCH);
                since_sync.clear();
            }
            if outcome.is_err() {
                log.rewrite(&since_sync)?;
                disk.tell((number + 1) * BATCH);
                since_sync.clear();
            }
        }
        if log.finish(end(Nanos::from_millis(1))).is_err() {
            log.rewrite(&since_sync)?;
            log.finish(end(Nanos::from_millis(1)))?;
        }
        disk.tell(self.rows.len());
        Ok(())
    }

    /// Written by the writer thread itself.
    fn by_thread(mut self, batches_per_segment: u32, fail_at: &[u32]) -> Self {
        let disk = Disk::new(fail_at);
        let mut writer = SessionWriter::start_in_segments(
            disk.clone(),
            batches_per_segment,
            &manifest(),
            RecordingPace::Virtual,
        )
        .expect("the beginning does not fail");
        let mut pending = self.entries.iter().peekable();
        for (number, row) in self.rows.iter().enumerate() {
            disk.set_taken(number + 1);
            while let Some(entry) = pending.next_if(|entry| entry.after_sample == number as u64) {
                // Were they answers of the fit, nothing would be synchronised before a second has passed.
                let kind = EntryKind::Input;
                let entry = LogEntry { kind, ..entry.clone() };
                writer.push_entry(entry).expect("it goes on elsewhere");
            }
            let raw = raw_of(std::slice::from_ref(row));
            writer.push_raw(row.host, raw).expect("it goes on elsewhere");
            writer.push_row(*row).expect("it goes on elsewhere");
        }
        writer.close(end(Nanos::from_millis(1))).expect("it goes on elsewhere");
        for entry in &mut self.entries {
            entry.kind = EntryKind::Input;
        }
        self.trace = disk.trace();
        self
    }

    /// What a cut leaves of which nothing else survives was synchronised: no other fate may leave less.
    fn tell_what_is_synchronised(&mut self) {
        let taken = self.rows.len();
        // So that there is a step under way after the last synchronisation.
        self.trace.extend([0, 0].map(|reported| Traced { step: Step::Reported(reported), taken }));
        for at in (0..self.trace.len()).rev() {
            if matches!(self.trace[at].step, Step::Sync(_)) {
                // The folder's own may follow.
                let after = at + 2;
                let lost_samples = self.check_cut(after, Fate::Dropped, 0);
                let taken = self.trace[after].taken;
                let step = Step::Reported(taken - lost_samples);
                self.trace.insert(after, Traced { step, taken });
            }
        }
    }

    /// Samples reported to survive, at a step.
    fn reported_by(&self, at: usize) -> Option<usize> {
        let reported = self.trace[..at].iter().filter_map(|one| match one.step {
            Step::Reported(samples) => Some(samples),
            _ => None,
        });
        reported.max()
    }

    /// Everything that is read is as it was recorded; returns how many samples from the first on are there.
    fn check_right(&self, folder: &Path, context: &str) -> usize {
        match Session::open(folder) {
            Ok(session) => {
                let count = session.rows.len();
                assert!(same_bits(&session.rows, &self.rows[..count]), "{context}");
                let entries = &self.entries[..session.entries.len()];
                assert_eq!(session.entries, entries, "{context}");
                let raw = read_raw(folder).expect("it opened before");
                check_raw(&raw, &self.rows, count, context);
                let is_whole = count == self.rows.len() && entries.len() == self.entries.len();
                assert!(is_whole || session.end.is_none(), "{context}");
                assert!(is_whole || !session.notes.is_empty(), "{context}");
                count
            }
            Err(ReadError::Damaged { .. }) => self.check_left(folder, context),
            Err(ReadError::NotASession { .. } | ReadError::Missing { .. }) => 0,
            Err(err) => panic!("{context}: {err}"),
        }
    }

    fn check_left(&self, folder: &Path, context: &str) -> usize {
        let mut unbroken = 0;
        let mut remaining = 0;
        let salvage = salvage(folder, &mut |block| {
            let first = block.first_sample() as usize;
            let found: Vec<SampleRow> = block.rows().collect();
            let there = &self.rows[first..first + found.len()];
            assert!(same_bits(&found, there), "{context}");
            if first == unbroken {
                unbroken += found.len();
            }
            remaining += found.len();
        });
        // Nothing but the beginning that never reached the disk makes a session useless.
        let Ok(Salvage { entries, missing, .. }) = salvage else {
            return 0;
        };
        let is_own = |entry: &LogEntry| self.entries.contains(entry);
        assert!(entries.iter().all(is_own), "{context}: wrong entries");
        let is_short = remaining < self.rows.len() || entries.len() < self.entries.len();
        assert!(!is_short || !missing.sentences().is_empty(), "{context}");
        unbroken
    }

    /// Cuts the power at a step and reads what is left. Returns how many samples are lost.
    fn check_cut(&self, at: usize, fate: Fate, seed: u64) -> usize {
        let context = format!("{fate:?} at step {at} of {}, seed {seed}", self.trace.len());
        let folder = quick_folder();
        let session = folder.path().join("one");
        std::fs::create_dir(&session).expect("a folder to write in");
        cut(&self.trace, at, fate, &mut Random(seed), &session);
        let remaining = self.check_right(&session, &context);
        let taken = self.trace[at].taken;
        if let Some(reported) = self.reported_by(at) {
            assert!(remaining >= reported, "{context}: {remaining} of {reported}");
            let is_recovered = recover(&session, "1", chrono::DateTime::UNIX_EPOCH);
            if let Ok(recovery) = is_recovered {
                let copy = Session::open(&recovery.folder).expect("a copy is whole");
                let unbroken = copy.rows.iter().zip(&self.rows);
                let same = unbroken.take_while(|(a, b)| same_bits(&[**a], &[**b]));
                let same = same.count();
                let raw = read_raw(&recovery.folder).expect("a copy is whole");
                check_raw_begins(&raw, &self.rows[..remaining], &context);
                assert!(same >= remaining, "{context}: {same} of {remaining} in the copy");
            }
        }
        taken.saturating_sub(remaining)
    }
}

/// Cuts at random steps, each fate in turn. Returns the most samples lost after the beginning was safe.
fn sweep(recording: &Recording, cuts: usize, seed: u64) -> usize {
    let mut random = Random(seed);
    let first = recording.trace.iter().position(|one| one.taken > 0);
    let first = first.expect("samples were taken");
    let mut most = 0;
    for number in 0..cuts {
        let at = first + random.below(recording.trace.len() - first);
        let fate = FATES[number % FATES.len()];
        most = most.max(recording.check_cut(at, fate, random.next()));
    }
    most
}

/// Cuts in the gate for each kind of recording; the soak script asks for more.
fn cuts() -> usize {
    count_from("PALPATE_POWER_CUTS", 120)
}

#[test]
fn a_power_cut_costs_at_most_a_second() {
    let mut most = 0;
    for (number, batches_per_segment) in [7, 11, 100].into_iter().enumerate() {
        let seed = 400 + number as u64;
        let recording = Recording::new(3000, seed).by_log(batches_per_segment, &[]);
        most = most.max(sweep(&recording, cuts(), seed));
    }
    println!("{} power cuts: at most {most} ms lost", 3 * cuts());
    // Samples are 1 ms apart.
    assert!((100..=1000).contains(&most), "{most} ms");
}

#[test]
fn a_power_cut_after_a_failed_write_costs_no_more() {
    let mut random = Random(71);
    let (mut most, mut count) = (0, 0);
    for number in 0..cuts().div_ceil(8) as u64 {
        // The first three operations make the session; a failure there is a refused start.
        let fail_at: Vec<u32> = (0..1 + number % 3).map(|_| 3 + random.below(45) as u32).collect();
        let recording = Recording::new(2500, 500 + number).by_log(8, &fail_at);
        most = most.max(sweep(&recording, 16, number));
        count += 16;
    }
    println!("{count} power cuts after failed writes: at most {most} ms lost");
    assert!((100..=1000).contains(&most), "{most} ms");
}

#[test]
fn a_power_cut_under_the_writer_thread_loses_nothing_that_was_synchronised() {
    for (number, fail_at) in [&[][..], &[14], &[9, 30]].into_iter().enumerate() {
        let seed = 600 + number as u64;
        let mut recording = Recording::new(2000, seed).by_thread(6, fail_at);
        recording.tell_what_is_synchronised();
        let all = recording.rows.len();
        assert_eq!(recording.reported_by(recording.trace.len()), Some(all));
        sweep(&recording, cuts(), seed);
    }
}
