//! Runs of the simulated rig at full pace: exactly the expected notices arrive.

use crate::servers::{Reaction, WebServer};
use palpate_doubles::{FaultKind, FaultyRig, ScriptedFault};
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_model::Nanos;
use palpate_model::calibration::Calibration;
use palpate_model::metadata::SessionLabels;
use palpate_model::rig::Limits;
use palpate_model::units::{Depth, MmPerS, Seconds};
use palpate_notifications::{ANNOUNCED_FILE, NotificationSettings, Patience, RunNotices};
use palpate_protocols::plans::RampHold;
use palpate_runner::{AfterStop, PromptResponder, RunRequest, StartedRun, TimeScale, wall_now};
use serde_json::Value;
use std::path::Path;

fn run(rig: Box<dyn Rig>, calibration: Calibration, out: &Path, notices: &RunNotices) {
    let params = RampHold {
        speed: MmPerS(3.0),
        depth: Depth(12.0),
        hold: Seconds(2.0),
        ..RampHold::default()
    };
    notices.use_calibration(&calibration);
    let request = RunRequest {
        plan: params.plan(),
        calibration,
        limits: Limits::for_travel(rig.description().travel),
        out: Some(out.to_owned()),
        labels: SessionLabels {
            operator: "Ada".into(),
            specimen: "liver 7".into(),
            ..SessionLabels::default()
        },
        is_acknowledged: true,
        to_acknowledge: Vec::new(),
        after_stop: AfterStop::Close,
        answers: PromptResponder::Confirm,
        leader: None,
    };
    let started = StartedRun::start(rig, TimeScale::Max, request).unwrap();
    started.wait_for_start().unwrap();
    let ended = started.wait_for_end(|_| notices.see(&started.runner.snapshot())).unwrap();
    notices.see(&ended);
}

fn notices(server: &WebServer, library: &Path) -> RunNotices {
    let settings = NotificationSettings { targets: vec![server.target()] };
    RunNotices::start(settings, library, Patience::default()).unwrap()
}

/// Everything that arrived, in its order.
fn arrived(server: &WebServer) -> Vec<Value> {
    server.requests.try_iter().map(|request| request.object).collect()
}

fn kinds(objects: &[Value]) -> Vec<&str> {
    objects.iter().filter_map(|object| object["kind"].as_str()).collect()
}

#[test]
fn a_run_that_ends_and_one_that_trips_an_interlock_give_exactly_their_notices() {
    let library = tempfile::tempdir().unwrap();
    let server = WebServer::start(&[Reaction::Answer(200)]);
    let watch = notices(&server, library.path());
    let rig = SimRig::new(SimSettings::default());
    let calibration = rig.calibration();
    run(Box::new(rig), calibration.clone(), &library.path().join("first"), &watch);
    // Half a minute into the run the probe searches for the tissue.
    let fault = ScriptedFault::from(Nanos::from_millis(30_000), FaultKind::Disconnect);
    let faulty = FaultyRig::new(SimRig::new(SimSettings::default()), vec![fault], 5);
    run(Box::new(faulty), calibration, &library.path().join("second"), &watch);
    assert_eq!(watch.finish(), []);
    let objects = arrived(&server);
    // The first notice may wait for its connection while the others pass it.
    let mut kinds = kinds(&objects);
    kinds.sort_unstable();
    assert_eq!(kinds, ["alarm", "ended", "failed"], "{objects:?}");
    for object in &objects {
        let is_ended = object["kind"] == "ended";
        assert_eq!(object["session"], if is_ended { "first" } else { "second" });
        assert_eq!(object["outcome"], if is_ended { "finish" } else { "interlock" });
        assert_eq!((&object["rig"], &object["plan"]), (&"sim".into(), &"ramp-hold".into()));
        if !is_ended {
            assert!(object["reason"].as_str().unwrap().contains("link"), "{object}");
            assert_eq!(object["phase"], "contact");
        }
        // Neither who measured nor what, nor where it is kept.
        let text = object.to_string();
        let folder = library.path().display().to_string();
        for secret in ["Ada", "liver", folder.as_str()] {
            assert!(!text.contains(secret), "{secret} in {text}");
        }
    }
}

#[test]
fn a_calibration_that_expires_is_announced_once_by_all_programs_of_a_library() {
    let library = tempfile::tempdir().unwrap();
    let server = WebServer::start(&[Reaction::Answer(200)]);
    let rig = SimRig::new(SimSettings::default());
    let days_ago =
        |days| chrono::DateTime::<chrono::Utc>::from(wall_now()) - chrono::TimeDelta::days(days);
    let calibration = Calibration {
        taken_at: Some(days_ago(100).to_rfc3339()),
        valid_days: Some(110),
        ..rig.calibration()
    };
    let first = notices(&server, library.path());
    run(Box::new(rig), calibration.clone(), &library.path().join("first"), &first);
    assert_eq!(first.finish(), []);
    let objects = arrived(&server);
    let mut found = kinds(&objects);
    found.sort_unstable();
    assert_eq!(found, ["calibration", "ended"]);
    let calibrations: Vec<&Value> =
        objects.iter().filter(|one| one["kind"] == "calibration").collect();
    assert_eq!(calibrations[0]["days_left"], 10);
    assert!(library.path().join(ANNOUNCED_FILE).exists());
    let second = notices(&server, library.path());
    run(
        Box::new(SimRig::new(SimSettings::default())),
        calibration,
        &library.path().join("second"),
        &second,
    );
    assert_eq!(second.finish(), []);
    assert_eq!(kinds(&arrived(&server)), ["ended"]);
}
