//! Every kind of file that is read, with what must come of it when it is damaged.

use crate::damage;
use crate::disk::{Fate, cut};
use crate::foreign_damage::seeds;
use crate::power::Recording;
use crate::support::{
    Random, check_raw, end, entries, log_bytes, manifest, quick_folder, read_raw, rows, same_bits,
    wired_log_bytes,
};
use crate::worker::edit;
use chrono::DateTime;
use palpate_analysis::trade::stored::read_trade;
use palpate_model::Nanos;
use palpate_model::calibration::Calibration;
use palpate_model::rig::RigCompliance;
use palpate_sessions::analyses::{Analyses, Analysis, AnalysisContent, add_analysis};
use palpate_sessions::catalog::CATALOG_FILE;
use palpate_sessions::checks::{CheckPart, DailyCheck, add_check, read_checks};
use palpate_sessions::document_store::{self, Document};
use palpate_sessions::journal::Journal;
use palpate_sessions::{
    AuxiliaryData, Catalog, Edit, Edits, LOG_FILE, ReadError, Session, SessionOutline,
    SessionSummary, add_edit,
};
use palpate_tables::import::{ImportOptions, parse_foreign, parse_table, parse_weights};
use palpate_tables::lake;
use std::fs;
use std::path::{Path, PathBuf};

/// What became of a damaged file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It was refused with a reason.
    Refused,
    /// A part of it was read, and that it is a part was said or cannot be known.
    Short,
    /// All of it was read as it was written.
    Whole,
}

impl Outcome {
    pub fn word(self) -> &'static str {
        match self {
            Self::Refused => "refused",
            Self::Short => "short",
            Self::Whole => "whole",
        }
    }

    /// What was read must be the first of what was written.
    fn of_first<T: PartialEq + std::fmt::Debug>(read: &[T], written: &[T]) -> Self {
        assert_eq!(read, &written[..read.len()]);
        match read.len() == written.len() {
            true => Self::Whole,
            false => Self::Short,
        }
    }
}

type Read = Box<dyn Fn(&Path) -> Outcome>;

pub struct Kind {
    pub name: &'static str,
    /// Sound files, each with its place in a folder.
    pub files: Vec<(PathBuf, Vec<u8>)>,
    /// Reads the folder, and fails where a number is wrong.
    pub read: Read,
    /// Whether reading leaves files behind.
    pub is_restored_whole: bool,
}

impl Kind {
    fn new(name: &'static str, place: &str, bytes: Vec<u8>, read: Read) -> Self {
        Self { name, files: vec![(place.into(), bytes)], read, is_restored_whole: false }
    }

    /// All files of a folder that was filled with sound ones.
    fn of_folder(name: &'static str, folder: &Path, read: Read) -> Self {
        let mut files = Vec::new();
        collect(folder, folder, &mut files);
        files.sort();
        Self { name, files, read, is_restored_whole: false }
    }
}

fn collect(top: &Path, folder: &Path, files: &mut Vec<(PathBuf, Vec<u8>)>) {
    for item in fs::read_dir(folder).expect("it was filled") {
        let path = item.expect("it was filled").path();
        if path.is_dir() {
            collect(top, &path, files);
        } else if path.file_name().is_some_and(|name| name != "lock") {
            let place = path.strip_prefix(top).expect("it is below").to_path_buf();
            files.push((place, fs::read(&path).expect("it was filled")));
        }
    }
}

pub fn all() -> Vec<Kind> {
    let mut kinds = vec![
        session("session-finished", true),
        session("session-interrupted", false),
        segments(),
        document("calibration", &Calibration::thesis()),
        document("compliance", &compliance()),
        edits(),
        analyses(),
        journal(),
        checks(),
        catalog(),
        in_lake(),
        curves(),
        Kind::new("weights", "input", WEIGHTS.into(), Box::new(read_weights)),
    ];
    let tables = seeds().into_iter();
    kinds.extend(tables.map(|(name, bytes)| {
        let read = move |folder: &Path| read_foreign(name, folder);
        Kind::new(name, "input", bytes, Box::new(read))
    }));
    kinds
}

/// What a session held.
struct Original {
    held: damage::Original,
    is_finished: bool,
}

impl Original {
    fn read(&self, path: &Path) -> Outcome {
        self.check_summary(path);
        match Session::open(path) {
            Ok(session) => {
                self.held.check(&session, "damaged");
                let raw = read_raw(path).expect("it opened before");
                check_raw(&raw, &self.held.rows, session.rows.len(), "damaged");
                let is_whole = session.rows.len() == self.held.rows.len();
                match is_whole && session.end.is_some() == self.is_finished {
                    true => Outcome::Whole,
                    false => Outcome::Short,
                }
            }
            Err(refusal) => {
                if let ReadError::Damaged { offset, path, .. } = refusal {
                    let length = fs::metadata(path).map_or(0, |file| file.len());
                    assert!(offset <= length, "{offset} of {length}");
                }
                self.held.check_salvage(path, "damaged");
                Outcome::Refused
            }
        }
    }

    /// The ends alone are read; what they say must hold.
    fn check_summary(&self, path: &Path) {
        let Ok(summary) = SessionSummary::read(path) else {
            return;
        };
        let samples = self.held.rows.len() as u64;
        assert_eq!(summary.manifest, manifest());
        assert!(summary.samples <= samples);
        assert!(summary.end.is_none() || summary.samples == samples);
    }
}

fn session(name: &'static str, is_finished: bool) -> Kind {
    let rows = rows(1500, 11);
    let entries = entries(&rows, 40);
    let ending = is_finished.then(|| end(Nanos::from_millis(1500)));
    let bytes = wired_log_bytes(&rows, &entries, ending);
    let held = damage::Original { rows, entries, bytes: bytes.clone() };
    let original = Original { held, is_finished };
    let read = move |folder: &Path| original.read(&folder.join(LOG_FILE));
    Kind::new(name, LOG_FILE, bytes, Box::new(read))
}

/// A session in five files, one of them begun because another failed.
fn segments() -> Kind {
    let recording = Recording::new(1800, 12).by_log(7, &[16]);
    let folder = quick_folder();
    let last = recording.trace.len() - 1;
    cut(&recording.trace, last, Fate::Kept, &mut Random(1), folder.path());
    let held =
        damage::Original { rows: recording.rows, entries: recording.entries, bytes: Vec::new() };
    let original = Original { held, is_finished: true };
    let read = move |folder: &Path| original.read(&folder.join("session"));
    let mut kind = Kind::of_folder("session-in-segments", folder.path(), Box::new(read));
    assert_eq!(kind.files.len(), 5);
    for (place, _) in &mut kind.files {
        *place = Path::new("session").join(&*place);
    }
    kind
}

pub fn compliance() -> RigCompliance {
    RigCompliance {
        format: 1,
        rig: "bench".into(),
        taken_at: "2026-03-05T10:00:00Z".into(),
        mm_per_n: 0.002,
        std_error_mm_per_n: 1e-4,
        ..RigCompliance::default()
    }
}

fn document<D: Document + PartialEq + std::fmt::Debug + 'static>(
    name: &'static str,
    written: &D,
) -> Kind {
    let folder = quick_folder();
    let stored = document_store::save_document(folder.path(), written).expect("a sound document");
    let bytes = fs::read(&stored.path).expect("it was stored");
    let written = written.clone();
    let read =
        move |folder: &Path| match document_store::read_document::<D>(&folder.join("one.json")) {
            Ok(read) => {
                assert_eq!(read, written);
                Outcome::Whole
            }
            Err(_) => Outcome::Refused,
        };
    Kind::new(name, "one.json", bytes, Box::new(read))
}

fn edits() -> Kind {
    let folder = quick_folder();
    let written: Vec<Edit> = (1..=8).map(edit).collect();
    for edit in &written {
        add_edit(folder.path(), "one", edit).expect("a sound edit");
    }
    let read = move |folder: &Path| match Edits::read(folder, "one") {
        Ok(read) => Outcome::of_first(&read.all, &written),
        Err(_) => Outcome::Refused,
    };
    Kind::of_folder("edits", folder.path(), Box::new(read))
}

pub fn analysis(number: usize) -> Analysis {
    Analysis {
        name: format!("analysis {number}"),
        at: DateTime::UNIX_EPOCH,
        by: "Mary Somerville".into(),
        reason: String::new(),
        software_version: "0.1.0".into(),
        engine_version: 1,
        inputs: Vec::new(),
        what: match number % 2 {
            0 => AnalysisContent::Mask { left_out_s: vec![[0.1 * number as f64, 17.25]] },
            _ => AnalysisContent::Fit {
                based_on: None,
                settings: serde_json::Value::Null,
                results: serde_json::json!({"tau_eps_s": 0.1 + 0.2 * number as f64}),
            },
        },
    }
}

fn analyses() -> Kind {
    let folder = quick_folder();
    let written: Vec<Analysis> = (1..=6).map(analysis).collect();
    for analysis in &written {
        add_analysis(folder.path(), "one", analysis).expect("a sound analysis");
    }
    let read = move |folder: &Path| match Analyses::read(folder, "one") {
        Ok(read) => Outcome::of_first(&read.all, &written),
        Err(_) => Outcome::Refused,
    };
    Kind::of_folder("analyses", folder.path(), Box::new(read))
}

fn journal() -> Kind {
    let folder = quick_folder();
    let written: Vec<Edit> = (1..=8).map(edit).collect();
    let (mut journal, _) = Journal::open::<Edit>(folder.path()).expect("a new journal");
    for edit in &written {
        journal.push(edit).expect("a journal");
    }
    let read = move |folder: &Path| match Journal::open::<Edit>(folder) {
        Ok((_, read)) => Outcome::of_first(&read, &written),
        Err(_) => Outcome::Refused,
    };
    Kind::of_folder("journal", folder.path(), Box::new(read))
}

pub fn check(number: usize) -> DailyCheck {
    DailyCheck {
        at: DateTime::UNIX_EPOCH,
        rig: "bench".into(),
        by: "Ada".into(),
        session_id: format!("session {number}"),
        calibration: "cell".into(),
        is_passed: number.is_multiple_of(2),
        parts: vec![CheckPart {
            what: "zero".into(),
            is_passed: number.is_multiple_of(2),
            sentence: format!("the zero is off by 0.0{number} N"),
        }],
    }
}

fn checks() -> Kind {
    let folder = quick_folder();
    let written: Vec<DailyCheck> = (1..=6).map(check).collect();
    for check in &written {
        add_check(folder.path(), check).expect("a sound check");
    }
    let read = move |folder: &Path| match read_checks(folder, "bench") {
        Ok(read) => Outcome::of_first(&read, &written),
        Err(_) => Outcome::Refused,
    };
    Kind::of_folder("daily-checks", folder.path(), Box::new(read))
}

fn catalog() -> Kind {
    let library = quick_folder();
    for number in 0..4 {
        let folder = library.path().join(format!("sessions/s{number}"));
        fs::create_dir_all(&folder).expect("a folder to write in");
        let rows = rows(200 + 100 * number, number as u64);
        let bytes = log_bytes(&rows, &[], Some(end(Nanos::from_millis(900))));
        fs::write(folder.join(LOG_FILE), bytes).expect("a folder to write in");
    }
    let written = Catalog::with(library.path(), |catalog| {
        catalog.update(&mut |_, _| {})?;
        catalog.all()
    });
    let written = written.expect("a sound library");
    assert_eq!(written.len(), 4);
    let bytes = fs::read(library.path().join(CATALOG_FILE)).expect("it was made");
    let read = move |folder: &Path| {
        let Ok(catalog) = Catalog::open(folder) else {
            return Outcome::Refused;
        };
        let found = catalog.find(&palpate_sessions::catalog::CatalogQuery {
            limit: Some(100),
            ..Default::default()
        });
        let mut count = 0;
        for entry in found.iter().flat_map(|found| &found.entries) {
            assert!(written.contains(entry), "a wrong entry was found");
        }
        let Ok(all) = catalog.all() else {
            return Outcome::Refused;
        };
        for entry in &all {
            assert!(written.contains(entry), "a wrong entry");
            count += 1;
        }
        // The catalog was replaced.
        match (count, catalog.remarks.is_empty()) {
            (4, true) => Outcome::Whole,
            (_, true) => Outcome::Short,
            (_, false) => Outcome::Refused,
        }
    };
    Kind { is_restored_whole: true, ..Kind::new("catalog", CATALOG_FILE, bytes, Box::new(read)) }
}

/// A session put into a lake.
pub fn lake_of(folder: &Path, samples: usize) -> Session {
    let rows = rows(samples, 43);
    let session = Session {
        path: PathBuf::new(),
        manifest: manifest(),
        entries: entries(&rows, 9),
        rows,
        end: Some(end(Nanos(5_000_000_000))),
        notes: vec!["a note".into()],
        auxiliary: AuxiliaryData::default(),
    };
    let outline = SessionOutline {
        path: session.path.clone(),
        manifest: session.manifest.clone(),
        samples: samples as u64,
        entries: session.entries.clone(),
        end: session.end.clone(),
        notes: session.notes.clone(),
        auxiliary: AuxiliaryData::default(),
    };
    lake::add_session(folder, &outline, lake::LakeQuality::default(), &mut |visit| {
        visit(&session.rows);
        Ok(())
    })
    .expect("a folder to write in");
    session
}

fn in_lake() -> Kind {
    let folder = quick_folder();
    let written = lake_of(folder.path(), 400);
    let read = move |folder: &Path| {
        let listed = lake::list_sessions(folder).expect("its folders are there");
        match lake::read_session(folder, &listed[0]) {
            Ok((read, None)) => {
                let read = Session { path: PathBuf::new(), ..read };
                assert!(same_bits(&read.rows, &written.rows) && read == written);
                Outcome::Whole
            }
            Ok((_, Some(rejection))) => panic!("rejected: {rejection}"),
            Err(_) => Outcome::Refused,
        }
    };
    Kind::of_folder("lake", folder.path(), Box::new(read))
}

fn curves() -> Kind {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/trade/curves.json");
    let written = read_trade(&path).expect("recorded curves");
    let read = move |folder: &Path| match read_trade(&folder.join("curves.json")) {
        Ok(read) => {
            assert_eq!(read, written);
            Outcome::Whole
        }
        Err(_) => Outcome::Refused,
    };
    let bytes = fs::read(path).expect("recorded curves");
    Kind::new("trade-curves", "curves.json", bytes, Box::new(read))
}

pub const WEIGHTS: &str = "mass_g,volts,std_v,direction\n0,0.011,0.001,up\n140,0.212,0.001,up\n\
    280,0.413,0.001,up\n420,0.615,0.001,up\n280,0.414,0.001,down\n0,0.012,0.001,down\n";

fn read_weights(folder: &Path) -> Outcome {
    let bytes = fs::read(folder.join("input")).expect("it was put there");
    check_weights(&bytes)
}

pub fn check_weights(bytes: &[u8]) -> Outcome {
    match parse_weights(&String::from_utf8_lossy(bytes)) {
        Ok(calibration) => {
            for series in &calibration.series {
                for step in &series.steps {
                    assert!(step.mass_g.is_finite() && step.volts.0.is_finite());
                }
            }
            Outcome::Whole
        }
        Err(reason) => {
            assert!(!reason.to_string().is_empty());
            Outcome::Refused
        }
    }
}

fn read_foreign(name: &str, folder: &Path) -> Outcome {
    let bytes = fs::read(folder.join("input")).expect("it was put there");
    if let Ok(text) = std::str::from_utf8(&bytes) {
        check_table(text);
    }
    check_foreign(name, &bytes)
}

/// A table of time, depth and force as a fit reads it.
pub fn check_table(text: &str) {
    match parse_table(text, None) {
        Ok(table) => {
            let numbers = table.t.iter().chain(&table.depth).chain(&table.force);
            assert!(numbers.copied().all(f64::is_finite));
            assert!(table.t.is_sorted_by(|a, b| a < b));
        }
        Err(reason) => assert!(!reason.trim().is_empty()),
    }
}

/// Nothing tells a changed digit in a file without checksums; but what is read must be numbers in order.
pub fn check_foreign(name: &str, bytes: &[u8]) -> Outcome {
    match parse_foreign(name, bytes.to_vec(), &ImportOptions::default()) {
        Ok(foreign) => {
            for part in &foreign.parts {
                let mut last = f64::NEG_INFINITY;
                for sample in &part.samples {
                    assert!(sample.t.is_finite() && sample.t > last, "{name}");
                    last = sample.t;
                    let values = [sample.depth, sample.force, sample.signal];
                    assert!(values.into_iter().flatten().all(f64::is_finite), "{name}");
                }
            }
            Outcome::Whole
        }
        Err(reason) => {
            assert!(!reason.trim().is_empty(), "{name}");
            Outcome::Refused
        }
    }
}
