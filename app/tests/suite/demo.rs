//! A library to try palpate with.

use crate::support::{answer, assert_refused, palpate, succeeded};

#[test]
fn demo_records_a_library_whose_sessions_are_found_valid_and_replay() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let made = answer(&palpate(at, &["demo", "library", "--json"]));
    let sessions: Vec<&str> = made["sessions"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| one["session"].as_str().unwrap())
        .collect();
    assert_eq!(sessions.len(), 12);
    // The library of `palpate` in tests is the folder of that name.
    let found = answer(&palpate(at, &["find", "--verdict", "valid", "--json"]));
    assert_eq!(found["count"], 12);
    // One of each protocol: all of them take several seconds.
    let mut words = vec!["replay", "--check"];
    words.extend([sessions[0], sessions[8], sessions[10], sessions[11]]);
    succeeded(&palpate(at, &words));
    assert_refused(&palpate(at, &["demo", "library"]), 2, "already has sessions");
}
