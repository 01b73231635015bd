//! Tables of results under writers that race, connections that break and bytes that flip.

use super::{Faulty, Rig, go_on, now};
use crate::results::VerifiedResults;
use crate::table::Table;
use crate::{ResultNumber, ResultTable, ResultsOutcome, StudyResult};
use object_store::ObjectStoreExt;
use object_store::memory::InMemory;
use serde_json::json;
use std::sync::Arc;

const TABLE: ResultTable = ResultTable::Fits;

/// A fit of a session whose numbers come from a computer.
fn fit(session: usize, computer: usize) -> StudyResult {
    let number = |parameter: &str, value| ResultNumber {
        parameter: parameter.into(),
        value,
        std_error: Some(0.1),
        ..ResultNumber::default()
    };
    StudyResult {
        session_id: Some(format!("session {session}")),
        model: "modified-kelvin".into(),
        software_version: "1".into(),
        settings: json!({ "fixed": [] }),
        data: json!({ "samples_crc32": session }),
        text: format!("fit {session} by {computer}"),
        numbers: vec![number("mu1", session as f64), number("mu2", computer as f64)],
    }
}

fn table(rig: &Rig) -> Table<'_> {
    Table { store: &rig.store, shape: TABLE.shape() }
}

fn verified(rig: &Rig) -> VerifiedResults {
    rig.store.wait(table(rig).verify_results()).unwrap()
}

fn add(rig: &Rig, results: &[StudyResult]) -> Result<ResultsOutcome, crate::StoreError> {
    rig.store.add_results(TABLE, results, now, &mut go_on)
}

#[test]
fn workers_that_race_and_begin_again_add_every_result_once() {
    const WORKERS: usize = 6;
    const RESULTS: usize = 40;
    let objects: Arc<InMemory> = Arc::default();
    std::thread::scope(|scope| {
        for worker in 0..WORKERS {
            let objects = objects.clone();
            scope.spawn(move || {
                let rig = Rig::of(Faulty {
                    objects,
                    one_of: 30,
                    seed: worker as u64 + 1,
                    ..Faulty::default()
                });
                // Shares overlap, and each worker begins again from the start after a broken request.
                for first in (0..RESULTS).step_by(8) {
                    let share: Vec<_> =
                        (0..12).map(|k| fit((first + k) % RESULTS, worker)).collect();
                    assert!((0..200).any(|_| add(&rig, &share).is_ok()));
                }
            });
        }
        let objects = objects.clone();
        scope.spawn(move || {
            let rig = Rig::with(&objects);
            for _ in 0..5 {
                // There may be no table yet.
                let _ = rig.store.compact(now);
            }
        });
    });
    let rig = Rig::with(&objects);
    assert_eq!(rig.store.compact(now).unwrap().after, 1);
    let found = verified(&rig);
    assert_eq!(found.faults, []);
    assert_eq!(found.objects.len(), RESULTS);
    assert_eq!(rig.store.verify(true, &mut go_on).unwrap().faults, []);
    let all: Vec<_> = (0..RESULTS).map(|session| fit(session, 9)).collect();
    let outcome = add(&rig, &all).unwrap();
    assert_eq!(outcome, ResultsOutcome { added: 0, known: RESULTS });
}

#[test]
fn what_determines_a_result_makes_it_another() {
    let rig = Rig::with(&Arc::default());
    let one = fit(1, 1);
    let others = [
        StudyResult { data: json!({ "samples_crc32": 7 }), ..one.clone() },
        StudyResult { settings: json!({ "fixed": ["mu2"] }), ..one.clone() },
        StudyResult { software_version: "2".into(), ..one.clone() },
        StudyResult { model: "prony-2".into(), ..one.clone() },
        fit(2, 1),
        // The same computation by another computer.
        fit(1, 2),
        one,
    ];
    assert_eq!(add(&rig, &others).unwrap(), ResultsOutcome { added: 6, known: 1 });
    assert_eq!(verified(&rig).objects.len(), 6);
}

#[test]
fn a_flipped_byte_of_a_result_is_found() {
    let objects: Arc<InMemory> = Arc::default();
    let rig = Rig::with(&objects);
    add(&rig, &[fit(1, 1)]).unwrap();
    let content = verified(&rig).objects.into_values().next().unwrap();
    let snapshot = rig.store.wait(table(&rig).snapshot()).unwrap().unwrap();
    let part = table(&rig).path(snapshot.parts.keys().next().unwrap());
    for path in [crate::files::object_path(&content), part] {
        let whole = rig.store.wait(rig.store.read(&path)).unwrap().unwrap();
        for at in 0..whole.len() {
            let mut bytes = whole.to_vec();
            bytes[at] ^= 0x10;
            rig.store.wait(objects.put(&path, bytes.into())).unwrap();
            let found = rig.store.verify(true, &mut go_on).unwrap();
            assert!(!found.faults.is_empty(), "byte {at} of {path}");
        }
        rig.store.wait(objects.put(&path, whole.into())).unwrap();
    }
    assert_eq!(rig.store.verify(true, &mut go_on).unwrap().faults, []);
}
