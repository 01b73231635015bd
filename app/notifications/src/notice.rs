//! What is sent: one occurrence, as a sentence and as an object.

use chrono::{DateTime, SecondsFormat, Utc};
use palpate_protocols::engine::EndingKind;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

/// Version of the object that is sent.
pub const NOTICE_VERSION: u32 = 1;

palpate_model::named! {
    /// The rule by which a notice is sent, in the order of importance.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
    pub enum NoticeKind {
        /// An interlock has stopped the rig.
        Alarm = "alarm",
        /// A run ended before its plan was complete, or waits for its operator after a stop.
        Failed = "failed",
        /// Little space is left on the disk of a run.
        Disk = "disk",
        /// A run is complete.
        Ended = "ended",
        /// The calibration in use has expired or soon does.
        Calibration = "calibration",
        /// The command that tries every target.
        Test = "test",
    }
}

impl NoticeKind {
    /// Those that the settings may name.
    pub const RULES: [Self; 5] =
        [Self::Ended, Self::Failed, Self::Alarm, Self::Disk, Self::Calibration];
}

/// One occurrence.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    pub kind: NoticeKind,
    pub time: DateTime<Utc>,
    pub rig: String,
    /// One sentence for people.
    pub text: String,
    pub run: Option<NoticeRun>,
    pub free_bytes: Option<u64>,
    pub calibration: Option<CalibrationValidity>,
}

/// The run that a notice is about. It names neither operator nor specimen.
#[derive(Clone, Debug, PartialEq)]
pub struct NoticeRun {
    /// Name of the session's folder, without the folders above it.
    pub session: String,
    pub plan: String,
    /// The phase in which it was, before it stopped.
    pub phase: String,
    /// How it ended, once it has.
    pub outcome: Option<EndingKind>,
    pub reason: Option<String>,
}

/// A calibration and for how many days it is still valid; less than 0 once it has expired.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CalibrationValidity {
    pub name: String,
    /// When it was taken, as it says: a newer one may have its name.
    pub taken: String,
    pub days_left: i64,
}

impl Notice {
    /// The notice of a test of the settings.
    #[must_use]
    pub fn test(time: DateTime<Utc>) -> Self {
        Self {
            kind: NoticeKind::Test,
            time,
            rig: String::new(),
            text: "palpate: this is a test of the notifications; nothing has happened".to_owned(),
            run: None,
            free_bytes: None,
            calibration: None,
        }
    }

    /// A short title on one line.
    #[must_use]
    pub fn subject(&self) -> String {
        let what = match (&self.run, &self.calibration) {
            (Some(run), _) => format!(": {} {}", run.plan, run.session),
            (None, Some(calibration)) => format!(": {}", calibration.name),
            (None, None) => String::new(),
        };
        let rig = if self.rig.is_empty() { String::new() } else { format!(" {}", self.rig) };
        one_line(&format!("palpate{rig} {}{what}", self.kind))
    }

    /// Several lines of plain text.
    #[must_use]
    pub fn page(&self) -> String {
        let mut rows = vec![("time", self.time_text())];
        if !self.rig.is_empty() {
            rows.push(("rig", self.rig.clone()));
        }
        if let Some(run) = &self.run {
            rows.push(("session", run.session.clone()));
            rows.push(("plan", run.plan.clone()));
            rows.push(("phase", run.phase.clone()));
            rows.extend(run.outcome.map(|outcome| ("outcome", outcome.name().to_owned())));
            rows.extend(run.reason.clone().map(|reason| ("reason", reason)));
        }
        rows.extend(self.free_bytes.map(|free| ("free", gigabytes(free))));
        if let Some(calibration) = &self.calibration {
            rows.push(("calibration", calibration.name.clone()));
            rows.push(("days left", calibration.days_left.to_string()));
        }
        let rows = rows.iter().map(|(name, value)| format!("{name:<12}{}\n", one_line(value)));
        format!("{}\n\n{}", one_line(&self.text), rows.collect::<String>())
    }

    /// The object as text.
    #[must_use]
    pub fn json(&self) -> String {
        // Texts and numbers under names can always be written.
        serde_json::to_string(self).unwrap_or_default()
    }

    fn time_text(&self) -> String {
        self.time.to_rfc3339_opts(SecondsFormat::Secs, true)
    }
}

/// Bytes in GB of the International System, as disks are sold.
pub(crate) fn gigabytes(bytes: u64) -> String {
    format!("{:.2} GB", bytes as f64 * 1e-9)
}

/// Without control characters, which end a line of a header, and with at most so many letters as people read.
pub(crate) fn one_line(text: &str) -> String {
    const LETTERS_MAX: usize = 1000;
    let plain = |letter: char| if letter.is_control() { ' ' } else { letter };
    text.chars().take(LETTERS_MAX).map(plain).collect::<String>().trim().to_owned()
}

impl Serialize for Notice {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("palpate_notice", &NOTICE_VERSION)?;
        map.serialize_entry("kind", self.kind.name())?;
        map.serialize_entry("text", &one_line(&self.text))?;
        map.serialize_entry("time", &self.time_text())?;
        map.serialize_entry("rig", &self.rig)?;
        if let Some(run) = &self.run {
            map.serialize_entry("session", &run.session)?;
            map.serialize_entry("plan", &run.plan)?;
            map.serialize_entry("phase", &run.phase)?;
            map.serialize_entry("outcome", &run.outcome.map(EndingKind::name))?;
            map.serialize_entry("reason", &run.reason)?;
        }
        if let Some(free) = &self.free_bytes {
            map.serialize_entry("free_bytes", free)?;
        }
        if let Some(calibration) = &self.calibration {
            map.serialize_entry("calibration", &calibration.name)?;
            map.serialize_entry("days_left", &calibration.days_left)?;
        }
        map.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn notice() -> Notice {
        Notice {
            kind: NoticeKind::Failed,
            time: DateTime::from_timestamp(1_780_000_000, 0).unwrap(),
            rig: "bench".into(),
            text: "bench: it ended\r\nearly".into(),
            run: Some(NoticeRun {
                session: "20260528\r\nBcc: eve@example.org".into(),
                plan: "ramp-hold".into(),
                phase: "hold".into(),
                outcome: Some(EndingKind::Interlock),
                reason: Some("force above the ceiling".into()),
            }),
            free_bytes: None,
            calibration: None,
        }
    }

    #[test]
    fn object_has_a_version_and_a_sentence_for_chats() {
        let object: serde_json::Value = serde_json::from_str(&notice().json()).unwrap();
        assert_eq!(
            object,
            serde_json::json!({
                "palpate_notice": 1, "kind": "failed", "text": "bench: it ended  early",
                "time": "2026-05-28T20:26:40Z", "rig": "bench",
                "session": "20260528\r\nBcc: eve@example.org", "plan": "ramp-hold",
                "phase": "hold", "outcome": "interlock", "reason": "force above the ceiling",
            })
        );
    }

    #[test]
    fn no_text_of_a_run_ends_a_line() {
        let subject = notice().subject();
        assert_eq!(subject, "palpate bench failed: ramp-hold 20260528  Bcc: eve@example.org");
        let page = notice().page();
        assert!(page.lines().all(|line| !line.starts_with("Bcc")), "{page}");
        assert!(!page.contains('\r'));
    }

    #[test]
    fn alarms_come_first() {
        assert!(NoticeKind::Alarm < NoticeKind::Failed && NoticeKind::Failed < NoticeKind::Ended);
        assert_eq!(NoticeKind::RULES.len() + 1, NoticeKind::ALL.len());
    }
}
