//! A store of many sessions on one computer: what is found in its catalog, and what that takes.
//!
//! `PALPATE_STORE_SESSIONS=1000000 cargo test -p palpate-store many_sessions -- --nocapture` prints times and the largest
//! storage of the process.

use super::{go_on, now};
use crate::rows::{SessionRow, part};
use crate::{Mirror, Store, StoreUrl};
use chrono::{DateTime, SecondsFormat};
use palpate_sessions::catalog::{
    CatalogEntry, CatalogQuery, LocalSession, NamedValue, NamedValueSource, QueryLine,
    parse_query_line,
};
use std::path::Path;
use std::time::Instant;

const OPERATORS: [&str; 6] = ["Sophie", "Grace", "Mary", "Emmy", "Lise", "Rosalind"];
const ORGANS: [&str; 5] = ["liver", "stomach", "kidney", "spleen", "heart"];
/// Sessions of a specimen.
const PRESSES: usize = 40;
/// Rows of a file, as after a compaction.
const FILE_ROWS: usize = 20_000;

/// Draws of each query; three of them are compared with the definition of what they find.
const DRAWS: usize = 30;
const PAGE: usize = 20;

/// The identifier of a session; those of neighbours are far apart.
fn id(number: usize) -> String {
    format!("20260101T000000Z-{:08x}", number.wrapping_mul(0x9e37_79b1) & 0xffff_ffff)
}

fn mu1(number: usize) -> f64 {
    1e-4 * (number % 9973) as f64
}

/// A recorded session under another name, of another specimen, with other results.
fn row(original: &CatalogEntry, number: usize) -> SessionRow {
    let mut entry = original.clone();
    let id = id(number);
    let start = DateTime::UNIX_EPOCH + chrono::Duration::minutes(20 * number as i64);
    entry.session_id.clone_from(&id);
    entry.started_at = start.to_rfc3339_opts(SecondsFormat::Millis, true);
    entry.operator = OPERATORS[number % 6].into();
    entry.specimen = format!("{} {}", ORGANS[number / PRESSES % 5], number / PRESSES);
    entry.rig = format!("rig {}", number % 10);
    entry.ending = Some("completed".into());
    if number.is_multiple_of(50) {
        entry.tags.push("pilot".into());
    }
    let values = [("mu1", mu1(number)), ("tau_eps", (number % 997) as f64)];
    entry.named.extend(values.map(|(name, value)| NamedValue {
        source: NamedValueSource::Fit,
        name: name.into(),
        number: Some(value),
        unit: String::new(),
        text: value.to_string(),
    }));
    SessionRow { version: 1, content: id, pushed_at: String::new(), entry }
}

/// Adds sessions to the table in files of so many rows.
fn add(store: &Store, original: &CatalogEntry, numbers: std::ops::Range<usize>, rows: usize) {
    for first in numbers.clone().step_by(rows) {
        let last = (first + rows).min(numbers.end);
        let rows: Vec<SessionRow> = (first..last).map(|number| row(original, number)).collect();
        store.wait(async {
            let part = part(&rows, now()).unwrap();
            assert!(
                store.put_new(&store.sessions().path(&part.add.path), part.bytes).await.unwrap()
            );
            let version = store.sessions().snapshot().await.unwrap().unwrap().version + 1;
            assert!(store.sessions().commit(version, &[part.add.into()]).await.unwrap());
        });
    }
}

/// Largest storage of this process so far, in MB; none where the system does not say.
fn storage_mb() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? / 1024)
}

fn query(line: &str) -> CatalogQuery {
    let QueryLine { words, fields, conditions } = parse_query_line(line).unwrap();
    CatalogQuery { words, fields, conditions, limit: Some(PAGE), ..CatalogQuery::default() }
}

/// A query of each kind, and whether a session of this number meets it.
type Query = (String, Box<dyn Fn(usize) -> bool>);

fn queries(sessions: usize, draw: usize) -> [Query; 8] {
    let specimen = (draw % (sessions / PRESSES)).to_string();
    let (organ, operator, value) = (draw % 5, draw / 5 % 6, draw % 9973);
    let of_organ = move |number: usize| number / PRESSES % 5 == organ;
    let of_specimen = {
        let specimen = specimen.clone();
        move |number: usize| (number / PRESSES).to_string().starts_with(&specimen)
    };
    [
        (String::new(), Box::new(|_| true)),
        (format!("specimen:{specimen}"), Box::new(of_specimen)),
        (
            format!("{} {}", ORGANS[organ], OPERATORS[operator]),
            Box::new(move |number| of_organ(number) && number % 6 == operator),
        ),
        (format!("mu1={}", mu1(value)), Box::new(move |number| number % 9973 == value)),
        ("tau_eps>=500".into(), Box::new(|number| number % 997 >= 500)),
        (
            format!("specimen:{} tag:pilot tau_eps<100", ORGANS[organ]),
            Box::new(move |number| of_organ(number) && number % 50 == 0 && number % 997 < 100),
        ),
        ("tag:pilot".into(), Box::new(|number| number % 50 == 0)),
        ("nothing of this name".into(), Box::new(|_| false)),
    ]
}

#[expect(clippy::disallowed_methods, reason = "times are printed and decide nothing")]
#[test]
fn many_sessions_are_found_in_the_catalog_of_a_store() {
    let count = std::env::var("PALPATE_STORE_SESSIONS").ok().map(|text| text.parse().unwrap());
    let count: usize = count.unwrap_or(3_000);
    let recorded = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/sessions/ramp-hold-lab");
    let original = LocalSession::read(&recorded).entry;
    assert_eq!(original.trouble, None);
    let folder = tempfile::tempdir().unwrap();
    let url = format!("file://{}", folder.path().join("store").display());
    let store = Store::create(&StoreUrl::parse(&url).unwrap()).unwrap();
    store.wait(store.sessions().ensure(now())).unwrap();
    add(&store, &original, 0..count, FILE_ROWS);
    println!("{count} sessions in a store, {} MB for making it", storage_mb().unwrap_or(0));

    let at = folder.path().join("mirror");
    let start = Instant::now();
    let mut mirror = Mirror::open(&at).unwrap();
    assert_eq!(mirror.update(&store, &mut go_on).unwrap(), count);
    let bytes = std::fs::metadata(at.join("catalog.sqlite")).unwrap().len();
    println!(
        "first open {:.1?}, catalog {} MB, {} MB",
        start.elapsed(),
        bytes / 1_000_000,
        storage_mb().unwrap_or(0)
    );
    drop(mirror);

    let start = Instant::now();
    let mut mirror = Mirror::open(&at).unwrap();
    assert_eq!(mirror.update(&store, &mut go_on).unwrap(), 0);
    println!("opened again {:.1?}", start.elapsed());

    let mut times = vec![Vec::new(); 8];
    for draw in 0..DRAWS {
        let queries = queries(count, draw.wrapping_mul(0x9e37_79b1) >> 7);
        for ((line, is_met), times) in queries.into_iter().zip(&mut times) {
            let query = query(&line);
            let start = Instant::now();
            let found = mirror.catalog().find(&query).unwrap();
            times.push((start.elapsed(), line.clone()));
            if draw < 3 {
                let met: Vec<usize> = (0..count).rev().filter(|&number| is_met(number)).collect();
                let page: Vec<String> = met.iter().take(PAGE).map(|&number| id(number)).collect();
                let ids: Vec<String> =
                    found.entries.into_iter().map(|one| one.session_id).collect();
                let count = if found.has_more {
                    found.count + 1..=count
                } else {
                    found.count..=found.count
                };
                assert!(count.contains(&met.len()), "{line}: {count:?} of {}", met.len());
                assert_eq!(ids, page, "{line}");
            }
        }
    }
    for times in &mut times {
        times.sort();
        let (median, (last, line)) = (times[DRAWS / 2].0, &times[DRAWS - 1]);
        println!("median {median:.1?}, longest {last:.1?}: {line}");
    }
    let mut all: Vec<_> = times.into_iter().flatten().map(|(time, _)| time).collect();
    all.sort();
    println!("p99 of all {:.1?}", all[all.len() * 99 / 100]);

    let new = count..count + count.min(1000);
    add(&store, &original, new.clone(), 100);
    let start = Instant::now();
    assert_eq!(mirror.update(&store, &mut go_on).unwrap(), new.len());
    println!("{} new ones {:.1?}, {} MB", new.len(), start.elapsed(), storage_mb().unwrap_or(0));
    let found = mirror.catalog().find(&query("")).unwrap();
    assert_eq!(found.entries[0].session_id, id(new.end - 1));
}
