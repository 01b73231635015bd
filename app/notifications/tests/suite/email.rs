//! Python's aiosmtpd as a mail server.

use crate::servers::{Certificates, Program, certificates, lacks_mail_server, notice, target};
use palpate_notifications::{
    EmailTarget, Notice, NoticeKind, NoticeRun, Notifier, Patience, Secret, Security, Target,
    TargetAddress, test_targets,
};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

struct MailServer {
    program: Program,
    port: u16,
}

impl MailServer {
    fn start(security: Security, files: &Certificates, login: &[&str]) -> Self {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/suite/smtp_sink.py");
        let mut command = Command::new("python3");
        command.arg(script).arg(security.name()).args([&files.certificate, &files.key]).args(login);
        let program = Program::start(&mut command);
        let port = program.line().parse().expect("a port");
        Self { program, port }
    }

    fn target(&self, security: Security, files: &Certificates, login: Option<[&str; 2]>) -> Target {
        let address = EmailTarget {
            server: "127.0.0.1".into(),
            port: self.port,
            security,
            login: login.map(|[user, password]| (user.into(), Secret::new(password))),
            from: "Palpate <palpate@example.org>".parse().unwrap(),
            to: vec!["ada@example.org".parse().unwrap(), "bob@example.org".parse().unwrap()],
        };
        target(TargetAddress::Email(address), Some(&files.authority))
    }

    fn object(&self) -> Value {
        serde_json::from_str(&self.program.line()).expect("an object")
    }
}

#[test]
fn an_email_arrives_in_every_kind_of_encryption_with_and_without_a_login() {
    let folder = tempfile::tempdir().unwrap();
    let Some(files) = certificates(folder.path()).filter(|_| !lacks_mail_server()) else { return };
    for security in Security::ALL {
        for login in [None, Some(["palpate", "xyzzy"])] {
            let words = login.map_or(vec![], |pair| pair.to_vec());
            let server = MailServer::start(security, &files, &words);
            let target = server.target(security, &files, login);
            let tests = test_targets(&[target], &notice(NoticeKind::Ended)).unwrap();
            assert_eq!(tests[0].result, Ok(()), "{security} {login:?}");
            let object = server.object();
            assert_eq!(object["encrypted"], security != Security::None, "{security}");
            assert_eq!(object["authenticated"], login.is_some(), "{security}");
            assert_eq!(object["from"], "palpate@example.org");
            assert_eq!(object["to"], serde_json::json!(["ada@example.org", "bob@example.org"]));
            assert_eq!(object["subject"], "palpate bench ended");
            let text = object["text"].as_str().unwrap();
            assert!(text.starts_with("bench: a notice of ended"), "{text}");
        }
    }
}

#[test]
fn a_wrong_password_is_tried_once() {
    let folder = tempfile::tempdir().unwrap();
    let Some(files) = certificates(folder.path()).filter(|_| !lacks_mail_server()) else { return };
    let server = MailServer::start(Security::StartTls, &files, &["palpate", "xyzzy"]);
    let wrong = server.target(Security::StartTls, &files, Some(["palpate", "plugh"]));
    let right = server.target(Security::StartTls, &files, Some(["palpate", "xyzzy"]));
    let notifier = Notifier::start(vec![wrong], Patience::default()).unwrap();
    notifier.send(&notice(NoticeKind::Failed));
    let unsent = notifier.finish();
    assert_eq!(unsent.len(), 1);
    assert!(unsent[0].reason.contains("check user and password"), "{}", unsent[0].reason);
    assert!(!unsent[0].reason.contains("plugh"));
    assert!(server.object()["refused"].is_string());
    // What comes next is the right one: the wrong one was not tried again.
    test_targets(&[right], &notice(NoticeKind::Failed)).unwrap();
    assert_eq!(server.object()["authenticated"], true);
}

#[test]
fn a_certificate_that_is_not_trusted_gets_neither_password_nor_text() {
    let folder = tempfile::tempdir().unwrap();
    let Some(files) = certificates(folder.path()).filter(|_| !lacks_mail_server()) else { return };
    let other = tempfile::tempdir().unwrap();
    let Some(others) = certificates(other.path()) else { return };
    for security in [Security::Tls, Security::StartTls] {
        let server = MailServer::start(security, &files, &["palpate", "xyzzy"]);
        let login = Some(["palpate", "xyzzy"]);
        let by_other = server.target(security, &others, login);
        let by_computer = Target { ca_file: None, ..server.target(security, &files, login) };
        let right = server.target(security, &files, login);
        let tests = test_targets(&[by_other, by_computer], &notice(NoticeKind::Failed)).unwrap();
        for test in &tests {
            let reason = test.result.as_ref().unwrap_err();
            assert!(reason.contains("certificate"), "{security}: {reason}");
        }
        test_targets(&[right], &notice(NoticeKind::Alarm)).unwrap();
        assert_eq!(server.object()["subject"], "palpate bench alarm");
    }
}

#[test]
fn a_server_without_encryption_gets_nothing_where_it_is_wanted() {
    let folder = tempfile::tempdir().unwrap();
    let Some(files) = certificates(folder.path()).filter(|_| !lacks_mail_server()) else { return };
    let server = MailServer::start(Security::None, &files, &[]);
    let wanted = server.target(Security::StartTls, &files, Some(["palpate", "xyzzy"]));
    let plain = server.target(Security::None, &files, None);
    let tests = test_targets(&[wanted], &notice(NoticeKind::Failed)).unwrap();
    assert!(tests[0].result.is_err());
    test_targets(&[plain], &notice(NoticeKind::Alarm)).unwrap();
    assert_eq!(server.object()["subject"], "palpate bench alarm");
}

#[test]
fn no_text_of_a_session_adds_a_header_or_a_recipient() {
    let folder = tempfile::tempdir().unwrap();
    let Some(files) = certificates(folder.path()).filter(|_| !lacks_mail_server()) else { return };
    let server = MailServer::start(Security::None, &files, &[]);
    let evil =
        "1\r\nBcc: eve@example.org\r\n\r\n.\r\nMAIL FROM:<eve@example.org>\u{2028}\u{0}\u{85}é";
    let run = NoticeRun {
        session: evil.into(),
        plan: evil.into(),
        phase: evil.into(),
        outcome: None,
        reason: Some(evil.into()),
    };
    let plain = notice(NoticeKind::Failed);
    let evil = Notice { rig: evil.into(), text: evil.into(), run: Some(run), ..plain.clone() };
    let target = server.target(Security::None, &files, None);
    for one in [&plain, &evil] {
        let tests = test_targets(std::slice::from_ref(&target), one).unwrap();
        assert_eq!(tests[0].result, Ok(()));
    }
    let (plain, evil) = (server.object(), server.object());
    assert_eq!(evil["headers"], plain["headers"]);
    assert_eq!((&evil["to"], &evil["from"]), (&plain["to"], &plain["from"]));
    assert!(!evil["subject"].as_str().unwrap().contains(['\r', '\n']));
    assert!(evil["text"].as_str().unwrap().contains('é'));
}

#[test]
fn who_has_left_keeps_an_alarm_from_no_one_else() {
    let folder = tempfile::tempdir().unwrap();
    let Some(files) = certificates(folder.path()).filter(|_| !lacks_mail_server()) else { return };
    let server = MailServer::start(Security::StartTls, &files, &[]);
    let mut target = server.target(Security::StartTls, &files, None);
    let TargetAddress::Email(email) = &mut target.address else { panic!() };
    email.to.insert(1, "former@example.org".parse().unwrap());
    let notifier = Notifier::start(vec![target], Patience::default()).unwrap();
    notifier.send(&notice(NoticeKind::Alarm));
    let unsent = notifier.finish();
    let reached = [server.object(), server.object()].map(|object| object["to"].clone());
    assert_eq!(reached, ["ada@example.org", "bob@example.org"].map(|one| serde_json::json!([one])));
    assert_eq!(unsent.len(), 1);
    let reason = &unsent[0].reason;
    assert!(reason.starts_with("former@example.org: ") && reason.contains("550"), "{reason}");
}
