//! The documents about a run: its start, its streams and its end.

use super::configuration::configuration;
use super::keys::{CELL, Knowledge, PROBE, STAGE, SampleKey, Survey};
use super::unique_id::UniqueId;
use super::{ENTRIES, ENTRY_KEYS, LogFacts, PRIMARY, TableExport};
use palpate_model::metadata::{ANIMAL_PREFIX, SPECIMEN_PREFIX};
use palpate_sessions::manifest::Manifest;
use palpate_sessions::text::sha256;
use serde_json::{Map, Value, json};

const NO_END: &str = "the recording has no end: it was interrupted or is still in progress";

pub(super) struct Heads<'a> {
    table: &'a TableExport<'a>,
    manifest: &'a Manifest,
    log: LogFacts<'a>,
    survey: &'a Survey,
    /// Identifier of the run.
    id: UniqueId,
    /// Wall clock at session time zero, in ns since 1970.
    started_ns: i128,
}

impl<'a> Heads<'a> {
    pub fn new(table: &'a TableExport<'a>, log: LogFacts<'a>, survey: &'a Survey) -> Self {
        let manifest = table.manifest;
        let started = manifest.started_at;
        let nanos = i128::from(started.timestamp_subsec_nanos());
        let started_ns = i128::from(started.timestamp()) * 1_000_000_000 + nanos;
        Self { table, manifest, log, survey, id: id_of_run(table, log, survey), started_ns }
    }

    /// POSIX seconds of a session time in ns, to a quarter of a microsecond.
    pub fn time_at(&self, session_ns: u64) -> f64 {
        (self.started_ns + i128::from(session_ns)) as f64 / 1e9
    }

    pub fn start(&self) -> Value {
        let manifest = self.manifest;
        let mut start: Map<String, Value> = manifest
            .about
            .iter()
            .map(|(key, value)| (plain_key(key), without_dots(value.clone())))
            .collect();
        let mut set = |key: &str, value: Value| {
            if !value.is_null() {
                start.insert(key.to_owned(), value);
            }
        };
        set("uid", self.id.to_string().into());
        set("time", self.time_at(0).into());
        set("plan_name", manifest.plan["name"].as_str().unwrap_or("imported").into());
        set("plan_type", "palpate protocol".into());
        set("plan_args", without_dots(manifest.plan.clone()));
        set("num_points", self.survey.selected.into());
        set("detectors", json!([CELL]));
        set("motors", json!([STAGE]));
        set("hints", json!({ "dimensions": [[["time"], PRIMARY]] }));
        set("sample_name", manifest.specimen.as_str().into());
        set("sample", self.sample());
        set("operator", manifest.operator.as_str().into());
        set("indenter", manifest.indenter.as_str().into());
        set("versions", json!({ "palpate": manifest.software_version }));
        set("palpate", self.palpate());
        Value::Object(start)
    }

    /// The specimen and the animal that it comes from.
    fn sample(&self) -> Value {
        let about = self.manifest.about.iter();
        let about = about
            .filter(|(key, _)| key.starts_with(SPECIMEN_PREFIX) || key.starts_with(ANIMAL_PREFIX));
        let mut sample: Map<String, Value> =
            about.map(|(key, value)| (plain_key(key), value.clone())).collect();
        sample.insert("name".into(), self.manifest.specimen.as_str().into());
        Value::Object(sample)
    }

    /// The manifest apart from plan and calibration, which have places of their own, and what the file has of the session.
    fn palpate(&self) -> Value {
        let Value::Object(mut facts) = json!(self.manifest) else {
            return Value::Null;
        };
        for elsewhere in ["plan", "calibration", "operator", "specimen", "indenter", "about"] {
            facts.remove(elsewhere);
        }
        facts.insert("notes".into(), self.table.notes.into());
        // It was just made of an object.
        let selection = serde_json::from_str(&self.table.selection.to_json());
        facts.insert("selection".into(), selection.unwrap_or_default());
        without_dots(Value::Object(facts))
    }

    /// Descriptor of the stream with an event per sample, and its identifier.
    pub fn sample_descriptor(&self, keys: &[(SampleKey, Knowledge)]) -> (UniqueId, Value) {
        let mut objects: Map<String, Value> = [(PROBE.to_owned(), json!([]))].into_iter().collect();
        let mut data_keys = Map::new();
        for (key, knowledge) in keys {
            let names = objects.entry(key.device()).or_insert_with(|| json!([]));
            if let Some(names) = names.as_array_mut() {
                names.push(key.name().into());
            }
            data_keys.insert(key.name().into(), key.describe(self.manifest, *knowledge));
        }
        let shown: Map<String, Value> = keys
            .iter()
            .filter(|(key, _)| matches!(key, SampleKey::Depth | SampleKey::Force))
            .map(|(key, _)| (key.device().to_owned(), json!({ "fields": [key.name()] })))
            .collect();
        let (id, mut descriptor) = self.descriptor(PRIMARY, Value::Object(data_keys));
        descriptor["object_keys"] = Value::Object(objects);
        descriptor["hints"] = Value::Object(shown);
        descriptor["configuration"] = configuration(self.manifest, self.time_at(0));
        (id, descriptor)
    }

    /// Descriptor of the stream with an event per entry of the log, and its identifier.
    pub fn entry_descriptor(&self) -> (UniqueId, Value) {
        let meanings = [
            "position among all entries of the log",
            "number of samples before the entry",
            "input, decision or fit",
            "the entry as a JSON object",
        ];
        let data_keys: Map<String, Value> = ENTRY_KEYS
            .into_iter()
            .zip(meanings)
            .map(|(name, meaning)| {
                let is_count = matches!(name, "order" | "after_sample");
                let dtype = if is_count { "integer" } else { "string" };
                let key = json!({ "dtype": dtype, "shape": [], "object_name": "log", "meaning": meaning,
                    "source": format!("log:{name}"),
                });
                (name.to_owned(), key)
            })
            .collect();
        let (id, mut descriptor) = self.descriptor(ENTRIES, Value::Object(data_keys));
        descriptor["object_keys"] = json!({ "log": ENTRY_KEYS });
        (id, descriptor)
    }

    fn descriptor(&self, stream: &str, data_keys: Value) -> (UniqueId, Value) {
        let id = self.id.of_name(stream);
        let descriptor = json!({ "uid": id.to_string(), "run_start": self.id.to_string(), "name": stream,
            "time": self.time_at(0), "data_keys": data_keys,
        });
        (id, descriptor)
    }

    pub fn stop(&self, events: u64, entries: u64) -> Value {
        let end = self.log.end;
        let outcome = end.map_or("interrupted", |end| end.outcome.as_str());
        let mut counts = Map::new();
        counts.insert(PRIMARY.into(), events.into());
        if entries > 0 {
            counts.insert(ENTRIES.into(), entries.into());
        }
        json!({ "uid": self.id.of_name("stop").to_string(), "run_start": self.id.to_string(),
            "time": self.time_at(end.map_or(self.survey.last_ns, |end| end.ended_at.0)),
            "exit_status": exit_status(outcome), "outcome": outcome,
            "reason": end.map_or(NO_END, |end| end.reason.as_str()), "num_events": counts,
        })
    }
}

/// The run's identifier: another one for another selection, for corrected data and for a session that has grown.
fn id_of_run(table: &TableExport, log: LogFacts, survey: &Survey) -> UniqueId {
    let content = json!({ "selection": table.selection.to_json(), "notes": table.notes, "samples": survey.seen,
        "outcome": log.end.map(|end| &end.outcome),
    });
    let content = sha256(content.to_string().as_bytes());
    UniqueId::ADDRESSES.of_name(&format!("palpate:{}#{content}", table.manifest.session_id))
}

/// Bluesky's word for an outcome. As its run engine has it, a run that the operator stops and whose data count is a success,
/// one that is aborted or halted is not.
fn exit_status(outcome: &str) -> &'static str {
    match outcome {
        "finish" | "stop" | "imported" => "success",
        "abort" | "halt" => "abort",
        _ => "fail",
    }
}

/// Event-model allows no dot and no slash in a key.
fn plain_key(key: &str) -> String {
    key.replace(['.', '/'], "_")
}

fn without_dots(value: Value) -> Value {
    match value {
        Value::Object(fields) => {
            fields.into_iter().map(|(key, value)| (plain_key(&key), without_dots(value))).collect()
        }
        Value::Array(values) => values.into_iter().map(without_dots).collect(),
        other => other,
    }
}
