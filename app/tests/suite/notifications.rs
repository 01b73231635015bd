//! Notifications as a user meets them.
#![cfg(all(feature = "notifications", unix))]

use crate::support::{
    answer, assert_refused, assert_says, json, short_run, stdout, succeeded, typed,
};
use serde_json::Value;
use std::fs::Permissions;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::sync::mpsc::{Receiver, sync_channel};

/// A web server that takes everything; its port and what it gets.
fn web_server() -> (u16, Receiver<Value>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let (sender, objects) = sync_channel(100);
    let serve = move || {
        for mut stream in listener.incoming().flatten() {
            let (mut text, mut piece) = (String::new(), [0; 4096]);
            while let Ok(count @ 1..) = stream.read(&mut piece) {
                text += &String::from_utf8_lossy(&piece[..count]);
                let object =
                    text.split_once("\r\n\r\n").map(|(_, rest)| serde_json::from_str(rest));
                if let Some(Ok(object)) = object {
                    sender.send(object).unwrap();
                    let _ = stream.write_all(b"HTTP/1.1 200 OK\r\ncontent-length: 0\r\n\r\n");
                    break;
                }
            }
        }
    };
    std::thread::Builder::new().name("web-server".into()).spawn(serve).unwrap();
    (port, objects)
}

/// Writes the settings, readable by their owner alone.
fn settings(at: &Path, text: &str) {
    let file = at.join("library/notifications.toml");
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    std::fs::write(&file, format!("palpate-notifications = 1\n{text}")).unwrap();
    std::fs::set_permissions(&file, Permissions::from_mode(0o600)).unwrap();
}

fn webhook(port: u16) -> String {
    format!("[[webhook]]\nurl = \"http://127.0.0.1:{port}/secret-path\"\n")
}

#[test]
fn settings_are_shown_tried_and_refused_with_their_lines() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    assert_refused(&typed(at, "notify --check"), 2, "notifications.toml");
    assert_refused(&typed(at, "notify"), 2, "--check");
    let (port, objects) = web_server();
    settings(at, &(webhook(port) + "when = [\"alarm\"]\n"));
    let shown = typed(at, "notify --check");
    succeeded(&shown);
    assert_eq!(stdout(&shown), "webhook at 127.0.0.1: alarm\n");
    let object = answer(&typed(at, "notify --check --json"));
    assert_eq!(object["targets"][0]["when"], serde_json::json!(["alarm"]));
    let tried = answer(&typed(at, "notify --test --json"));
    assert_eq!(
        (&tried["tests"][0]["arrived"], &tried["tests"][0]["way"]),
        (&true.into(), &"webhook".into())
    );
    assert_eq!(objects.recv().unwrap()["kind"], "test");
    // One of two is not there.
    let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    settings(at, &(webhook(port) + &webhook(free)));
    let tried = typed(at, "notify --test");
    assert_refused(&tried, 1, "1 of 2 targets");
    assert!(stdout(&tried).starts_with("webhook at 127.0.0.1: arrived\n"), "{}", stdout(&tried));
    assert!(!stdout(&tried).contains("secret-path"));
    settings(at, "[[webhook]]\nurl = \"chat\"\n");
    assert_refused(&typed(at, "notify --test"), 2, "notifications.toml, line 3");
    // What is wrong in the settings stops no run.
    let run = short_run(at, "first", &[]);
    succeeded(&run);
    assert_says(&run, "no notification is sent: notifications.toml, line 3");
}

#[test]
fn runs_and_programmes_send_what_became_of_them() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let (port, objects) = web_server();
    settings(at, &webhook(port));
    succeeded(&short_run(at, "first", &["--operator", "Ada"]));
    let ended = objects.recv().unwrap();
    assert_eq!((&ended["kind"], &ended["session"]), (&"ended".into(), &"first".into()));
    assert!(!ended.to_string().contains("Ada"));
    // The slide ends before the tissue.
    let early = short_run(at, "second", &["--travel-max", "20"]);
    assert_eq!(early.status.code(), Some(1));
    let kinds: Vec<Value> = objects.try_iter().map(|object| object["kind"].clone()).collect();
    assert_eq!(kinds, ["failed"]);
    let programme = "palpate-programme = 1\nname = \"two\"\ntitle = \"Two\"\n[[task]]\nname = \"press\"\nprotocol = \"ramp-hold\"\nrepeats = 2\nset = { depth = \"6 mm\", speed = \"3 mm/s\", hold = \"1 s\" }\n";
    std::fs::write(at.join("two.toml"), programme).unwrap();
    let done = typed(at, "run two.toml --time-scale max --json");
    succeeded(&done);
    assert_eq!(json(&done)["command"], "run");
    let kinds: Vec<Value> = objects.try_iter().map(|object| object["kind"].clone()).collect();
    assert_eq!(kinds, ["ended", "ended"]);
}

#[test]
fn a_server_that_says_nothing_delays_the_end_of_a_run_and_not_its_report() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    settings(at, &webhook(silent.local_addr().unwrap().port()));
    let run = short_run(at, "first", &["--json"]);
    assert_eq!(answer(&run)["ending"], "finish");
    assert_says(&run, "the notice 'ended' did not reach webhook at 127.0.0.1");
}
