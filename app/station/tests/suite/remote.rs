//! Runs over the network: of a queue that a person at the rig has armed, and of nothing else.

use super::client::{Answer, Lab};
use palpate_drivers::sim::SimSettings;
use palpate_runner::TimeScale;
use palpate_sessions::Session;
use palpate_station::remote::RemoteQueue;
use palpate_station::tokens::{Scope, Tokens};
use palpate_test_support::wait::until;
use serde_json::{Value, json};
use std::time::Duration;

const QUEUE: &str = "format = \"palpate-remote-queue 1\"\nname = \"speeds\"\nprotocol = \"ramp-hold\"\nruns = 3\n\
    [labels]\nspecimen = \"gel 7\"\n[set]\ndepth = \"6 mm\"\nhold = \"20 s\"\n\
    [choose.speed]\nfrom = \"0.6 mm/s\"\nto = \"7.8 mm/s\"\n";

/// A lab with a token that may ask for runs.
fn lab(scale: TimeScale) -> (Lab, String) {
    let lab = Lab::new(scale);
    let token = token(&lab);
    (lab, token)
}

fn token(lab: &Lab) -> String {
    let all = [Scope::Watch, Scope::Stop, Scope::Run];
    let token = Tokens::add(lab.library.path(), "search", &all, String::new()).unwrap();
    format!("Authorization: Bearer {token}")
}

fn arm(lab: &Lab, text: &str) {
    let file = lab.library.path().join("queue.toml");
    std::fs::write(&file, text).unwrap();
    let queue = RemoteQueue::read(&file, Some(lab.library.path())).unwrap();
    lab.station.arm(queue, Duration::from_hours(1)).unwrap();
}

fn ask(lab: &Lab, token: &str, speed: &str) -> Answer {
    let body = json!({ "queue": "speeds", "values": { "speed": speed }, "remark": "a test" });
    lab.ask("POST", "/api/v1/remote/runs", &[token], &body.to_string())
}

fn ended(lab: &Lab, token: &str, id: &Value) -> Value {
    until(
        || {
            let path = format!("/api/v1/remote/runs/{id}?wait_s=5");
            let run = lab.ask("GET", &path, &[token], "").json();
            let is_over = !run["fit"].is_null()
                || ["refused", "withdrawn"].map(Value::from).contains(&run["state"]);
            is_over.then_some(run)
        },
        || "the run is not over".into(),
    )
}

#[test]
fn a_program_asks_and_gets_the_fit() {
    let (lab, token) = lab(TimeScale::Max);
    let refusal = ask(&lab, &token, "3 mm/s");
    assert_eq!(refusal.status, 409);
    assert!(refusal.error().contains("a person at the rig must arm one"));
    arm(&lab, QUEUE);
    // Without a token no one starts anything, not even on this computer.
    assert_eq!(ask(&lab, "X-Nothing: 1", "3 mm/s").status, 403);
    // The last is between two speeds of the motor.
    for wrong in ["9 mm/s", "0 mm/s", "fast", "3.01 mm/s"] {
        let answer = ask(&lab, &token, wrong);
        assert_eq!(answer.status, 400, "{wrong}: {answer:?}");
    }
    let asked = ask(&lab, &token, "3 mm/s");
    assert_eq!(asked.status, 201, "{asked:?}");
    let run = ended(&lab, &token, &asked.json()["id"]);
    assert_eq!((&run["state"], &run["ending"]), (&json!("ended"), &json!("finish")), "{run}");
    let parameters = run["fit"]["parameters"].as_array().unwrap();
    let stiffness = parameters.iter().find(|one| one["name"] == "mu1").unwrap();
    assert!(stiffness["std_error"].as_f64().unwrap() > 0.0, "{stiffness}");
    // The session says who asked, with what, and has the labels of the queue.
    let folder = lab.library.path().join("sessions").join(run["session"].as_str().unwrap());
    let session = Session::open(&folder).unwrap();
    assert_eq!(session.manifest.labels().specimen, "gel 7");
    let log = format!("{session:?}");
    assert!(log.contains("asked for over the network by 'search' (speed = 3 mm/s): a test"));
}

#[test]
fn a_stop_takes_the_arming_back() {
    let (lab, token) = lab(TimeScale::Factor(1.0));
    arm(&lab, QUEUE);
    let first = ask(&lab, &token, "3 mm/s").json();
    let second = ask(&lab, &token, "4.5 mm/s").json();
    until(
        || lab.runner.snapshot().run.as_ref().map(|_| ()),
        || "the first run does not begin".into(),
    );
    assert_eq!(lab.ask("POST", "/api/v1/stop", &[], "").status, 200);
    let first = ended(&lab, &token, &first["id"]);
    assert_eq!(first["ending"], "stop");
    let second = ended(&lab, &token, &second["id"]);
    assert_eq!(second["state"], "withdrawn");
    let state = lab.get("/api/v1/remote").json();
    assert!(state["armed"].is_null());
    assert!(state["disarmed"].as_str().unwrap().contains("stop over the network"));
    assert_eq!(ask(&lab, &token, "3 mm/s").status, 409);
}

#[test]
fn a_run_that_fails_takes_the_arming_back() {
    // Ten times as stiff as the preview expects.
    let stiff = SimSettings { stiffness: "1000".parse().unwrap(), ..SimSettings::default() };
    let lab = Lab::with("127.0.0.1:0", TimeScale::Max, false, stiff);
    let token = token(&lab);
    arm(&lab, QUEUE);
    let asked = ask(&lab, &token, "3 mm/s").json();
    let run = ended(&lab, &token, &asked["id"]);
    assert_eq!(run["ending"], "abort", "{run}");
    let state = lab.get("/api/v1/remote").json();
    assert!(state["armed"].is_null());
    assert!(state["disarmed"].as_str().unwrap().contains("ended by abort"), "{state}");
    assert_eq!(ask(&lab, &token, "3 mm/s").status, 409);
}

#[test]
fn bodies_that_are_no_request_are_refused() {
    let (lab, token) = lab(TimeScale::Max);
    arm(&lab, QUEUE);
    for body in [
        "{",
        "[]",
        "{\"queue\": 3}",
        "{\"queue\": \"speeds\", \"value\": {}}",
        "{\"queue\": \"speeds\"}",
        "{\"queue\": \"speeds\", \"values\": {}}",
        "{\"queue\": \"speeds\", \"values\": {\"speed\": 3}}",
        "{\"queue\": \"speeds\", \"values\": {\"depth\": \"2 mm\"}}",
        "{\"queue\": \"speeds\", \"values\": {\"limits.force_max\": \"900 N\"}}",
    ] {
        let answer = lab.ask("POST", "/api/v1/remote/runs", &[&token], body);
        assert!([400, 422].contains(&answer.status), "{body}: {answer:?}");
        assert!(!answer.error().is_empty());
    }
    let long = format!("{{\"queue\": \"{}\"}}", "x".repeat(100_000));
    assert_eq!(lab.ask("POST", "/api/v1/remote/runs", &[&token], &long).status, 413);
    assert!(lab.runner.snapshot().run.is_none(), "nothing was started");
}
