//! A web server on this computer.

use crate::servers::{Reaction, WebServer, notice, target};
use palpate_notifications::{
    NoticeKind, Notifier, Patience, Secret, TargetAddress, WebhookTarget, test_targets,
};

#[test]
fn a_webhook_gets_the_object_with_its_token() {
    let server = WebServer::start(&[Reaction::Answer(200)]);
    let url = format!("http://127.0.0.1:{}/hook?room=4", server.port).parse().unwrap();
    let token = Some(Secret::new("xyzzy"));
    let with_token = target(TargetAddress::Webhook(WebhookTarget { url, token }), None);
    let tests = test_targets(&[with_token], &notice(NoticeKind::Failed)).unwrap();
    assert_eq!(tests[0].result, Ok(()));
    let request = server.request();
    assert!(request.head.starts_with("POST /hook?room=4 HTTP/1.1\r\n"), "{}", request.head);
    let head = request.head.to_lowercase();
    assert!(head.contains("authorization: bearer xyzzy"), "{head}");
    assert!(head.contains("content-type: application/json"), "{head}");
    assert_eq!(request.object["palpate_notice"], 1);
    assert_eq!(request.object["text"], "bench: a notice of failed");
}

#[test]
fn a_server_that_fails_once_gets_the_notice_again() {
    for reaction in [Reaction::Answer(500), Reaction::Close, Reaction::Break] {
        let server = WebServer::start(&[reaction, Reaction::Answer(200)]);
        let notifier = Notifier::start(vec![server.target()], Patience::default()).unwrap();
        notifier.send(&notice(NoticeKind::Ended));
        assert_eq!(server.request().object, server.request().object, "{reaction:?}");
        assert_eq!(notifier.finish(), [], "{reaction:?}");
        assert!(server.requests.try_recv().is_err(), "{reaction:?}: sent a third time");
    }
}

#[test]
fn a_refusal_is_final_and_an_answer_that_leads_elsewhere_is_not_followed() {
    for (code, words) in [(401, "token"), (404, "404"), (302, "another address")] {
        let server = WebServer::start(&[Reaction::Answer(code)]);
        let notifier = Notifier::start(vec![server.target()], Patience::default()).unwrap();
        notifier.send(&notice(NoticeKind::Alarm));
        let unsent = notifier.finish();
        assert_eq!(unsent.len(), 1, "{code}");
        assert_eq!(unsent[0].notice.kind, NoticeKind::Alarm);
        assert!(unsent[0].reason.contains(words), "{}", unsent[0].reason);
        server.request();
        assert!(server.requests.try_recv().is_err(), "{code}: sent again");
    }
}

#[test]
fn a_target_gets_only_its_rules() {
    let server = WebServer::start(&[Reaction::Answer(204)]);
    let mut some = server.target();
    some.when = [NoticeKind::Alarm, NoticeKind::Disk].into();
    let notifier = Notifier::start(vec![some], Patience::default()).unwrap();
    NoticeKind::RULES.into_iter().for_each(|kind| notifier.send(&notice(kind)));
    assert_eq!(notifier.finish(), []);
    let mut kinds = [server.request().object, server.request().object];
    kinds.sort_by_key(|object| object["kind"].to_string());
    assert_eq!((&kinds[0]["kind"], &kinds[1]["kind"]), (&"alarm".into(), &"disk".into()));
    assert!(server.requests.try_recv().is_err());
}
