//! What older versions of palpate recorded: a session of every version opens, replays, is fitted and is tagged.

use crate::support::{answer, palpate, succeeded};
use palpate_sessions::RECORD_VERSION;
use palpate_sessions::log::Session;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Every version of the format that was ever released has a recorded session in `tests/sessions`. When `RECORD_VERSION`
/// rises, record a session with the new version and add it here; the old ones stay.
const RECORDED: [(u32, &str); 4] =
    [(1, "ramp-hold-lab"), (2, "every-motion"), (3, "sidecar-channels"), (4, "tracking-slave")];

fn sessions() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/sessions")
}

#[test]
fn every_record_version_has_a_recorded_session() {
    let versions: Vec<u32> = RECORDED.iter().map(|(version, _)| *version).collect();
    let all: Vec<u32> = (1..=RECORD_VERSION).collect();
    assert_eq!(versions, all, "a version of the format has no recorded session in the table");
    for (version, name) in RECORDED {
        let manifest = Session::open(&sessions().join(name)).unwrap().manifest;
        assert_eq!(manifest.record_version, version, "{name}");
    }
    // Each version of the engine that decided differently is there, too.
    let items = fs::read_dir(sessions()).unwrap().flatten().map(|item| item.path());
    let engines: BTreeSet<u32> = items
        .filter(|path| path.is_dir())
        .map(|path| Session::open(&path).unwrap().manifest.engine_version)
        .collect();
    let newest = engines.last().copied().unwrap();
    assert_eq!(engines, (1..=newest).collect());
}

#[test]
fn a_session_of_every_version_opens_replays_fits_and_takes_tags() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (version, name) in RECORDED {
        let copy = at.join("library/sessions").join(name);
        fs::create_dir_all(&copy).unwrap();
        for item in fs::read_dir(sessions().join(name)).unwrap().flatten() {
            fs::copy(item.path(), copy.join(item.file_name())).unwrap();
        }
        let log = fs::read(copy.join("000.mcap")).unwrap();
        let session = copy.to_str().unwrap();
        let info = answer(&palpate(at, &["info", session, "--json"]));
        assert_eq!(info["record_version"], version);
        succeeded(&palpate(at, &["replay", "--check", session]));
        let fit = answer(&palpate(at, &["fit", session, "--json", "--save", "now"]));
        assert!(fit["rmse_n"].as_f64().is_some_and(|rmse| rmse < 0.1), "{name}: {fit}");
        succeeded(&palpate(at, &["tag", session, "+seen"]));
        succeeded(&palpate(at, &["note", session, "--text", "opened by this version"]));
        succeeded(&palpate(at, &["doctor", session]));
        assert_eq!(fs::read(copy.join("000.mcap")).unwrap(), log, "{name}: the log was changed");
    }
    let found = answer(&palpate(at, &["find", "--tag", "seen", "--json"]));
    assert_eq!(found["count"], RECORDED.len());
}
