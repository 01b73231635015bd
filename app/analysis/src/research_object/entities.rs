//! Entities of a crate's metadata: files, people, specimens, rigs and quantities.

use super::contents::CrateSession;
use super::people::CratePerson;
use super::terms::{self, Term};
use chrono::{DateTime, Utc};
use palpate_model::metadata::{METADATA_KEYS, MetadataKind, SPECIMEN, plain_value};
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// Entities, each once.
#[derive(Debug, Default)]
pub(super) struct Graph {
    pub entities: Vec<Value>,
    ids: BTreeSet<String>,
}

impl Graph {
    /// Adds an entity without its empty properties, a list of one as its item, unless one with its id is there.
    pub fn add(&mut self, mut entity: Value) {
        if let Some(fields) = entity.as_object_mut() {
            fields.retain(|_, value| {
                let is_empty = value.as_array().is_some_and(Vec::is_empty) || *value == "";
                !value.is_null() && !is_empty
            });
            for value in fields.values_mut() {
                if let Some([one]) = value.as_array().map(Vec::as_slice) {
                    *value = one.clone();
                }
            }
        }
        let id = entity["@id"].as_str().unwrap_or_default().to_owned();
        if self.ids.insert(id) {
            self.entities.push(entity);
        }
    }
}

pub(super) fn reference(id: &str) -> Value {
    json!({ "@id": id })
}

/// A time in UTC, in the form of ISO 8601 that both profiles take.
pub(super) fn time(at: DateTime<Utc>) -> String {
    at.format("%Y-%m-%dT%H:%M:%S+00:00").to_string()
}

/// A name as part of an address (RFC 3986, 2.3).
fn encoded(name: &str, kept: &str) -> String {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || kept.as_bytes().contains(&byte);
    let letters = name.bytes().map(|byte| match is_plain(byte) {
        true => char::from(byte).to_string(),
        false => format!("%{byte:02X}"),
    });
    letters.collect()
}

/// The id of a file of the crate.
pub(super) fn iri_of_name(name: &str) -> String {
    encoded(name, "-._~/")
}

/// The id of a folder of the crate.
pub(super) fn folder_id(folder: &str) -> String {
    format!("{}/", iri_of_name(folder))
}

/// The id of something that is no file.
pub(super) fn local_id(kind: &str, name: &str) -> String {
    format!("#{kind}-{}", encoded(name, "-._~"))
}

pub(super) fn person_id(person: &CratePerson, index: usize) -> String {
    person.page().unwrap_or_else(|| format!("#person-{}", index + 1))
}

/// Media types of the files that crates have.
const FORMATS: [(&str, &str); 14] = [
    ("arrow", "application/vnd.apache.arrow.file"),
    ("csv", "text/csv"),
    ("html", "text/html"),
    ("json", "application/json"),
    ("jsonl", "application/x-ndjson"),
    ("mcap", "application/x-mcap"),
    ("md", "text/markdown"),
    ("parquet", "application/vnd.apache.parquet"),
    ("pdf", "application/pdf"),
    ("png", "image/png"),
    ("svg", "image/svg+xml"),
    ("tex", "application/x-tex"),
    ("toml", "application/toml"),
    ("txt", "text/plain"),
];

pub(super) fn file_entity(name: &str, bytes: u64, sum: &str, citation: Value) -> Value {
    let (_, ending) = name.rsplit_once('.').unwrap_or_default();
    let format = FORMATS.iter().find(|(known, _)| *known == ending);
    let short = name.rsplit('/').next().unwrap_or(name);
    json!({
        "@id": iri_of_name(name), "@type": "File", "name": short,
        "description": describe(name), "contentSize": bytes.to_string(), "sha256": sum,
        "encodingFormat": format.map_or("application/octet-stream", |(_, media)| media),
        "citation": citation,
    })
}

/// What a file is, by its place.
fn describe(name: &str) -> &'static str {
    let ends = |ending: &str| name.ends_with(ending);
    match name.split('/').next().unwrap_or_default() {
        "sessions" if ends(".mcap") => "Samples, decisions and settings of a session (MCAP)",
        "sessions" if ends("/edits.jsonl") => "Verdicts, notes and corrections of a session",
        "sessions" if ends("/analyses.jsonl") => "Analyses stored with a session",
        "sessions" => "A file of a session",
        "calibrations" => "A calibration of a load cell, as sessions have it",
        "protocols" => "The steps that sessions were recorded with",
        "library" => "A measured machine compliance",
        "files" => "A further file of the study",
        "results" => "A result of a step",
        "study.toml" => "What the crate is about and what it computes",
        "index.html" => "The crate as a page for people",
        _ => "A file of the crate",
    }
}

/// Id, name and unit of what every session measures.
pub(super) const QUANTITIES: [(&str, &str, &str); 4] = [
    ("#time", "time", "s"),
    ("#force", "force", "N"),
    ("#depth", "depth", "mm"),
    ("#signal", "signal of the load cell", "V"),
];

pub(super) fn quantities(graph: &mut Graph) {
    for (id, name, symbol) in QUANTITIES {
        let unit = terms::unit_term(symbol);
        graph.add(json!({
            "@id": id, "@type": "PropertyValue", "name": name, "unitText": symbol,
            "unitCode": unit.map(terms::UnitTerm::uo_address),
            "sameAs": unit.map(terms::UnitTerm::qudt_address),
        }));
    }
}

fn term_entity(term: &Term, kind: &str, graph: &mut Graph) -> Value {
    let address = term.address();
    graph.add(json!({ "@id": address, "@type": kind, "name": term.name, "identifier": term.code }));
    reference(&address)
}

/// The specimen of a session, with species and organ by their identifiers where they are known.
pub(super) fn specimen(session: &CrateSession, graph: &mut Graph) -> Option<Value> {
    let words = |name: &str| session.labels.value(name).as_ref().map(plain_value);
    let name = words(SPECIMEN)?;
    let id = local_id("specimen", &name);
    let species = words("animal.species");
    let source = words("specimen.source");
    let taxon = species.as_deref().or(source.as_deref()).and_then(terms::species);
    let organ = source.as_deref().or(Some(name.as_str())).and_then(terms::organ);
    let taxon = taxon.map(|term| term_entity(term, "Taxon", graph));
    let organ = organ.map(|term| term_entity(term, "DefinedTerm", graph));
    let parts = [species, source].into_iter().flatten().collect::<Vec<_>>();
    graph.add(json!({
        "@id": id, "@type": "BioChemEntity", "name": name, "description": parts.join("; "),
        "taxonomicRange": taxon, "additionalType": organ,
    }));
    Some(reference(&id))
}

pub(super) fn rig(session: &CrateSession, graph: &mut Graph) -> Option<Value> {
    let rig = session.manifest.rig.as_ref()?;
    let id = local_id("rig", &rig.name);
    graph.add(json!({
        "@id": id, "@type": "IndividualProduct", "name": rig.name, "description": rig.identity,
    }));
    Some(reference(&id))
}

/// The metadata entries of a session, each with its unit.
pub(super) fn entries(session: &CrateSession, graph: &mut Graph) -> Vec<Value> {
    let mut ids = Vec::new();
    for key in METADATA_KEYS {
        let Some(value) = session.labels.value(key.name) else { continue };
        let unit = match key.kind {
            MetadataKind::Number { unit, .. } => Some(unit),
            _ => None,
        };
        // Sessions with the same value share the entity.
        let id = local_id(key.name, &plain_value(&value));
        graph.add(json!({
            "@id": id, "@type": "PropertyValue", "propertyID": key.name, "name": key.meaning,
            "value": value, "unitText": unit,
            "unitCode": unit.and_then(terms::unit_term).map(terms::UnitTerm::uo_address),
        }));
        ids.push(reference(&id));
    }
    ids
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_addresses_that_lead_back_to_them() {
        assert_eq!(iri_of_name("sessions/liver 1/000.mcap"), "sessions/liver%201/000.mcap");
        assert_eq!(folder_id("sessions/ä"), "sessions/%C3%A4/");
        assert_eq!(local_id("step", "a/b"), "#step-a%2Fb");
    }

    #[test]
    fn an_entity_is_there_once_and_without_what_is_empty() {
        let mut graph = Graph::default();
        graph.add(json!({ "@id": "#a", "name": ["one"], "nothing": null, "none": [] }));
        graph.add(json!({ "@id": "#a", "name": "two" }));
        assert_eq!(graph.entities, [json!({ "@id": "#a", "name": "one" })]);
    }
}
