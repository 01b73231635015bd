//! What the catalog knows of one session. All of it comes from the session's folder.

use super::heads::KnownHeads;
use super::walk::Place;
use crate::analyses::{Analysed, Analyses};
use crate::chain::Head;
use crate::edits::{Edits, Review, Verdict};
use crate::log::Summary;
use crate::manifest::Manifest;
use chrono::{DateTime, Utc};
use palpate_model::quantity::{base_unit, in_base_unit, split};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeSet;

/// One session.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Its folder below the library, with `/` between.
    pub folder: String,
    /// Its name; empty where it cannot be read, as is all that follows but `trouble`.
    pub session_id: String,
    /// Start, UTC, RFC 3339 to the millisecond.
    pub started_at: String,
    /// Who measured.
    pub operator: String,
    /// What was indented.
    pub specimen: String,
    /// The probe, in words.
    pub indenter: String,
    /// Name of the protocol.
    pub protocol: String,
    /// Version of the protocol, where it has one.
    pub protocol_version: Option<u64>,
    /// Title of the protocol, where it has one.
    pub protocol_title: String,
    /// Name of the rig.
    pub rig: String,
    /// The rig, as it describes itself.
    pub rig_identity: String,
    /// Name of the load-cell calibration.
    pub calibration: String,
    /// Serial number of the load cell, where the calibration tells it.
    pub cell: String,
    /// SHA-256 of the compact JSON of the calibration, keys in alphabetical order; empty without one.
    pub calibration_sha256: String,
    /// Version of the program that recorded.
    pub software_version: String,
    /// Samples up to the last whole chunk.
    pub samples: u64,
    /// Session time of the end or, without one, of the last sample, in s.
    pub duration_s: f64,
    /// Bytes of the log.
    pub bytes: u64,
    /// Whether it was recorded here, imported, or recovered.
    pub origin: Origin,
    /// How it ended; `None` if it was interrupted or is being recorded.
    pub ending: Option<String>,
    /// Why it ended.
    pub reason: String,
    /// What it is worth, by the last verdict.
    pub verdict: Option<Verdict>,
    /// Why.
    pub verdict_reason: String,
    /// The last review, and which of edits and analyses have changed since; that the log has not is for
    /// `palpate info`, which reads all of it.
    pub review: Option<Review>,
    /// Words by which it is found.
    pub tags: Vec<String>,
    /// The analyses that count.
    pub analyses: Vec<Made>,
    /// What can be searched by name: parameters of the protocol, what was told, parameters of its fits.
    pub named: Vec<Named>,
    /// Other words of it: acknowledgements, reasons of edits.
    pub words: Vec<String>,
    /// Why it cannot be read, or not all of it.
    pub trouble: Option<String>,
    /// How far its edits and its analyses go, or went when there were most: what confirms that none was taken away.
    pub heads: Heads,
}

/// How far the files of lines beside a log go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Heads {
    /// Its edits.
    pub edits: Head,
    /// Its analyses.
    pub analyses: Head,
}

/// An analysis of a session.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Made {
    /// Its name.
    pub name: String,
    /// `fit`, `recalibration` or `mask`.
    pub what: String,
    /// When.
    pub at: DateTime<Utc>,
    /// By whom.
    pub by: String,
}

/// Where a session comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Origin {
    /// Recorded on a rig.
    #[default]
    Recorded,
    /// Made of another program's file.
    Imported,
    /// What could be kept of a damaged or interrupted one.
    Recovered,
}

palpate_model::named! {
    /// Where a named value stands.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum Source {
        /// In the protocol.
        Plan = "plan",
        /// Among the facts about specimen, probe and series.
        About = "about",
        /// A fitted parameter.
        Fit = "fit",
    }
}

/// A value with a name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Named {
    /// Where it stands.
    pub source: Source,
    /// Its name: a parameter such as `depth`, the key of a step such as `ramp.depth`, a key of what is told.
    pub name: String,
    /// The number, in `unit`; `None` for words.
    pub number: Option<f64>,
    /// Base unit of the number; empty for a count and where the name alone tells it.
    pub unit: String,
    /// As it was written.
    pub text: String,
}

impl Entry {
    /// Reads a session. One that cannot be read has its reason in `trouble`, as has one that lacks lines that are known to
    /// have been there.
    pub(super) fn read(place: &Place, known: &KnownHeads) -> Self {
        let mut entry = Self { folder: place.name.clone(), ..Self::default() };
        match Summary::read(&place.path) {
            Ok(summary) => {
                entry.take_manifest(&summary.manifest);
                entry.take_summary(&summary);
            }
            Err(err) => {
                entry.trouble = Some(err.to_string());
                return entry;
            }
        }
        let id = &entry.session_id;
        let heads = known.of_session(&place.name, id);
        entry.heads = heads;
        let edits = Edits::read_since(&place.path, id, heads.edits);
        let analyses = Analyses::read_since(&place.path, id, heads.analyses);
        let mut trouble = Vec::new();
        let analyses = analyses.unwrap_or_else(|err| {
            trouble.push(err.to_string());
            Analyses { head: heads.analyses, ..Analyses::default() }
        });
        entry.heads.analyses = analyses.head;
        match edits {
            Ok(edits) => entry.take_edits(&edits, &analyses),
            Err(err) => trouble.push(err.to_string()),
        }
        entry.take_analyses(&analyses);
        entry.trouble = (!trouble.is_empty()).then(|| trouble.join("; "));
        entry
    }

    fn take_summary(&mut self, summary: &Summary) {
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
        self.operator.clone_from(&manifest.operator);
        self.specimen.clone_from(&manifest.specimen);
        self.indenter.clone_from(&manifest.indenter);
        self.software_version.clone_from(&manifest.software_version);
        if let Some(rig) = &manifest.rig {
            self.rig.clone_from(&rig.name);
            self.rig_identity.clone_from(&rig.identity);
        }
        self.origin = match (&manifest.recovered, &manifest.imported) {
            (Some(_), _) => Origin::Recovered,
            (None, Some(_)) => Origin::Imported,
            (None, None) => Origin::Recorded,
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
                let (number, unit) = number_of(&text);
                Named {
                    source: Source::Plan,
                    name: name.clone(),
                    number,
                    unit: unit.to_owned(),
                    text,
                }
            }));
        }
        for step in plan["steps"].as_array().into_iter().flatten() {
            let name = step["step"].as_str().unwrap_or("step");
            leaves(name, step, &mut named);
        }
        for (name, text) in manifest.about.lines() {
            named.push(Named {
                source: Source::About,
                name: name.to_owned(),
                number: manifest.about.get(name).and_then(Value::as_f64),
                unit: String::new(),
                text,
            });
        }
        // Steps are repeated; what they say is said once.
        let mut seen = BTreeSet::new();
        named.retain(|one| seen.insert((one.source, one.name.clone(), one.text.clone())));
        self.named = named;
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
        for one in analyses.counting() {
            self.words.extend([one.by.clone(), one.reason.clone()]);
            self.analyses.push(Made {
                name: one.name.clone(),
                what: one.what.word().to_owned(),
                at: one.at,
                by: one.by.clone(),
            });
            if let Analysed::Fit { results, .. } = &one.what {
                let parameters = results["parameters"].as_array();
                self.named.extend(parameters.into_iter().flatten().filter_map(fitted));
            }
        }
    }

    /// Everything in it that is words, for the search of any of them.
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

/// A parameter of a fit, as `palpate fit --json` prints it.
fn fitted(parameter: &Value) -> Option<Named> {
    let number = parameter["value"].as_f64()?;
    Some(Named {
        source: Source::Fit,
        name: parameter["name"].as_str()?.to_owned(),
        number: Some(number),
        unit: parameter["unit"].as_str().unwrap_or_default().to_owned(),
        text: number.to_string(),
    })
}

/// The number in a text such as `20 mm`, in its base unit; none where it is anything else.
fn number_of(text: &str) -> (Option<f64>, &'static str) {
    match split(text) {
        Some((number, "")) => (Some(number), ""),
        Some((number, unit)) => match (in_base_unit(number, unit), base_unit(unit)) {
            (Some(number), Some(unit)) => (Some(number), unit),
            _ => (None, ""),
        },
        None => (None, ""),
    }
}

/// Every number, word and truth in a step of a plan, by the keys that lead to it.
fn leaves(name: &str, value: &Value, named: &mut Vec<Named>) {
    match value {
        Value::Object(inner) => {
            for (key, value) in inner.iter().filter(|(key, _)| *key != "step") {
                leaves(&format!("{name}.{key}"), value, named);
            }
        }
        Value::Number(_) | Value::String(_) | Value::Bool(_) => named.push(Named {
            source: Source::Plan,
            name: name.to_owned(),
            number: value.as_f64(),
            unit: String::new(),
            text: value.as_str().map_or_else(|| value.to_string(), str::to_owned),
        }),
        Value::Array(items) => items.iter().for_each(|item| leaves(name, item, named)),
        Value::Null => {}
    }
}
