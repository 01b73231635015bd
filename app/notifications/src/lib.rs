//! Notices of runs by webhook, e-mail and MQTT, for people who are not beside the rig.
//!
//! [`NoticeRules`] decide, and reach nothing. [`Notifier`] sends, from a thread of its own: neither the runner nor a window
//! waits for a network. [`RunNotices`] joins both for a front end, by the settings of a library. Nothing here moves a rig
//! or answers for an operator. Start reading in `run_notices.rs`.
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

mod housekeeping;
mod notice;
mod notifier;
mod queue;
mod rules;
mod run_notices;
mod secret;
mod send;
mod settings;
mod target;
mod tls;

pub use housekeeping::{ANNOUNCED_FILE, ANNOUNCED_VERSION};
pub use notice::{CalibrationValidity, NOTICE_VERSION, Notice, NoticeKind, NoticeRun};
pub use notifier::{
    END_WITHIN, Notifier, Patience, TargetTest, UNSENT_MAX, UnsentNotice, test_targets,
};
pub use queue::{ATTEMPTS_MAX, WAITING_MAX};
pub use rules::{AnnouncedCalibrations, Circumstances, DISK_LOW_BYTES, MOVES_BY_HAND, NoticeRules};
pub use run_notices::{NotificationError, RunNotices, validity};
pub use secret::{Secret, SecretError};
pub use send::{ATTEMPT_MAX, SILENCE_MAX};
pub use settings::{NotificationSettings, SETTINGS_FILE, SETTINGS_VERSION, SettingsError};
pub use target::{EmailTarget, MqttTarget, Security, Target, TargetAddress, WebhookTarget};
