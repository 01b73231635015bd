//! Servers that are not there, say nothing or break off: the program that has something to say goes on.

use crate::servers::{Reaction, WebServer, free_port, notice, target};
use palpate_notifications::{
    EmailTarget, MqttTarget, NoticeKind, Notifier, Patience, SILENCE_MAX, Security, Target,
    TargetAddress, UNSENT_MAX, WAITING_MAX,
};
use palpate_test_support::wait::until;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// A port whose connections are taken and never answered, for as long as the listener lives.
fn silent_port() -> (TcpListener, u16) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    (listener, port)
}

/// One target of each kind at a port.
fn targets(port: u16) -> Vec<Target> {
    let server = "127.0.0.1".to_owned();
    let url = format!("http://127.0.0.1:{port}/").parse().unwrap();
    let webhook = TargetAddress::Webhook(palpate_notifications::WebhookTarget { url, token: None });
    let email = TargetAddress::Email(EmailTarget {
        server: server.clone(),
        port,
        security: Security::None,
        login: None,
        from: "palpate@example.org".parse().unwrap(),
        to: vec!["ada@example.org".parse().unwrap()],
    });
    let mqtt = TargetAddress::Mqtt(MqttTarget {
        server,
        port,
        is_encrypted: false,
        login: None,
        topic: "palpate".into(),
    });
    [webhook, email, mqtt].map(|address| target(address, None)).into()
}

/// Short enough for a test, and no test needs an answer within it.
const SHORT: Patience = Patience {
    attempt: Duration::from_millis(300),
    end: Duration::from_secs(3),
    silence: SILENCE_MAX,
};

#[test]
fn silent_servers_end_with_the_program_and_the_notices_are_named() {
    let (_listener, port) = silent_port();
    let notifier = Notifier::start(targets(port), SHORT).unwrap();
    notifier.send(&notice(NoticeKind::Failed));
    let unsent = notifier.finish();
    assert_eq!(unsent.len(), 3, "{unsent:?}");
    for one in &unsent {
        assert!(one.reason.contains("did not answer"), "{}: {}", one.target, one.reason);
    }
}

#[test]
fn servers_that_are_not_there_or_close_at_once_are_named() {
    let closing = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = closing.local_addr().unwrap().port();
    std::thread::Builder::new()
        .name("closing".into())
        .spawn(move || closing.incoming().for_each(drop))
        .unwrap();
    for port in [free_port(), port] {
        let notifier = Notifier::start(targets(port), SHORT).unwrap();
        notifier.send(&notice(NoticeKind::Failed));
        let unsent = notifier.finish();
        assert_eq!(unsent.len(), 3, "{unsent:?}");
        assert!(unsent.iter().all(|one| one.reason.starts_with("palpate ended before")));
    }
}

#[test]
fn a_hung_attempt_is_followed_by_another_and_no_target_waits_for_another() {
    let (_listener, silent) = silent_port();
    let hung = WebServer::start(&[Reaction::Hang, Reaction::Answer(200)]);
    let works = WebServer::start(&[Reaction::Answer(200)]);
    let mut all = targets(silent);
    all.extend([hung.target(), works.target()]);
    let notifier =
        Notifier::start(all, Patience { attempt: Duration::from_secs(2), ..SHORT }).unwrap();
    notifier.send(&notice(NoticeKind::Alarm));
    // These come although the first three targets get no answer.
    assert_eq!(works.request().object["kind"], "alarm");
    assert_eq!(hung.request().object, hung.request().object);
}

#[test]
fn a_full_queue_keeps_the_alarm_and_whoever_sends_never_waits() {
    let (_listener, port) = silent_port();
    let webhook = targets(port).swap_remove(0);
    let patience = Patience { attempt: Duration::from_secs(600), end: Duration::ZERO, ..SHORT };
    let notifier = Notifier::start(vec![webhook], patience).unwrap();
    notifier.send(&notice(NoticeKind::Alarm));
    // The connection is never answered: if this waited for it, the test would not end.
    for _ in 0..2 * WAITING_MAX {
        notifier.send(&notice(NoticeKind::Ended));
    }
    let dropped = notifier.unsent();
    assert_eq!(dropped.len(), UNSENT_MAX);
    assert!(dropped.iter().all(|one| one.notice.kind == NoticeKind::Ended));
    let all = notifier.finish();
    assert_eq!(all.len(), UNSENT_MAX);
}

#[test]
fn an_alarm_does_not_wait_for_the_next_attempt_of_another_notice() {
    // The fourth wait is a minute: what comes before it is the alarm's own attempt.
    let server = WebServer::start(&[Reaction::Answer(500)]);
    let notifier = Notifier::start(vec![server.target()], SHORT).unwrap();
    notifier.send(&notice(NoticeKind::Ended));
    for _ in 0..3 {
        assert_eq!(server.request().object["kind"], "ended");
    }
    notifier.send(&notice(NoticeKind::Alarm));
    assert_eq!(server.request().object["kind"], "alarm");
}

/// Connections of a broker that refuses every login: `CONNACK` with code 5 (MQTT 3.1.1, section 3.2).
fn refusing_broker() -> (u16, Arc<AtomicUsize>) {
    let (listener, port) = silent_port();
    let count = Arc::new(AtomicUsize::new(0));
    let own = Arc::clone(&count);
    let refuse = move || {
        for mut stream in listener.incoming().flatten() {
            let _ = stream.read(&mut [0; 256]);
            own.fetch_add(1, Ordering::SeqCst);
            let _ = stream.write_all(&[0x20, 2, 0, 5]);
        }
    };
    std::thread::Builder::new().name("refusing".into()).spawn(refuse).unwrap();
    (port, count)
}

#[test]
fn a_refused_login_is_tried_again_only_for_the_next_notice() {
    let (port, count) = refusing_broker();
    let mqtt = targets(port).remove(2);
    let patience = Patience { silence: Duration::from_millis(10), ..SHORT };
    let notifier = Notifier::start(vec![mqtt], patience).unwrap();
    notifier.send(&notice(NoticeKind::Failed));
    let logins = || count.load(Ordering::SeqCst);
    // One of the notice, and perhaps one before it, when the connection was to be kept.
    let before = until(|| (logins() > 0).then(logins), || "no login".into());
    let pause = 30 * patience.silence;
    std::thread::sleep(pause);
    let after = logins();
    assert!(after <= before + 1 && after <= 2, "{before}, then {after}");
    std::thread::sleep(pause);
    assert_eq!(logins(), after);
    notifier.send(&notice(NoticeKind::Alarm));
    until(|| (logins() == after + 1).then_some(()), || "no login for the alarm".into());
    assert_eq!(notifier.finish().len(), 2);
}
