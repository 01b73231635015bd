//! Recorded sessions give the same decisions, and a difference is found where it is.
use palpate_model::Nanos;
use palpate_runner::RunView;
use palpate_runner::replay::{Blessing, Player, blessings_of, replay};
use palpate_sessions::{EntryKind, Session};
use palpate_tests::workspace;
use serde_json::json;
use std::path::PathBuf;

fn recorded() -> Vec<PathBuf> {
    let mut folders: Vec<PathBuf> = std::fs::read_dir(workspace().join("tests/sessions"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_dir())
        .collect();
    folders.sort();
    assert!(folders.len() >= 2, "{folders:?}");
    folders
}

fn open(name: &str) -> Session {
    Session::open(&workspace().join("tests/sessions").join(name)).unwrap()
}

#[test]
fn every_recorded_session_replays() {
    for folder in recorded() {
        let note = std::fs::read_to_string(folder.join("README.md")).unwrap();
        assert!(note.starts_with("Why: "), "{} does not say why it exists", folder.display());
        let session = Session::open(&folder).unwrap();
        let report = replay(&session, &blessings_of(&folder).unwrap()).unwrap();
        assert_eq!(report.first_difference, None, "{}", folder.display());
        assert_eq!(report.samples, session.end.unwrap().samples);
        assert!(report.decisions > 20);
    }
}

#[test]
fn a_changed_decision_is_found_where_it_is() {
    let mut session = open("over-force-galil");
    let is_contact = |body: &serde_json::Value| body["record"] == "contact_found";
    let place = session.entries.iter().position(|entry| is_contact(&entry.body)).unwrap();
    session.entries[place].body["position"] = json!(39.0);
    let decisions = session.entries[..place].iter();
    let index = decisions.filter(|entry| entry.kind == EntryKind::Decision).count();
    let report = replay(&session, &[]).unwrap();
    let difference = report.first_difference.unwrap();
    assert_eq!((difference.what.as_str(), difference.decision), ("decision", Some(index)));
    assert_eq!(difference.at_s, session.entries[place].now.seconds().0);
    assert_eq!(difference.recorded["position"], 39.0);

    // Blessed with its reason the difference is accepted, and only that one.
    let reason = "the position was rounded by hand".to_owned();
    let blessing = Blessing { decision: index, now: difference.now.clone(), reason };
    let report = replay(&session, &[blessing]).unwrap();
    assert_eq!((report.first_difference, report.blessed), (None, 1));
}

#[test]
fn a_changed_raw_sample_changes_what_is_derived() {
    let mut session = open("hold-until-lab");
    let place = session
        .rows
        .iter()
        .position(|row| row.depth == Some(0.0) || row.depth > Some(5.0))
        .unwrap();
    session.rows[place].volts = session.rows[place].volts.map(|volts| volts + 1e-6);
    let difference = replay(&session, &[]).unwrap().first_difference.unwrap();
    assert_eq!((difference.what.as_str(), difference.after_sample), ("force_N", place as u64));

    let mut session = open("hold-until-lab");
    session.rows[place].pulses = session.rows[place].pulses.map(|pulses| pulses + 3);
    let difference = replay(&session, &[]).unwrap().first_difference.unwrap();
    assert_eq!(difference.what, "decision", "three lost pulses trip the path interlock");
}

#[test]
fn a_changed_input_is_noticed() {
    let mut session = open("ramp-hold-lab");
    let fit = session.entries.iter_mut().rfind(|entry| entry.kind == EntryKind::Fit).unwrap();
    let value = fit.body["parameters"][0]["value"].as_f64().unwrap();
    fit.body["parameters"][0]["value"] = json!(value * 1.01);
    assert_eq!(replay(&session, &[]).unwrap().first_difference.unwrap().what, "live fit");

    let mut session = open("ramp-hold-lab");
    let stop = palpate_sessions::LogEntry {
        kind: EntryKind::Input,
        order: session.entries.last().unwrap().order + 1,
        after_sample: 50_000,
        now: Nanos(session.rows[49_999].host.0),
        body: json!({ "input": "operator", "choice": "stop" }),
    };
    let place = session.entries.iter().position(|entry| entry.after_sample > 50_000).unwrap();
    session.entries.insert(place, stop);
    assert!(replay(&session, &[]).unwrap().first_difference.is_some());
}

#[test]
fn decisions_of_another_engine_are_not_compared_but_numbers_are() {
    let mut session = open("ramp-hold-lab");
    session.manifest.engine_version = 0;
    let place = session.entries.iter().position(|entry| entry.kind == EntryKind::Decision).unwrap();
    session.entries[place].body = json!({ "effect": "record", "record": "of another time" });
    let report = replay(&session, &[]).unwrap();
    assert_eq!((report.is_same_engine, report.first_difference), (false, None));
    session.rows[60_000].force = session.rows[60_000].force.map(|force| force + 1e-6);
    assert_eq!(replay(&session, &[]).unwrap().first_difference.unwrap().what, "force_N");
}

#[test]
fn an_interrupted_recording_replays_as_far_as_it_goes() {
    let mut session = open("ramp-hold-lab");
    session.rows.truncate(70_000);
    session.entries.retain(|entry| entry.after_sample < 69_990);
    session.end = None;
    let report = replay(&session, &[]).unwrap();
    assert_eq!(report.first_difference, None);
}

fn player(name: &str) -> Player {
    Player::new(open(name), PathBuf::from(name)).unwrap()
}

/// All that is shown of a run.
fn shown(player: &Player) -> String {
    let snapshot = player.snapshot(0).unwrap();
    format!("{:?} {:?}", snapshot.rig.reading, snapshot.run)
}

fn run_at(player: &mut Player, seconds: f64) -> RunView {
    assert!(player.go_to(Nanos::from_millis((1e3 * seconds) as u64), usize::MAX));
    player.snapshot(0).unwrap().run.unwrap()
}

#[test]
fn every_moment_is_the_same_however_it_is_reached() {
    for folder in recorded() {
        let name = folder.file_name().unwrap().to_str().unwrap();
        let mut wanderer = player(name);
        let end = wanderer.end().0;
        // Far jumps forth and back, beside a player that has never been anywhere else.
        for share in [0.9, 0.1, 0.55, 0.0, 1.0, 0.3, 0.31, 0.97, 0.02] {
            let time = Nanos((end as f64 * share) as u64);
            assert!(wanderer.go_to(time, usize::MAX));
            let mut straight = player(name);
            // In small pieces, as a window asks for them.
            while !straight.go_to(time, 777) {}
            assert_eq!(shown(&wanderer), shown(&straight), "{name} at {share}");
            assert!(wanderer.now() <= time, "{name} at {share}");
        }
    }
}

#[test]
fn a_played_session_shows_what_was_recorded() {
    let session = open("ramp-hold-lab");
    let mut player = player("ramp-hold-lab");
    for share in [0.2, 0.5, 0.8] {
        let row = &session.rows[(session.rows.len() as f64 * share) as usize];
        assert!(player.go_to(row.host, usize::MAX));
        let run = player.snapshot(0).unwrap().run.unwrap();
        let derived = run.derived;
        assert_eq!(run.phase, row.phase);
        for (shown, recorded) in [
            (derived.force.map(|force| force.0), row.force),
            (derived.depth.map(|depth| depth.0), row.depth),
        ] {
            assert_eq!(shown.is_some(), recorded.is_some());
            let apart = shown.unwrap_or(0.0) - recorded.unwrap_or(0.0);
            assert!(apart.abs() <= palpate_runner::replay::TOLERANCE_DERIVED);
        }
    }
    let end = session.end.unwrap();
    let run = run_at(&mut player, 1e6);
    assert_eq!(run.samples, end.samples);
    assert_eq!(run.outcome.unwrap().ending.name(), end.outcome);
    // Back at the start nothing is known any more, and nothing of the end is left over.
    let run = run_at(&mut player, 0.0);
    assert!(run.contact.is_none() && run.live.is_none() && run.force_peak.is_none());
    assert!(run.outcome.is_none() && run.samples <= 1, "{}", run.samples);
}

#[test]
fn a_difference_is_reported_in_the_words_of_the_protocol() {
    let mut session = open("over-force-galil");
    let is_contact = |body: &serde_json::Value| body["record"] == "contact_found";
    let entry = session.entries.iter_mut().find(|entry| is_contact(&entry.body));
    entry.unwrap().body["position"] = json!(39.0);
    let difference = replay(&session, &[]).unwrap().first_difference.unwrap();
    assert!(difference.step.contains("find-contact"), "{}", difference.step);
    assert!(difference.step.starts_with("step 4 of "), "{}", difference.step);
    let recorded = difference.recorded_words();
    assert!(recorded.starts_with("contact at 39.000 ± "), "{recorded}");
    let now = difference.now_words();
    assert!(now.starts_with("contact at ") && now != recorded, "{now}");
}
