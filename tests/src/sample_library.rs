//! A library of many small sessions, each the beginning of a recorded one under another manifest.

use crate::workspace;
use palpate_model::metadata::SessionLabels;
use palpate_sessions::{
    DataQuality, Edit, EditChange, EndRecord, LogWriter, Manifest, Session, Sink, add_edit,
};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Samples of each session.
pub const SAMPLES: usize = 2000;

/// Operators, in turn.
pub const OPERATORS: [&str; 4] = ["Ada", "Grace", "Mary", "Emmy"];

/// A log in memory: nothing is synchronised, for nothing here is worth it.
#[derive(Clone, Default)]
struct Memory(Arc<Mutex<Vec<u8>>>);

impl Sink for Memory {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut all = self.0.lock().map_err(|_| io::Error::other("poisoned"))?;
        all.extend_from_slice(bytes);
        Ok(())
    }

    fn sync(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The session that the others are made of.
///
/// # Panics
/// If it cannot be read.
#[must_use]
pub fn read_original() -> Session {
    let recorded = workspace().join("tests/sessions/ramp-hold-lab");
    Session::open(&recorded).expect("the recorded session")
}

/// Writes session `number` of a library and returns its folder. The operators take turns, there are five hundred
/// specimens, `depth` is `number % 30` mm, every ninth is suspect, and one follows the other by 20 minutes.
///
/// # Panics
/// If it cannot be written.
pub fn write(library: &Path, original: &Session, number: usize) -> PathBuf {
    let mut labels = SessionLabels::default();
    let thickness = 5.0 + (number % 100) as f64 / 10.0;
    let metadata = [
        ("specimen.thickness_mm", thickness.to_string()),
        ("specimen.source", "pig stomach, fundus".into()),
    ];
    for (key, value) in metadata {
        labels.set(key, &value).expect("a key that is known");
    }
    let mut plan = original.manifest.plan.clone();
    plan["source"]["values"]["depth"] = format!("{} mm", number % 30).into();
    let manifest = Manifest {
        session_id: format!("20260101T000000Z-{number:08x}"),
        started_at: original.manifest.started_at + Duration::from_secs(1200 * number as u64),
        operator: OPERATORS[number % OPERATORS.len()].into(),
        specimen: format!("stomach {}", number % 500),
        about: labels.about,
        plan,
        ..original.manifest.clone()
    };
    let memory = Memory::default();
    let mut log = LogWriter::begin(memory.clone(), "memory", &manifest).expect("a log");
    for batch in original.rows[..SAMPLES].chunks(100) {
        log.append(batch, &[]).expect("samples");
    }
    let end = EndRecord {
        outcome: "finish".into(),
        reason: "the plan is complete".into(),
        samples: 0,
        entries: 0,
        raw_bytes: 0,
        ended_at: original.rows[SAMPLES - 1].host,
        time_use: Vec::new(),
    };
    log.finish(end).expect("an end");
    let folder = library.join("sessions").join(&manifest.session_id);
    fs::create_dir_all(&folder).expect("a folder");
    let bytes = memory.0.lock().expect("no other writer");
    fs::write(folder.join("000.mcap"), bytes.as_slice()).expect("room on the disk");
    let verdict = [DataQuality::Valid, DataQuality::Suspect][usize::from(number % 9 == 8)];
    let edit = Edit {
        at: manifest.started_at,
        by: "palpate".into(),
        reason: "finished, no sample missing".into(),
        change: EditChange::Verdict { verdict },
    };
    add_edit(&folder, &manifest.session_id, &edit).expect("a verdict");
    folder
}
