//! A hold that ends when the live fit knows enough: through the runner, and again in replay.
use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_model::rig::Phase;
use palpate_model::units::{Depth, MmPerS, Seconds};
use palpate_protocols::engine::Record;
use palpate_protocols::plans::{BodyParameter, HoldUntil, RampHold};
use palpate_rheology::fit::{FitOptions, LiveFit, fit};
use palpate_runner::replay::replay;
use palpate_sessions::{EntryKind, Session};
use palpate_tests::recorded_runs;
use serde_json::json;

/// A run with a rule for tau, up to 20 s of hold, and its session.
fn run_until(relative: f64) -> Session {
    let rig = SimRig::new(SimSettings::default());
    let params = RampHold {
        speed: MmPerS(3.0),
        depth: Depth(12.0),
        hold: Seconds(20.0),
        until: Some(HoldUntil::new(BodyParameter::TauEps, relative)),
        ..RampHold::default()
    };
    let calibration = rig.calibration();
    let session = recorded_runs::record_ramp_hold(Box::new(rig), calibration, params);
    assert_eq!(session.end.as_ref().unwrap().outcome, "finish");
    session
}

fn held_secs(session: &Session) -> f64 {
    let held = session.rows.iter().filter(|row| row.phase == Phase::Hold);
    held.count() as f64 * session.manifest.tick().0
}

fn early_ends(session: &Session) -> Vec<Record> {
    let decisions = session.entries.iter();
    decisions
        .filter(|entry| entry.kind == EntryKind::Decision)
        .filter(|entry| entry.body["record"] == "hold_ended_early")
        .map(|entry| serde_json::from_value(entry.body.clone()).unwrap())
        .collect()
}

#[test]
fn a_hold_ends_early_with_its_reason_and_replays_exactly() {
    let mut session = run_until(0.0005);
    let held = held_secs(&session);
    let ends = early_ends(&session);
    let [Record::HoldEndedEarly { relative, held: at, .. }] = ends[..] else {
        panic!("{ends:?}");
    };
    println!("ended after {held:.3} s at {relative:.4}");
    assert!(relative <= 0.0005, "{relative}");
    assert!((5.0..19.0).contains(&held), "{held}");
    // It ends with the sample after the answer.
    assert!((at.0 - held).abs() < 0.01, "{at:?} {held}");
    let report = replay(&session, &[]).unwrap();
    assert_eq!(report.first_difference, None);

    // The decision comes from the recorded answer: without it the hold would go on.
    let place = session.entries.iter().rposition(|entry| entry.kind == EntryKind::Fit).unwrap();
    session.entries[place].body["parameters"][0]["ci95"] = json!([0.5, 1.5]);
    let difference = replay(&session, &[]).unwrap().first_difference.unwrap();
    // The first thing seen is a sample that the recording counts to the retract.
    assert_eq!((difference.what.as_str(), difference.now), ("phase", json!("hold")));
}

#[test]
fn a_rule_that_cannot_be_met_holds_the_whole_time() {
    let session = run_until(1e-6);
    assert_eq!(early_ends(&session), []);
    let held = held_secs(&session);
    assert!((held - 20.0).abs() < 0.01, "{held}");
    assert_eq!(replay(&session, &[]).unwrap().first_difference, None);
}

#[test]
fn a_changed_verdict_or_standard_error_is_noticed() {
    let session = run_until(0.0005);
    let place = session.entries.iter().rposition(|entry| entry.kind == EntryKind::Fit).unwrap();
    for (pointer, value) in [
        ("/verdicts/0/is_identified", json!(false)),
        ("/verdicts/1/reason", json!("because")),
        ("/parameters/2/std_error", json!(1.0)),
    ] {
        let mut changed = session.clone();
        let body = &mut changed.entries[place].body;
        if let Some(slot) = body.pointer_mut(pointer) {
            *slot = value;
        } else {
            body["verdicts"][1]["reason"] = value;
        }
        let difference = replay(&changed, &[]).unwrap().first_difference.unwrap();
        assert_eq!(difference.what, "live fit", "{pointer}");
    }
}

#[test]
fn the_last_live_answer_is_the_fit_of_a_run_on_the_lab_rig() {
    let params = RampHold {
        speed: MmPerS(3.0),
        depth: Depth(12.0),
        hold: Seconds(2.0),
        ..RampHold::default()
    };
    let settings = SimSettings { seed: 11, ..SimSettings::default() };
    let run = palpate_tests::simulated::run(settings, params);
    let mut live = LiveFit::new(params.depth);
    for sample in &run.samples {
        live.push(sample.t, sample.depth, sample.force, sample.sigma);
    }
    let live = live.estimate().unwrap();
    let exact = fit(&run.samples, &FitOptions::default()).unwrap();
    assert_eq!(live.parameters.len(), 7);
    for parameter in &live.parameters {
        let same = exact.parameter(&parameter.name).unwrap();
        let error = same.std_error.unwrap();
        let miss = (parameter.value - same.value).abs() / error;
        println!("{} {miss:.1e} {:.3}", same.name, parameter.std_error.unwrap() / error);
        assert!(miss < 0.01, "{}: {miss} standard errors", same.name);
    }
}
