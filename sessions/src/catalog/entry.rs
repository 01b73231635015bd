//! The catalog's entry of a session, made from the session's folder.

use super::heads::KnownHeads;
use super::walk::LibrarySession;
use crate::analyses::{Analyses, AnalysisContent, AnalysisError};
use crate::chain::ChainHead;
use crate::edits::{DataQuality, EditError, Edits, Review};
use crate::log::{ReadError, SessionSummary};
use crate::manifest::Manifest;
use chrono::{DateTime, Utc};
use palpate_model::metadata::SessionLabels;
use palpate_model::quantity::{base_unit, in_base_unit, split};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeSet;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CatalogEntry {
    /// Path of the folder below the library, separated by `/`.
    pub folder: String,
    /// Empty, like everything below except `trouble`, if the session cannot be read.
    pub session_id: String,
    /// Start, UTC, RFC 3339 to the millisecond.
    pub started_at: String,
    pub operator: String,
    pub specimen: String,
    pub indenter: String,
    pub protocol: String,
    /// Version of the protocol, where it has one.
    pub protocol_version: Option<u64>,
    /// Title of the protocol, where it has one.
    pub protocol_title: String,
    pub rig: String,
    /// The rig, as it describes itself.
    pub rig_identity: String,
    pub calibration: String,
    /// Serial number of the load cell, if the calibration has one.
    pub cell: String,
    /// SHA-256 of the compact JSON of the calibration, keys in alphabetical order; empty without one.
    pub calibration_sha256: String,
    pub software_version: String,
    /// Samples up to the last whole chunk.
    pub samples: u64,
    /// Session time in s of the end or, without an end, of the last sample.
    pub duration_s: f64,
    pub bytes: u64,
    /// Whether it was recorded here, imported, or recovered.
    pub origin: SessionOrigin,
    /// `None` if the recording was interrupted or is in progress.
    pub ending: Option<String>,
    pub reason: String,
    pub verdict: Option<DataQuality>,
    pub verdict_reason: String,
    /// The last review, compared with the edits and analyses; `palpate info`, which reads the whole log, compares that
    /// too.
    pub review: Option<Review>,
    /// Words by which it is found.
    pub tags: Vec<String>,
    pub analyses: Vec<CatalogAnalysis>,
    /// Values to search by name: protocol parameters, facts about specimen and series, fitted parameters.
    pub named: Vec<NamedValue>,
    /// Further text to search: acknowledgements, authors and reasons of edits and analyses.
    pub words: Vec<String>,
    /// Why the session, or a part of it, cannot be read.
    pub trouble: Option<String>,
    /// A newer version of palpate wrote what cannot be read.
    pub is_newer: bool,
    /// Heads of edits and analyses; if lines are missing now, the heads from before.
    pub heads: SessionHeads,
}

/// Heads of the JSON-lines files beside a log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SessionHeads {
    pub edits: ChainHead,
    pub analyses: ChainHead,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CatalogAnalysis {
    pub name: String,
    /// `fit`, `recalibration` or `mask`.
    pub what: String,
    pub at: DateTime<Utc>,
    pub by: String,
}

/// Where a session comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SessionOrigin {
    #[default]
    Recorded,
    /// Made from another program's file.
    Imported,
    /// The readable part of a damaged or interrupted session.
    Recovered,
}

palpate_model::named! {
    /// Origin of a named value.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum NamedValueSource {
        Plan = "plan",
        /// The facts about specimen, probe and series.
        About = "about",
        Fit = "fit",
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedValue {
    pub source: NamedValueSource,
    /// A parameter such as `depth`, a key of a step such as `ramp.depth`, or a key of the facts.
    pub name: String,
    /// In `unit`; `None` for text.
    pub number: Option<f64>,
    /// Base unit of the number; empty for a count, or where the name implies it.
    pub unit: String,
    pub text: String,
}

impl NamedValue {
    fn new(
        source: NamedValueSource,
        name: &str,
        number: (Option<f64>, &str),
        text: String,
    ) -> Self {
        let (number, unit) = (number.0, number.1.to_owned());
        Self { source, name: name.to_owned(), number, unit, text }
    }
}

impl CatalogEntry {
    /// Reads a session. `trouble` says why one cannot be read, or which known lines are missing.
    pub(super) fn read(session: &LibrarySession, known: &KnownHeads) -> Self {
        let mut entry = Self { folder: session.name.clone(), ..Self::default() };
        let mut labels = match SessionSummary::read(&session.path) {
            Ok(summary) => {
                entry.take_summary(&summary);
                summary.manifest.labels()
            }
            Err(err) => {
                let is_newer = matches!(err, ReadError::Newer { .. });
                return Self { trouble: Some(err.to_string()), is_newer, ..entry };
            }
        };
        let id = &entry.session_id;
        let heads = known.of_session(&session.name, id);
        entry.heads = heads;
        let edits = Edits::read_since(&session.path, id, heads.edits);
        let analyses = Analyses::read_since(&session.path, id, heads.analyses);
        let mut trouble = Vec::new();
        let analyses = analyses.unwrap_or_else(|err| {
            entry.is_newer |= matches!(&err, AnalysisError::Chain(err) if err.is_newer());
            trouble.push(err.to_string());
            Analyses { head: heads.analyses, ..Analyses::default() }
        });
        entry.heads.analyses = analyses.head;
        match edits {
            Ok(edits) => {
                edits.apply_to_labels(&mut labels);
                entry.take_edits(&edits, &analyses);
            }
            Err(err) => {
                entry.is_newer |= matches!(&err, EditError::Chain(err) if err.is_newer());
                trouble.push(err.to_string());
            }
        }
        entry.take_labels(labels);
        entry.take_analyses(&analyses);
        entry.trouble = (!trouble.is_empty()).then(|| trouble.join("; "));
        entry
    }

    fn take_summary(&mut self, summary: &SessionSummary) {
        self.take_manifest(&summary.manifest);
        self.samples = summary.samples;
        self.duration_s = summary.last.seconds().0;
        self.bytes = summary.bytes;
        if let Some(end) = &summary.end {
            self.ending = Some(end.outcome.clone());
            self.reason.clone_from(&end.reason);
        }
    }

    fn take_manifest(&mut self, manifest: &Manifest) {
        self.session_id.clone_from(&manifest.session_id);
        self.started_at = manifest.started_at_text();
        self.software_version.clone_from(&manifest.software_version);
        if let Some(rig) = &manifest.rig {
            self.rig.clone_from(&rig.name);
            self.rig_identity.clone_from(&rig.identity);
        }
        self.origin = match (&manifest.recovered, &manifest.imported) {
            (Some(_), _) => SessionOrigin::Recovered,
            (None, Some(_)) => SessionOrigin::Imported,
            (None, None) => SessionOrigin::Recorded,
        };
        self.words.clone_from(&manifest.acknowledgements);
        if let Some(imported) = &manifest.imported {
            self.words.push(imported.source());
            let facts = imported.facts.iter();
            self.words.extend(facts.map(|(_, fact)| fact.clone()));
        }
        let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
        let (plan, calibration) = (&manifest.plan, &manifest.calibration);
        self.protocol = text(&plan["name"]);
        self.protocol_version = plan["version"].as_u64();
        self.protocol_title = text(&plan["title"]);
        self.calibration = text(&calibration["name"]);
        self.cell = text(&calibration["cell"]);
        if !calibration.is_null() {
            self.calibration_sha256 = crate::text::sha256(calibration.to_string().as_bytes());
        }
        let mut named = Vec::new();
        if let Some(values) = plan["source"]["values"].as_object() {
            named.extend(values.iter().map(|(name, value)| {
                let text = text(value);
                NamedValue::new(NamedValueSource::Plan, name, number_of(&text), text)
            }));
        }
        for step in plan["steps"].as_array().into_iter().flatten() {
            let name = step["step"].as_str().unwrap_or("step");
            collect_leaves(name, step, &mut named);
        }
        // Repeated steps have the same values.
        let mut seen = BTreeSet::new();
        named.retain(|one| seen.insert((one.source, one.name.clone(), one.text.clone())));
        self.named = named;
    }

    fn take_labels(&mut self, labels: SessionLabels) {
        for (name, text) in labels.about.lines() {
            let number = labels.about.get(name).and_then(Value::as_f64);
            self.named.push(NamedValue::new(NamedValueSource::About, name, (number, ""), text));
        }
        self.operator = labels.operator;
        self.specimen = labels.specimen;
        self.indenter = labels.indenter;
    }

    fn take_edits(&mut self, edits: &Edits, analyses: &Analyses) {
        self.heads.edits = edits.head;
        if let Some((verdict, edit)) = edits.verdict() {
            self.verdict = Some(verdict);
            self.verdict_reason.clone_from(&edit.reason);
        }
        self.tags = edits.tags().into_iter().map(str::to_owned).collect();
        let now = analyses.input();
        self.review = edits.review(now.as_slice());
        for edit in &edits.all {
            self.words.extend([edit.by.clone(), edit.reason.clone()]);
        }
    }

    fn take_analyses(&mut self, analyses: &Analyses) {
        for one in analyses.active() {
            self.words.extend([one.by.clone(), one.reason.clone()]);
            self.analyses.push(CatalogAnalysis {
                name: one.name.clone(),
                what: one.what.word().to_owned(),
                at: one.at,
                by: one.by.clone(),
            });
            match &one.what {
                AnalysisContent::Fit { results, .. } => {
                    let parameters = results["parameters"].as_array();
                    self.named.extend(parameters.into_iter().flatten().filter_map(fitted_value));
                }
                AnalysisContent::Material { results, .. } => {
                    self.named.extend(moduli(results));
                }
                _ => {}
            }
        }
    }

    /// All text of the entry, for the full-text search.
    pub(super) fn text(&self) -> String {
        let own = [
            &self.folder,
            &self.session_id,
            &self.operator,
            &self.specimen,
            &self.indenter,
            &self.protocol,
            &self.protocol_title,
            &self.rig,
            &self.rig_identity,
            &self.cell,
            &self.calibration,
            &self.reason,
            &self.verdict_reason,
        ];
        let named = self.named.iter().filter(|one| one.number.is_none());
        let mut words: Vec<&str> = own.into_iter().map(String::as_str).collect();
        words.extend(named.map(|one| one.text.as_str()));
        words.extend(self.words.iter().map(String::as_str));
        words.extend(self.tags.iter().map(String::as_str));
        words.extend(self.analyses.iter().map(|one| one.name.as_str()));
        words.extend(self.trouble.as_deref());
        words.join("\n")
    }
}

/// A parameter in a fit's report, as `palpate fit --json` prints it.
fn fitted_value(parameter: &Value) -> Option<NamedValue> {
    let number = parameter["value"].as_f64()?;
    let unit = parameter["unit"].as_str().unwrap_or_default();
    let name = parameter["name"].as_str()?;
    Some(NamedValue::new(NamedValueSource::Fit, name, (Some(number), unit), number.to_string()))
}

/// Moduli in a report, as `palpate material --json` prints it: numbers, or objects with a value.
fn moduli(results: &Value) -> impl Iterator<Item = NamedValue> {
    let names = ["modulus_mpa", "instantaneous_mpa", "equilibrium_mpa"];
    names.into_iter().filter_map(|name| {
        let modulus = results[name].as_f64().or(results[name]["value"].as_f64())?;
        let text = modulus.to_string();
        Some(NamedValue::new(NamedValueSource::Fit, name, (Some(modulus), ""), text))
    })
}

/// The number in a text such as `20 mm`, converted to its base unit.
fn number_of(text: &str) -> (Option<f64>, &'static str) {
    let Some((number, unit)) = split(text) else { return (None, "") };
    match (in_base_unit(number, unit), base_unit(unit)) {
        _ if unit.is_empty() => (Some(number), ""),
        (Some(number), Some(unit)) => (Some(number), unit),
        _ => (None, ""),
    }
}

/// Collects every number, text and Boolean of a step, named by the path of keys.
fn collect_leaves(name: &str, value: &Value, named: &mut Vec<NamedValue>) {
    match value {
        Value::Object(inner) => {
            for (key, value) in inner.iter().filter(|(key, _)| *key != "step") {
                collect_leaves(&format!("{name}.{key}"), value, named);
            }
        }
        Value::Number(_) | Value::String(_) | Value::Bool(_) => {
            let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            named.push(NamedValue::new(NamedValueSource::Plan, name, (value.as_f64(), ""), text));
        }
        Value::Array(items) => items.iter().for_each(|item| collect_leaves(name, item, named)),
        Value::Null => {}
    }
}
