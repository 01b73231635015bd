//! Mosquitto as a broker, and its own client as the one who listens.

use crate::servers::{
    Certificates, Program, WebServer, certificates, free_port, notice, target, wait_for_port,
};
use palpate_notifications::{
    MqttTarget, NoticeKind, Notifier, Patience, Secret, Target, TargetAddress, test_targets,
};
use palpate_test_support::skip::lacks_program;
use serde_json::Value;
use std::path::Path;
use std::process::Command;

const LOGIN: [&str; 2] = ["palpate", "xyzzy"];

struct Broker {
    program: Program,
    port: u16,
    is_login: bool,
    config: std::path::PathBuf,
}

impl Broker {
    /// A broker in a folder, with encryption and a login where they are given.
    fn start(folder: &Path, files: Option<&Certificates>, is_login: bool) -> Self {
        let port = free_port();
        let mut config = format!("listener {port} 127.0.0.1\nallow_anonymous {}\n", !is_login);
        if let Some(files) = files {
            let (certificate, key) = (files.certificate.display(), files.key.display());
            config += &format!("certfile {certificate}\nkeyfile {key}\n");
        }
        if is_login {
            let passwords = folder.join("passwords");
            let made = Command::new("mosquitto_passwd")
                .args(["-b", "-c"])
                .arg(&passwords)
                .args(LOGIN)
                .output();
            assert!(made.unwrap().status.success());
            config += &format!("password_file {}\n", passwords.display());
        }
        // Started as root, it would become a user who may not read the files of this test.
        if let Some(user) = std::env::var_os("USER").or(Some("root".into())) {
            config += &format!("user {}\n", user.to_string_lossy());
        }
        let path = folder.join(format!("{port}.conf"));
        std::fs::write(&path, config).unwrap();
        let mut broker = Self {
            program: Program::start(Command::new("mosquitto").arg("-c").arg(&path)),
            port,
            is_login,
            config: path,
        };
        broker.wait();
        broker
    }

    fn wait(&mut self) {
        wait_for_port(self.port);
    }

    /// The same once more, on the same port.
    fn restart(&mut self) {
        self.program.kill();
        self.program = Program::start(Command::new("mosquitto").arg("-c").arg(&self.config));
        self.wait();
    }

    /// Whoever listens to everything, and has said so.
    fn listener(&self, files: Option<&Certificates>) -> Program {
        let mut command = Command::new("mosquitto_sub");
        command.args(["-h", "localhost", "-p", &self.port.to_string(), "-t", "#", "-q", "1"]);
        // Topic, quality of service, whether it is retained, text; and a line once it listens.
        command.args(["-F", "%t %q %r %p"]);
        if let Some(files) = files {
            command.arg("--cafile").arg(&files.authority);
        }
        if self.is_login {
            command.args(["-u", LOGIN[0], "-P", LOGIN[1]]);
        }
        let listener = Program::start(&mut command);
        // It says nothing when it has subscribed: it listens once it hears something.
        let deadline = palpate_test_support::wait::Deadline::new();
        while !listener.has_line() {
            assert!(!deadline.is_over(), "the listener hears nothing");
            self.say("ready", files);
        }
        while listener.has_line() {}
        self.say("begin", files);
        while listener.line() != "test 1 0 begin" {}
        listener
    }

    fn say(&self, text: &str, files: Option<&Certificates>) {
        let mut command = Command::new("mosquitto_pub");
        command.args([
            "-h",
            "localhost",
            "-p",
            &self.port.to_string(),
            "-t",
            "test",
            "-q",
            "1",
            "-m",
            text,
        ]);
        if let Some(files) = files {
            command.arg("--cafile").arg(&files.authority);
        }
        if self.is_login {
            command.args(["-u", LOGIN[0], "-P", LOGIN[1]]);
        }
        assert!(command.output().unwrap().status.success());
    }

    fn target(&self, files: Option<&Certificates>, login: Option<[&str; 2]>) -> Target {
        let address = MqttTarget {
            server: "127.0.0.1".into(),
            port: self.port,
            is_encrypted: files.is_some(),
            login: login.map(|[user, password]| (user.into(), Secret::new(password))),
            topic: "laboratory/palpate".into(),
        };
        target(TargetAddress::Mqtt(address), files.map(|files| files.authority.as_path()))
    }
}

fn lacks_broker() -> bool {
    lacks_program("mosquitto") || lacks_program("mosquitto_sub")
}

/// Topic, quality of service and flag of a line of the listener, and its text.
fn parts(line: &str) -> (String, String) {
    let parts: Vec<&str> = line.splitn(4, ' ').collect();
    (parts[..3].join(" "), parts[3].to_owned())
}

const ONLINE: &str = "laboratory/palpate/state 1 0 online";
const OFFLINE: &str = "laboratory/palpate/state 1 0 offline";
const NOTICE: &str = "laboratory/palpate/notice 1 0";

#[test]
fn a_notice_is_published_once_and_not_retained_with_and_without_encryption_and_login() {
    if lacks_broker() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let Some(files) = certificates(folder.path()) else { return };
    for files in [None, Some(&files)] {
        for login in [None, Some(LOGIN)] {
            let broker = Broker::start(folder.path(), files, login.is_some());
            let listener = broker.listener(files);
            let target = broker.target(files, login);
            let notifier = Notifier::start(vec![target], Patience::default()).unwrap();
            assert_eq!(listener.line(), ONLINE);
            notifier.send(&notice(NoticeKind::Alarm));
            let (head, text) = parts(&listener.line());
            assert_eq!(head, NOTICE);
            let object: Value = serde_json::from_str(&text).unwrap();
            assert_eq!(object["kind"], "alarm");
            assert_eq!(notifier.finish(), []);
            assert_eq!(listener.line(), OFFLINE);
            // Who comes later hears nothing of it: the broker has kept nothing.
            let late = broker.listener(files);
            assert!(!late.has_line());
        }
    }
}

#[test]
fn the_broker_says_offline_for_a_program_that_is_killed() {
    if lacks_broker() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let broker = Broker::start(folder.path(), None, false);
    let listener = broker.listener(None);
    let target = broker.target(None, None);
    // A thread that ends without a goodbye, as a killed program does.
    let patience = Patience { end: std::time::Duration::ZERO, ..Patience::default() };
    let notifier = Notifier::start(vec![target], patience).unwrap();
    assert_eq!(listener.line(), ONLINE);
    drop(notifier);
    assert_eq!(listener.line(), OFFLINE);
}

#[test]
fn a_broker_that_restarts_gets_the_next_notice() {
    if lacks_broker() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut broker = Broker::start(folder.path(), None, false);
    let listener = broker.listener(None);
    let target = broker.target(None, None);
    let notifier = Notifier::start(vec![target], Patience::default()).unwrap();
    assert_eq!(listener.line(), ONLINE);
    broker.restart();
    let listener = broker.listener(None);
    notifier.send(&notice(NoticeKind::Disk));
    // The listener may be there before or after palpate is again.
    let head = loop {
        let (head, _) = parts(&listener.line());
        if !head.contains("state") {
            break head;
        }
    };
    assert_eq!(head, NOTICE);
    assert_eq!(notifier.finish(), []);
}

#[test]
fn a_wrong_password_and_another_kind_of_server_are_named() {
    if lacks_broker() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let broker = Broker::start(folder.path(), None, true);
    let wrong = broker.target(None, Some(["palpate", "plugh"]));
    let none = broker.target(None, None);
    let web = WebServer::start(&[crate::servers::Reaction::Answer(200)]);
    let mut other = broker.target(None, None);
    if let TargetAddress::Mqtt(mqtt) = &mut other.address {
        mqtt.port = web.port;
    }
    let tests = test_targets(&[wrong.clone(), none], &notice(NoticeKind::Failed)).unwrap();
    for test in tests {
        let reason = test.result.unwrap_err();
        assert!(reason.contains("user and password"), "{reason}");
        assert!(!reason.contains("plugh"), "{reason}");
    }
    let notifier = Notifier::start(vec![wrong], Patience::default()).unwrap();
    notifier.send(&notice(NoticeKind::Failed));
    assert_eq!(notifier.finish().len(), 1);
}

#[test]
fn a_certificate_that_is_not_trusted_gets_no_password() {
    if lacks_broker() {
        return;
    }
    let (folder, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let Some(files) = certificates(folder.path()) else { return };
    let Some(others) = certificates(other.path()) else { return };
    let broker = Broker::start(folder.path(), Some(&files), true);
    let by_other = Target {
        ca_file: Some(std::fs::read(&others.authority).unwrap()),
        ..broker.target(Some(&files), Some(LOGIN))
    };
    let by_computer = Target { ca_file: None, ..broker.target(Some(&files), Some(LOGIN)) };
    let tests = test_targets(&[by_other, by_computer], &notice(NoticeKind::Failed)).unwrap();
    for test in tests {
        let reason = test.result.unwrap_err();
        assert!(reason.contains("certificate"), "{reason}");
    }
}

#[test]
fn a_broker_that_restarts_hears_of_palpate_without_a_notice() {
    if lacks_broker() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut broker = Broker::start(folder.path(), None, false);
    let listener = broker.listener(None);
    let target = broker.target(None, None);
    let patience = Patience { silence: std::time::Duration::from_secs(3), ..Patience::default() };
    let notifier = Notifier::start(vec![target], patience).unwrap();
    assert_eq!(listener.line(), ONLINE);
    broker.restart();
    // Whoever listens too late to the first return hears of the next.
    let mut listener = broker.listener(None);
    while !listener.hears(ONLINE) {
        broker.restart();
        listener = broker.listener(None);
    }
    assert_eq!(notifier.finish(), []);
}
