//! The ways to a target. Each sends one notice and waits until the server has taken it.

mod email;
mod mqtt;
mod webhook;

use crate::notice::{Notice, one_line};
use crate::target::{Target, TargetAddress};
use email::EmailSender;
use mqtt::MqttSender;
use std::error::Error;
use std::time::Duration;
use webhook::WebhookSender;

/// The longest attempt to send a notice, from the name of the server to its answer. Servers answer within a second; a mail
/// server that examines what it gets may take some (RFC 5321, section 4.5.3.2, allows minutes, which nothing here waits).
pub const ATTEMPT_MAX: Duration = Duration::from_secs(30);

/// The longest silence of an MQTT connection, after which it is tried whether the broker is still there.
pub const SILENCE_MAX: Duration = Duration::from_secs(30);

/// Why a notice did not arrive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct SendError {
    pub reason: String,
    /// The server has refused for good: another attempt would be the same, or would lock the account.
    pub is_final: bool,
}

impl SendError {
    /// A failure that another attempt may not have.
    fn passing(reason: impl Into<String>) -> Self {
        Self { reason: one_line(&reason.into()), is_final: false }
    }

    fn refused(reason: impl Into<String>) -> Self {
        Self { reason: one_line(&reason.into()), is_final: true }
    }
}

/// An error with its causes: the outermost alone often says only that something failed.
fn with_causes(err: &dyn Error) -> String {
    let mut text = err.to_string();
    let mut cause = err.source();
    while let Some(one) = cause {
        let words = one.to_string();
        if !text.contains(&words) {
            text = format!("{text}: {words}");
        }
        cause = one.source();
    }
    text
}

/// A way to a target, with what stays open between notices.
pub(crate) enum Sender {
    Webhook(WebhookSender),
    Email(Box<EmailSender>),
    Mqtt(Box<MqttSender>),
}

impl Sender {
    /// Prepares a way. Nothing is connected yet.
    pub fn new(target: &Target) -> Result<Self, SendError> {
        let ca_file = target.ca_file.as_deref();
        Ok(match &target.address {
            TargetAddress::Webhook(webhook) => Self::Webhook(WebhookSender::new(webhook, ca_file)?),
            TargetAddress::Email(email) => Self::Email(Box::new(EmailSender::new(email, ca_file)?)),
            TargetAddress::Mqtt(mqtt) => Self::Mqtt(Box::new(MqttSender::new(mqtt, ca_file)?)),
        })
    }

    /// Sends a notice, once, within the time of an attempt.
    pub async fn send(&mut self, notice: &Notice, longest: Duration) -> Result<(), SendError> {
        let attempt = async {
            match self {
                Self::Webhook(webhook) => webhook.send(notice).await,
                Self::Email(email) => email.send(notice).await,
                Self::Mqtt(mqtt) => mqtt.send(notice).await,
            }
        };
        match tokio::time::timeout(longest, attempt).await {
            Ok(result) => result,
            Err(_) => {
                self.disconnect();
                let seconds = longest.as_secs_f64();
                Err(SendError::passing(format!("the server did not answer within {seconds} s")))
            }
        }
    }

    /// Keeps a connection that stays open; the others have none.
    pub async fn keep_alive(&mut self, longest: Duration) {
        if let Self::Mqtt(mqtt) = self
            && tokio::time::timeout(longest, mqtt.keep_alive()).await.is_err()
        {
            self.disconnect();
        }
    }

    /// Says goodbye where that is the custom.
    pub async fn close(&mut self) {
        if let Self::Mqtt(mqtt) = self {
            mqtt.close().await;
        }
    }

    fn disconnect(&mut self) {
        if let Self::Mqtt(mqtt) = self {
            mqtt.disconnect();
        }
    }
}
