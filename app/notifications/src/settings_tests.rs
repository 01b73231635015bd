use super::*;
use palpate_test_support::messages::assert_message;

/// A folder with a password file that only its owner reads, one that all read, and certificates that are none.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, mode) in [("password", 0o600), ("shared", 0o644), ("ca.pem", 0o644)] {
        let path = folder.path().join(name);
        std::fs::write(&path, "xyzzy\n").unwrap();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
        }
        let _ = mode;
    }
    folder
}

const ALL: &str = r#"palpate-notifications = 1

[[webhook]]
url = "https://chat.example.org/hooks/secret-path"
token_file = "password"
when = ["failed", "alarm"]

[[email]]
server = "mail.example.org"
security = "starttls"
user = "palpate"
password_file = "password"
from = "Palpate <palpate@example.org>"
to = ["ada@example.org", "Bob <bob@example.org>"]

[[mqtt]]
server = "broker.example.org"
topic = "laboratory/palpate"
when = ["disk"]

[[mqtt]]
server = "::1"
port = 1884
tls = false
user = "palpate"
password_file = "password"
topic = "palpate"
"#;

#[test]
fn a_file_has_targets_with_rules_and_usual_ports() {
    let folder = folder();
    let settings = NotificationSettings::parse(ALL, folder.path()).unwrap();
    let text = settings.text();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(
        lines,
        [
            "webhook at chat.example.org: failed, alarm",
            "e-mail by mail.example.org to ada@example.org, bob@example.org: ended, failed, alarm, disk, calibration",
            "MQTT topic laboratory/palpate at broker.example.org: disk",
            "MQTT topic palpate at ::1: ended, failed, alarm, disk, calibration",
        ]
    );
    let TargetAddress::Email(email) = &settings.targets[1].address else { panic!("an e-mail") };
    assert_eq!((email.port, email.security), (587, Security::StartTls));
    let TargetAddress::Mqtt(mqtt) = &settings.targets[2].address else { panic!("MQTT") };
    assert_eq!((mqtt.port, mqtt.is_encrypted), (8883, true));
    assert!(settings.targets[0].wants(NoticeKind::Alarm));
    assert!(!settings.targets[0].wants(NoticeKind::Ended));
    assert!(settings.targets[0].wants(NoticeKind::Test));
    // Neither a password nor the path of a webhook is shown by anything that prints a value.
    let shown = format!("{settings:?}");
    assert!(!shown.contains("xyzzy") && !shown.contains("secret-path"), "{shown}");
}

#[test]
fn every_mistake_has_its_line_in_one_message() {
    let text = r#"palpate-notifications = 1
[[webhook]]
url = "ftp://example.org"
whne = []

[[webhok]]
[[email]]
server = "https://mail"
security = "ssl"
from = "nowhere"
to = []
when = ["finished", 3]
[[mqtt]]
server = "broker"
port = 70000
topic = "a/#"
user = "u"
"#;
    let folder = folder();
    let Err(SettingsError::Mistakes(found)) = NotificationSettings::parse(text, folder.path())
    else {
        panic!("mistakes");
    };
    let lines: Vec<u32> = found.iter().map(|one| one.line).collect();
    assert_eq!(lines, [3, 4, 6, 8, 9, 10, 11, 12, 12, 15, 16, 17], "{found:?}");
    for one in &found {
        assert_message(&one.message, &[]);
    }
    let all = SettingsError::Mistakes(found);
    assert_message(&all, &["notifications.toml", "line 3", "line 17", "did you mean 'webhook'?"]);
}

#[test]
fn what_is_not_safe_is_refused() {
    let folder = folder();
    let mqtt = "[[mqtt]]\nserver = \"broker\"\ntopic = \"t\"\n";
    let email = "[[email]]\nserver = \"mail\"\nfrom = \"a@b.org\"\nto = \"c@d.org\"\n";
    let login = "user = \"u\"\npassword_file = \"password\"\n";
    for (text, word) in [
        // A password without encryption to another computer.
        (format!("{mqtt}tls = false\n{login}"), "without encryption"),
        (format!("{email}security = \"none\"\n{login}"), "without encryption"),
        (
            "[[webhook]]\nurl = \"http://chat/x\"\ntoken_file = \"password\"\n".into(),
            "without encryption",
        ),
        ("[[webhook]]\nurl = \"https://me:xyzzy@chat/x\"\n".into(), "token_file"),
        // Half a login.
        (format!("{mqtt}user = \"u\"\n"), "password_file"),
        (format!("{mqtt}password_file = \"password\"\n"), "user"),
        // Files.
        (format!("{mqtt}user = \"u\"\npassword_file = \"gone\"\n"), "cannot be read"),
        (format!("{mqtt}ca_file = \"ca.pem\"\n"), "no certificate"),
        (format!("{mqtt}ca_file = \"gone\"\n"), "cannot be read"),
        // Text that would end a header of an e-mail.
        (
            email.replace("c@d.org", "c@d.org\\nBcc: e@f.org") + "security = \"tls\"\n",
            "not an e-mail address",
        ),
    ] {
        let text = format!("palpate-notifications = 1\n{text}");
        let refusal = NotificationSettings::parse(&text, folder.path()).unwrap_err();
        assert_message(&refusal, &["notifications.toml", "line ", word]);
        assert!(!refusal.to_string().contains("xyzzy"), "{refusal}");
    }
    #[cfg(unix)]
    {
        let text =
            format!("palpate-notifications = 1\n{mqtt}user = \"u\"\npassword_file = \"shared\"\n");
        let refusal = NotificationSettings::parse(&text, folder.path()).unwrap_err();
        assert_message(&refusal, &["line 6", "chmod 600"]);
    }
    // This computer itself needs no encryption.
    for server in ["localhost", "127.0.0.1", "::1"] {
        let text = format!(
            "palpate-notifications = 1\n[[mqtt]]\nserver = \"{server}\"\ntopic = \"t\"\ntls = false\n{login}"
        );
        assert!(NotificationSettings::parse(&text, folder.path()).is_ok(), "{server}");
    }
}

#[test]
fn a_library_without_the_file_has_no_settings_and_a_shared_file_is_refused() {
    let library = tempfile::tempdir().unwrap();
    assert!(NotificationSettings::of_library(library.path()).unwrap().is_none());
    let path = library.path().join(SETTINGS_FILE);
    std::fs::write(&path, "palpate-notifications = 1\n").unwrap();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o644)).unwrap();
        let refusal = NotificationSettings::of_library(library.path()).unwrap_err();
        assert!(matches!(refusal, SettingsError::Unreadable(_)));
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).unwrap();
    }
    let settings = NotificationSettings::of_library(library.path()).unwrap().unwrap();
    assert!(settings.targets.is_empty());
    for text in ["", "palpate-notifications = 2\n", "[[mqtt]\n"] {
        let refusal = NotificationSettings::parse(text, library.path()).unwrap_err();
        assert!(matches!(refusal, SettingsError::Mistakes(_)), "{text}");
    }
}
