//! Who gets notices: an address and the rules that are sent there.

use crate::notice::{NoticeKind, one_line};
use crate::secret::Secret;
use lettre::message::Mailbox;
use std::collections::BTreeSet;
use std::fmt;
use url::Url;

/// One entry of the settings.
#[derive(Clone, Debug)]
pub struct Target {
    pub address: TargetAddress,
    /// The notices that it gets.
    pub when: BTreeSet<NoticeKind>,
    /// Certificates in PEM form that are trusted instead of the computer's.
    pub ca_file: Option<Vec<u8>>,
}

#[derive(Clone, Debug)]
pub enum TargetAddress {
    Webhook(WebhookTarget),
    Email(EmailTarget),
    Mqtt(MqttTarget),
}

/// A server that takes the object by HTTP POST.
#[derive(Clone)]
pub struct WebhookTarget {
    pub url: Url,
    /// Sent as a bearer token (RFC 6750).
    pub token: Option<Secret>,
}

impl fmt::Debug for WebhookTarget {
    /// Whoever knows the path of a chat's webhook can write there.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("WebhookTarget").field("host", &self.url.host_str()).finish_non_exhaustive()
    }
}

palpate_model::named! {
    /// How an SMTP connection is encrypted.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Security {
        /// From its first byte (RFC 8314).
        Tls = "tls",
        /// After a plain greeting, or not at all used (RFC 3207).
        StartTls = "starttls",
        None = "none",
    }
}

/// People who get an e-mail.
#[derive(Clone, Debug)]
pub struct EmailTarget {
    pub server: String,
    pub port: u16,
    pub security: Security,
    pub login: Option<(String, Secret)>,
    pub from: Mailbox,
    pub to: Vec<Mailbox>,
}

/// A broker that passes on notices and whether palpate is there.
#[derive(Clone, Debug)]
pub struct MqttTarget {
    pub server: String,
    pub port: u16,
    pub is_encrypted: bool,
    pub login: Option<(String, Secret)>,
    /// Notices are published below it at `notice`, the state at `state`.
    pub topic: String,
}

impl Target {
    /// What it is called in logs and messages. It shows no secret and no address of a person.
    #[must_use]
    pub fn name(&self) -> String {
        let name = match &self.address {
            TargetAddress::Webhook(webhook) => {
                format!("webhook at {}", webhook.url.host_str().unwrap_or_default())
            }
            TargetAddress::Email(email) => format!("e-mail by {}", email.server),
            TargetAddress::Mqtt(mqtt) => {
                format!("MQTT topic {} at {}", mqtt.topic, mqtt.server)
            }
        };
        one_line(&name)
    }

    /// The addresses of people who get an e-mail.
    #[must_use]
    pub fn recipients(&self) -> Vec<String> {
        match &self.address {
            TargetAddress::Email(email) => {
                email.to.iter().map(|one| one.email.to_string()).collect()
            }
            TargetAddress::Webhook(_) | TargetAddress::Mqtt(_) => Vec::new(),
        }
    }

    /// `webhook`, `email` or `mqtt`, as in the settings.
    #[must_use]
    pub fn way(&self) -> &'static str {
        match self.address {
            TargetAddress::Webhook(_) => "webhook",
            TargetAddress::Email(_) => "email",
            TargetAddress::Mqtt(_) => "mqtt",
        }
    }

    /// Whether it gets notices of a kind. A test goes to everybody.
    #[must_use]
    pub fn wants(&self, kind: NoticeKind) -> bool {
        kind == NoticeKind::Test || self.when.contains(&kind)
    }

    /// The rules in words.
    #[must_use]
    pub fn rules_text(&self) -> String {
        let wanted = NoticeKind::RULES.into_iter().filter(|kind| self.when.contains(kind));
        wanted.map(NoticeKind::name).collect::<Vec<_>>().join(", ")
    }
}
