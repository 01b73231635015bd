//! Watching a run, and stopping it.

use super::client::{Lab, next};
use palpate_runner::TimeScale;
use palpate_sessions::Session;
use palpate_station::tokens::{Scope, Tokens};
use palpate_test_support::wait::until;
use serde_json::Value;

fn outcome(lab: &Lab) -> Option<String> {
    let snapshot = lab.runner.snapshot();
    let outcome = snapshot.run.as_ref()?.outcome.clone()?;
    Some(outcome.ending.name().to_owned())
}

#[test]
fn a_watcher_sees_a_run_from_start_to_end() {
    let lab = Lab::new(TimeScale::Factor(20.0));
    let mut socket = lab.watch("/api/v1/live?per_second=10", "palpate.v1").unwrap();
    let first = next(&mut socket).unwrap();
    assert_eq!((first["format"].as_u64(), &first["run"]), (Some(1), &Value::Null));
    assert_eq!(first["rig"]["name"], "sim");
    lab.start(5.0);
    let (mut sequence, mut largest, mut curve) = (0, 0, 0);
    let fraction = loop {
        let message = next(&mut socket).unwrap();
        let new = message["sequence"].as_u64().unwrap();
        assert!(new > sequence, "messages come in order");
        sequence = new;
        largest = largest.max(message.to_string().len());
        if message["run"].is_null() {
            continue;
        }
        if let Some(forces) = message["curve"]["force_n"].as_array() {
            curve = forces.len();
        }
        if !message["run"]["outcome"].is_null() {
            assert_eq!(message["run"]["outcome"]["ending"], "finish");
            break message["run"]["fraction"].as_f64().unwrap();
        }
    };
    assert!(curve > 100 && fraction == 1.0, "{curve} points, {fraction}");
    assert!(largest < 64 * 1024, "a message of {largest} bytes");
    // The same as lists.
    let state = lab.get("/api/v1/state").json();
    assert_eq!(state["run"]["outcome"]["ending"], "finish");
    assert!(state["run"]["estimate"].as_array().unwrap().len() >= 5);
    assert_eq!(lab.get("/api/v1/curve").json()["t_s"].as_array().unwrap().len(), curve);
    let events = lab.get("/api/v1/events?limit=3").json();
    assert_eq!(events["events"].as_array().unwrap().len(), 3);
}

#[test]
fn a_stop_ends_the_run_and_is_in_its_session() {
    let lab = Lab::new(TimeScale::Factor(1.0));
    let folder = lab.start(3600.0);
    let answer = lab.ask("POST", "/api/v1/stop", &[], "");
    assert_eq!(answer.status, 200, "{answer:?}");
    assert!(answer.json()["remark"].as_str().unwrap().contains("best effort"));
    until(|| outcome(&lab), || format!("{:?}", lab.get("/api/v1/state")));
    assert_eq!(outcome(&lab).as_deref(), Some("stop"));
    let session = Session::open(&folder).unwrap();
    let log = format!("{:?}", session);
    assert!(log.contains("stop over the network by a program on this computer"), "audit");
}

#[test]
fn health_page_and_document_need_no_token() {
    let strict = Lab::at("0.0.0.0:0", TimeScale::Max, true);
    for path in ["/api/v1/health", "/api/v1/openapi.json", "/"] {
        assert_eq!(strict.get(path).status, 200, "{path}");
    }
    let lab = Lab::new(TimeScale::Max);
    assert!(lab.get("/api/v1/health").json()["is_runner_alive"].as_bool().unwrap());
    let document = lab.get("/api/v1/openapi.json").json();
    for (path, kind) in [
        ("/", "text/html"),
        ("/station.js", "text/javascript"),
        ("/station.css", "text/css"),
        ("/icon.svg", "image/svg+xml"),
    ] {
        let answer = lab.get(path);
        assert_eq!(answer.status, 200, "{path}");
        for line in [
            kind,
            "content-security-policy: default-src 'self'",
            "x-frame-options: deny",
            "nosniff",
        ] {
            assert!(answer.head.contains(line), "{path}: {}", answer.head);
        }
        let foreign = ["https://", "http://", "//cdn"]
            .iter()
            .filter(|what| path != "/icon.svg" && answer.body.contains(**what));
        assert_eq!(foreign.count(), 0, "{path} loads nothing from elsewhere");
    }
    // Every address of the document is there, and answers with what it says it may.
    let paths = document["paths"].as_object().unwrap();
    assert!(paths.len() >= 10);
    for (path, methods) in paths {
        for method in methods.as_object().unwrap().keys() {
            let path = path.replace("{id}", "1");
            let answer = lab.ask(&method.to_uppercase(), &path, &[], "");
            let known = &methods[method]["responses"][answer.status.to_string()];
            assert!(!known.is_null(), "{method} {path} answers {}", answer.status);
        }
    }
    for path in ["/api/v1/", "/../etc/passwd", "/api/v1/sessions/../../x", "/station.js/x"] {
        assert_eq!(lab.get(path).status, 404, "{path}");
    }
    assert_eq!(lab.ask("PUT", "/api/v1/stop", &[], "").status, 405);
}

#[test]
fn sessions_and_queue_are_listed() {
    let lab = Lab::new(TimeScale::Max);
    lab.start(1.0);
    until(|| outcome(&lab), || "the run has not ended".into());
    let listed = lab.get("/api/v1/sessions").json();
    assert_eq!(listed["sessions"][0]["ending"], "finish", "{listed}");
    assert_eq!(listed["sessions"][0]["folder"], "run");
    assert_eq!(lab.get("/api/v1/sessions?limit=0").status, 400);
    assert_eq!(lab.get("/api/v1/sessions?limit=a").status, 400);
    assert_eq!(lab.get("/api/v1/queue").json()["specimens"].as_array().unwrap().len(), 0);
}

#[test]
fn scopes_are_kept_and_a_removed_token_is_cut_off() {
    let lab = Lab::at("0.0.0.0:0", TimeScale::Factor(1.0), true);
    let library = lab.library.path();
    let add =
        |name: &str, scopes: &[Scope]| Tokens::add(library, name, scopes, String::new()).unwrap();
    let (watch, stop) = (add("screen", &[Scope::Watch]), add("button", &[Scope::Stop]));
    let with = |method: &str, path: &str, token: &str| {
        lab.ask(method, path, &[&format!("Authorization: Bearer {token}")], "").status
    };
    for (method, path, statuses) in [
        ("GET", "/api/v1/state", [200, 403]),
        ("GET", "/api/v1/sessions", [200, 403]),
        ("GET", "/api/v1/remote", [200, 403]),
        ("POST", "/api/v1/stop", [403, 200]),
        ("POST", "/api/v1/remote/runs", [403, 403]),
        ("DELETE", "/api/v1/remote/runs/1", [403, 403]),
    ] {
        let found = [&watch, &stop].map(|token| with(method, path, token));
        assert_eq!(found, statuses, "{method} {path}");
        assert_eq!(lab.ask(method, path, &[], "").status, 401, "{method} {path} without one");
    }
    assert_eq!(with("GET", "/api/v1/state", &"f".repeat(64)), 401);
    assert_eq!(lab.watch("/api/v1/live", "palpate.v1").unwrap_err(), 401);
    let listed = |token: &str| format!("palpate.v1, palpate-token.{token}");
    assert_eq!(lab.watch("/api/v1/live", &listed(&stop)).unwrap_err(), 403);
    let mut socket = lab.watch("/api/v1/live", &listed(&watch)).unwrap();
    next(&mut socket).unwrap();
    Tokens::remove(library, "screen").unwrap();
    // Within a second, however many messages that are.
    until(|| next(&mut socket).is_none().then_some(()), || "it watches on".into());
    assert_eq!(with("GET", "/api/v1/state", &watch), 401);
}
