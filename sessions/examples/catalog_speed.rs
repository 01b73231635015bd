//! Time to build, update and search a catalog of many sessions.
//!
//! Every session is the beginning of a recorded one with another manifest.
//!
//! `cargo run -p palpate-sessions --example catalog_speed -- [SESSIONS] [FOLDER]`
#![expect(clippy::print_stdout, reason = "a program that prints")]

use chrono::Duration;
use palpate_model::metadata::SessionLabels;
use palpate_sessions::catalog::{Catalog, CatalogQuery, Condition};
use palpate_sessions::{
    DataQuality, Edit, EditChange, EndRecord, LogWriter, Manifest, Session, Sink, add_edit,
};
use std::error::Error;
use std::fs;
use std::io;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Instant;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Samples of each session; the catalog reads only the first and the last chunk.
const SAMPLES: usize = 2000;

/// A log in memory, because the measurement is about reading, not about synchronisation.
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

#[expect(clippy::disallowed_methods, reason = "this program measures time")]
fn timed<T>(what: &str, body: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = body();
    println!("{what}: {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
    result
}

fn manifest_of(original: &Manifest, number: usize) -> Outcome<Manifest> {
    let operators = ["Ada", "Grace", "Mary", "Emmy"];
    let mut labels = SessionLabels::default();
    let thickness = 5.0 + (number % 100) as f64 / 10.0;
    labels.set("specimen.thickness_mm", &thickness.to_string())?;
    labels.set("specimen.source", "pig stomach, fundus")?;
    let mut plan = original.plan.clone();
    plan["source"]["values"]["depth"] = format!("{} mm", number % 30).into();
    Ok(Manifest {
        session_id: format!("20260101T000000Z-{number:08x}"),
        started_at: original.started_at + Duration::minutes(20 * number as i64),
        operator: operators[number % operators.len()].into(),
        specimen: format!("stomach {}", number % 500),
        about: labels.about,
        plan,
        ..original.clone()
    })
}

fn make(library: &Path, original: &Session, number: usize) -> Outcome<()> {
    let manifest = manifest_of(&original.manifest, number)?;
    let memory = Memory::default();
    let mut log = LogWriter::begin(memory.clone(), "memory", &manifest)?;
    for batch in original.rows[..SAMPLES].chunks(100) {
        log.append(batch, &[])?;
    }
    log.finish(EndRecord {
        outcome: "finish".into(),
        reason: "the plan is complete".into(),
        ended_at: original.rows[SAMPLES - 1].host,
        ..EndRecord::default()
    })?;
    let folder = library.join("sessions").join(&manifest.session_id);
    fs::create_dir_all(&folder)?;
    let bytes = memory.0.lock().map_err(|_| "poisoned")?;
    fs::write(folder.join("000.mcap"), bytes.as_slice())?;
    let edit = Edit {
        at: manifest.started_at,
        by: "palpate".into(),
        reason: "finished, no sample missing".into(),
        change: EditChange::Verdict {
            verdict: [DataQuality::Valid, DataQuality::Suspect]
                [usize::from(number.is_multiple_of(9))],
        },
    };
    Ok(add_edit(&folder, &manifest.session_id, &edit)?)
}

fn main() -> Outcome<()> {
    let mut words = std::env::args().skip(1);
    let sessions: usize = words.next().map_or(Ok(10_000), |word| word.parse())?;
    let folder = words.next().unwrap_or_else(|| "target/catalog_speed".into());
    let library = Path::new(&folder);
    let recorded = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/sessions/ramp-hold-lab");
    let original = Session::open(&recorded)?;
    timed(&format!("{sessions} sessions written"), || -> Outcome<()> {
        (0..sessions).try_for_each(|number| make(library, &original, number))
    })?;
    let mut catalog = Catalog::open(library)?;
    let changes = timed("catalog made", || catalog.rebuild(&mut |_, _| {}))?;
    println!("  {} sessions read", changes.read);
    let changes = timed("brought up to date, nothing new", || catalog.update(&mut |_, _| {}))?;
    println!("  {} sessions read", changes.read);
    let text = |text: &str| text.to_owned();
    let page = CatalogQuery { limit: Some(20), ..CatalogQuery::default() };
    for (what, query) in [
        ("the latest", page.clone()),
        ("a specimen", CatalogQuery { specimen: Some(text("stomach 77")), ..page.clone() }),
        ("words", CatalogQuery { words: text("pig fund ada"), ..page.clone() }),
        (
            "one value",
            CatalogQuery { conditions: vec!["depth>=28mm".parse::<Condition>()?], ..page.clone() },
        ),
        (
            "words, operator and two values",
            CatalogQuery {
                words: text("stomach"),
                operator: Some(text("Grace")),
                conditions: vec!["depth>=10mm".parse()?, "specimen.thickness_mm<8".parse()?],
                ..page
            },
        ),
    ] {
        let found = timed(&format!("search for {what}"), || catalog.find(&query))?;
        println!("  {} sessions", found.count);
    }
    Ok(fs::remove_dir_all(library)?)
}
