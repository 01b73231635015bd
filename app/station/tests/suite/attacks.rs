//! What an attacker on the network can try: `docs/station-threats.md` names each of these tests.

use super::client::{Lab, connect, exchange, next, ramp_hold, request, rig};
use palpate_analysis::station_settings::{StationSettings, TOKENS_FILE, TlsFiles};
use palpate_runner::{Runner, RunnerRequest, TimeScale};
use palpate_sessions::Session;
use palpate_station::{Station, StationError};
use palpate_test_support::record::Noise;
use palpate_test_support::wait::until;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::sync::mpsc::sync_channel;
use std::time::Duration;

#[test]
fn a_page_of_another_site_can_do_nothing() {
    let lab = Lab::new(TimeScale::Factor(1.0));
    lab.start(3600.0);
    let own = format!("Origin: http://{}", lab.address());
    for (headers, words) in [
        (&["Origin: http://evil.example"][..], "another site"),
        (&["Origin: null"], "another site"),
        (&["Origin: https://127.0.0.1"], "another site"),
        (&[own.as_str(), "Origin: http://evil.example"], "another site"),
        // A name of the attacker that resolves to this computer.
        (&["Host: evil.example"], "not called"),
        (&["Host: evil.example", "Origin: http://evil.example"], "not called"),
    ] {
        for (method, path) in [("POST", "/api/v1/stop"), ("GET", "/api/v1/state"), ("GET", "/")] {
            let answer = lab.ask(method, path, headers, "");
            assert_eq!(answer.status, 403, "{headers:?} {method} {path}");
            assert!(answer.error().contains(words), "{answer:?}");
            assert!(!answer.head.contains("access-control-allow-origin"));
        }
    }
    // A browser asks before it sends a header of ours; it gets no permission.
    let asked = lab.ask("OPTIONS", "/api/v1/stop", &["Origin: http://evil.example"], "");
    assert_eq!(asked.status, 403);
    // A form of another site cannot say where it comes from either: browsers always add the origin to a POST.
    assert_eq!(lab.ask("POST", "/api/v1/stop", &[&own], "").status, 200);
}

#[test]
fn wrong_tokens_are_slowed_down_and_right_ones_are_not() {
    let lab = Lab::at("0.0.0.0:0", TimeScale::Max, true);
    let token = palpate_station::tokens::Tokens::add(
        lab.library.path(),
        "phone",
        &[palpate_station::tokens::Scope::Watch],
        String::new(),
    )
    .unwrap();
    let with = |token: &str| {
        lab.ask("GET", "/api/v1/state", &[&format!("Authorization: Bearer {token}")], "").status
    };
    let statuses: Vec<u16> = (0..30).map(|_| with("wrong")).collect();
    assert_eq!(statuses[0], 401);
    assert!(statuses.contains(&429), "{statuses:?}");
    assert!(statuses.iter().all(|status| [401, 429].contains(status)));
    assert_eq!(with(&token), 200);
}

#[test]
fn other_computers_need_tls_or_a_decision() {
    let library = tempfile::tempdir().unwrap();
    let runner = Runner::start(Box::new(rig()), TimeScale::Max, None, || ()).unwrap();
    let plain = StationSettings {
        address: "0.0.0.0:0".parse().unwrap(),
        tls: None,
        is_plain_allowed: false,
        names: Vec::new(),
        library: library.path().to_owned(),
    };
    let start = |settings: &StationSettings| Station::start(settings, runner.handle(), None).err();
    assert!(matches!(start(&plain), Some(StationError::Plain { .. })));
    let file = library.path().join("empty.pem");
    std::fs::write(&file, "nothing").unwrap();
    let tls = TlsFiles { certificate: file.clone(), key: file };
    let wrong = StationSettings { tls: Some(tls), ..plain };
    assert!(matches!(start(&wrong), Some(StationError::Tls { .. })));
}

#[test]
fn a_flood_of_stops_leaves_the_operators_own_a_place() {
    let lab = Lab::new(TimeScale::Factor(1.0));
    lab.start(3600.0);
    let statuses: Vec<u16> =
        (0..100).map(|_| lab.ask("POST", "/api/v1/stop", &[], "").status).collect();
    assert_eq!(statuses[0], 200);
    assert!(statuses.contains(&429), "{statuses:?}");
    lab.runner.request(RunnerRequest::Note("from the window".into())).unwrap();
}

/// Samples of a session, to compare two runs.
fn samples(folder: &Path) -> Vec<String> {
    let session = Session::open(folder).unwrap();
    session.rows.iter().map(|sample| format!("{sample:?}")).collect()
}

/// Nonsense of every kind on one connection.
fn attack(draw: &mut Noise, address: std::net::SocketAddr) {
    let mut pick = |count: f64| (draw.uniform() * count) as usize;
    let kind = pick(8.0);
    let filler = pick(4000.0);
    let noise: Vec<u8> = (0..filler).map(|_| pick(256.0) as u8).collect();
    let host = format!("Host: {address}\r\n");
    let text = match kind {
        // Cut in the middle of a head, or of a body.
        0 => format!("GET /api/v1/state HTTP/1.1\r\n{host}"),
        1 => format!("POST /api/v1/remote/runs HTTP/1.1\r\n{host}Content-Length: 9999\r\n\r\n{{"),
        // A head without an end, a body beyond every limit, lengths that contradict each other.
        2 => format!("GET / HTTP/1.1\r\n{host}{}", "X-Filler: x\r\n".repeat(2 * filler)),
        3 => format!(
            "POST /api/v1/remote/runs HTTP/1.1\r\n{host}Content-Type: application/json\r\nContent-Length: 99999999\r\n\r\n{}",
            "[".repeat(20 * filler)
        ),
        4 => format!(
            "POST /api/v1/stopp HTTP/1.1\r\n{host}Content-Length: 3\r\nContent-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\nxyz"
        ),
        // A WebSocket that sends what no watcher has to say.
        5 => format!(
            "GET /api/v1/live HTTP/1.1\r\n{host}Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        ),
        6 => format!(
            "GET /api/v1/sessions?limit={filler}&skip=-1 HTTP/1.1\r\n{host}Connection: close\r\n\r\n"
        ),
        _ => String::new(),
    };
    let Ok(mut stream) = TcpStream::connect(address) else { return };
    // The station may close first; that is its right.
    let _ = stream.write_all(text.as_bytes());
    let _ = stream.write_all(&noise);
    if kind == 6 {
        let _ = stream.set_read_timeout(Some(Duration::from_millis(200)));
        let _ = stream.read(&mut [0; 64]);
    }
}

/// The oracle: the simulated rig gives the same session from the same seed, whatever happens around it, unless something
/// reaches it.
#[test]
fn a_thousand_broken_connections_leave_the_run_as_it_would_have_been() {
    let quiet = tempfile::tempdir().unwrap();
    let out = quiet.path().join("run");
    let (reply, answer) = sync_channel(1);
    let request_to = RunnerRequest::Run(Box::new(ramp_hold(&out, 20.0)), reply);
    let runner = Runner::start(Box::new(rig()), TimeScale::Max, Some(request_to), || ()).unwrap();
    answer.recv().unwrap().unwrap();
    let is_over = |runner: &Runner| {
        runner.snapshot().run.as_ref().is_some_and(|run| run.outcome.is_some()).then_some(())
    };
    until(|| is_over(&runner), || "the quiet run has not ended".into());

    let library = tempfile::tempdir().unwrap();
    let folder = library.path().join("run");
    let (reply, answer) = sync_channel(1);
    let first = RunnerRequest::Run(Box::new(ramp_hold(&folder, 20.0)), reply);
    let runner =
        Runner::start(Box::new(rig()), TimeScale::Factor(10.0), Some(first), || ()).unwrap();
    answer.recv().unwrap().unwrap();
    let settings = StationSettings {
        address: "127.0.0.1:0".parse().unwrap(),
        tls: None,
        is_plain_allowed: false,
        names: Vec::new(),
        library: library.path().to_owned(),
    };
    let station = Station::start(&settings, runner.handle(), None).unwrap();
    // Watchers that read nothing.
    let deaf: Vec<TcpStream> = (0..20)
        .map(|_| {
            let mut stream = connect(station.address());
            let host = station.address();
            let head = format!(
                "GET /api/v1/live?per_second=10 HTTP/1.1\r\nHost: {host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
            );
            stream.write_all(head.as_bytes()).unwrap();
            stream
        })
        .collect();
    let mut draw = Noise::seeded(30);
    for _ in 0..1000 {
        attack(&mut draw, station.address());
    }
    until(|| is_over(&runner), || "the attacked run has not ended".into());
    drop(deaf);
    assert!(runner.is_alive());
    assert_eq!(samples(&folder), samples(&out));
    // And the station still serves whoever asks properly.
    let state = until(
        || exchange_state(station.address()),
        || "the station does not answer any more".into(),
    );
    assert_eq!(state, "finish");
}

fn exchange_state(address: std::net::SocketAddr) -> Option<String> {
    let head =
        format!("GET /api/v1/state HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
    let answer = exchange(address, head.as_bytes()).filter(|answer| answer.status == 200)?;
    Some(answer.json()["run"]["outcome"]["ending"].as_str()?.to_owned())
}

#[test]
fn a_watcher_that_talks_is_sent_away() {
    let lab = Lab::new(TimeScale::Factor(1.0));
    let mut socket = lab.watch("/api/v1/live", "palpate.v1").unwrap();
    next(&mut socket).unwrap();
    let long = tungstenite::Message::Text("x".repeat(100_000).into());
    let _ = socket.send(long);
    until(|| next(&mut socket).is_none().then_some(()), || "it watches on".into());
    // 64 watchers and no more.
    let sockets: Vec<_> = (0..80).map_while(|_| lab.watch("/api/v1/live", "").ok()).collect();
    assert!(sockets.len() <= 64, "{}", sockets.len());
    drop(sockets);
    until(
        || {
            (request(lab.address(), "GET", "/api/v1/health", &[], "").json()["watchers"] == 0)
                .then_some(())
        },
        || "places are not given back".into(),
    );
}

/// A pipe that no one writes to answers as a network disk that has gone.
#[test]
#[cfg(unix)]
fn a_disk_that_does_not_answer_makes_no_stop_wait() {
    let lab = Lab::new(TimeScale::Factor(1.0));
    let tokens = lab.library.path().join(TOKENS_FILE);
    let made = std::process::Command::new("mkfifo").arg(&tokens).status().unwrap();
    assert!(made.success());
    let mut waiting = connect(lab.address());
    let asked = format!(
        "GET /api/v1/state HTTP/1.1\r\nHost: {}\r\nAuthorization: Bearer {}\r\n\r\n",
        lab.address(),
        "f".repeat(64)
    );
    waiting.write_all(asked.as_bytes()).unwrap();
    assert_eq!(lab.get("/api/v1/health").status, 200);
    assert_eq!(lab.ask("POST", "/api/v1/stop", &[], "").status, 200);
}
