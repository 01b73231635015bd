//! Facts of a session apart from its samples.

use palpate_analysis::analysed_session::StreamedAnalysis;
use palpate_model::calibration::Calibration;
use palpate_model::signal::track::SignalTrack;
use palpate_protocols::engine::{Effect, Record};
use palpate_sessions::analyses::{AnalysisInput, read_session_inputs};
use palpate_sessions::contacts::contacts;
use palpate_sessions::edits::DataQuality;
use palpate_sessions::health::HealthSummary;
use palpate_sessions::record::{EndRecord, EntryKind, LogEntry};
use serde_json::Value;
use std::path::Path;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SessionEvent {
    /// Number of samples before it.
    pub after_sample: usize,
    pub text: String,
    pub is_alarm: bool,
    /// A person wrote it.
    pub is_note: bool,
}

palpate_model::named! {
    /// The time zero of sessions that are laid over each other.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum TimeOrigin {
        #[default]
        Start = "session start",
        /// The first contact point found.
        Contact = "contact",
        /// The start of the first ramp.
        Ramp = "ramp start",
    }
}

/// Empty texts are names that the session does not have.
#[derive(Clone, Debug)]
pub struct SessionFacts {
    pub operator: String,
    pub specimen: String,
    pub indenter: String,
    pub protocol: String,
    pub rig: String,
    /// The calibration that the forces are made with.
    pub calibration: Option<Calibration>,
    /// With its reason.
    pub verdict: Option<(DataQuality, String)>,
    pub end: Option<EndRecord>,
    pub health: HealthSummary,
    /// In order, without phases.
    pub events: Vec<SessionEvent>,
    /// Samples before the first contact found.
    pub contact: Option<usize>,
    /// Stretches whose forces do not count: from and to in s since the first sample.
    pub left_out_s: Vec<[f64; 2]>,
    /// SHA-256 of each file it is made of.
    pub hashes: Vec<AnalysisInput>,
    /// Remarks of the reader, one sentence each.
    pub notes: Vec<String>,
}

impl SessionFacts {
    #[must_use]
    pub fn of(path: &Path, passing: &StreamedAnalysis) -> Self {
        let (outline, edits) = (&passing.edited.outline, &passing.edited.edits);
        let manifest = &outline.manifest;
        let mut notes = outline.notes.clone();
        let hashes = read_session_inputs(path).unwrap_or_else(|err| {
            notes.push(format!("the hashes of the session's files cannot be computed: {err}"));
            Vec::new()
        });
        let verdict = edits.verdict();
        let first_contact = contacts(&outline.entries).first().copied();
        Self {
            operator: manifest.operator.clone(),
            specimen: manifest.specimen.clone(),
            indenter: manifest.indenter.clone(),
            protocol: manifest.plan["name"].as_str().unwrap_or_default().to_owned(),
            rig: manifest.rig.as_ref().map_or(String::new(), |rig| rig.name.clone()),
            calibration: serde_json::from_value(manifest.calibration.clone()).ok(),
            verdict: verdict.map(|(verdict, edit)| (verdict, edit.reason.clone())),
            end: outline.end.clone(),
            health: outline.auxiliary.health.clone(),
            events: outline.entries.iter().filter_map(event).collect(),
            contact: first_contact.map(|found| found.after_sample as usize),
            left_out_s: passing.left_out_s.clone(),
            hashes,
            notes,
        }
    }

    /// How the computer kept up, in one sentence, and whether it did.
    pub fn health_words(&self) -> (String, bool) {
        let Some(worst) = &self.health.worst else {
            return ("not measured".into(), true);
        };
        let missed = worst.missed_readings;
        let late = worst.lateness_s * 1e3;
        let is_well = missed == 0 && self.health.clock_jumps == 0;
        let words = match (is_well, missed) {
            (true, _) => {
                format!("no readings are missing, and none is more than {late:.1} ms late")
            }
            (false, 0) => format!("the wall clock was set {} times", self.health.clock_jumps),
            (false, missed) => {
                format!("{missed} readings are missing; the others are at most {late:.1} ms late")
            }
        };
        (words, is_well)
    }

    /// Time of the first contact in s since the first sample.
    pub fn contact_time(&self, track: &SignalTrack) -> Option<f64> {
        track.time_of(self.contact?)
    }
}

/// An entry in words; none for entries that the plots show in another way.
fn event(entry: &LogEntry) -> Option<SessionEvent> {
    let made = |text: String, is_alarm: bool, is_note: bool| {
        Some(SessionEvent {
            after_sample: usize::try_from(entry.after_sample).unwrap_or(usize::MAX),
            text,
            is_alarm,
            is_note,
        })
    };
    match entry.kind {
        EntryKind::Fit => None,
        EntryKind::Decision if entry.body["record"] == "noted" => {
            made(entry.body["text"].as_str()?.to_owned(), false, true)
        }
        EntryKind::Decision => match serde_json::from_value(entry.body.clone()).ok()? {
            Effect::Record(Record::PhaseStarted { .. }) => None,
            Effect::Record(record) => {
                let is_alarm = matches!(
                    record,
                    Record::InterlockTripped { .. } | Record::MonitorTripped { .. }
                );
                made(record.to_string(), is_alarm, false)
            }
            Effect::Finished(outcome) => {
                made(format!("{}: {}", outcome.ending, outcome.reason), false, false)
            }
            Effect::Command(_) | Effect::ByHand(_) => None,
        },
        EntryKind::Input => {
            let body = &entry.body;
            match body["input"].as_str()? {
                "operator" => made(format!("operator: {}", words(&body["choice"])), false, false),
                "fault" => made(format!("fault: {}", words(body)), true, false),
                _ => None,
            }
        }
    }
}

/// The words in the body of an entry.
fn words(value: &Value) -> String {
    match value {
        Value::String(text) => text.replace('_', " "),
        Value::Object(fields) => {
            let others = fields.iter().filter(|(key, _)| *key != "input");
            others.map(|(_, value)| words(value)).collect::<Vec<_>>().join(" ")
        }
        Value::Array(values) => values.iter().map(words).collect::<Vec<_>>().join(" "),
        Value::Null => String::new(),
        other => other.to_string(),
    }
}
