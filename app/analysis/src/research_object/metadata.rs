//! `ro-crate-metadata.json`: what is in a crate and how it came about, in JSON-LD after RO-Crate 1.2
//! (<https://w3id.org/ro/crate/1.2>) and Process Run Crate 0.5 (<https://w3id.org/ro/wfrun/process/0.5>).

use super::completeness::Finding;
use super::computer::ComputerClass;
use super::contents::{CrateSession, ExtractedFile};
use super::entities::{
    self, Graph, file_entity, folder_id, iri_of_name, local_id, person_id, reference, time,
};
use super::run_steps::StepRecord;
use super::study_file::CrateStudy;
use chrono::{DateTime, Utc};
use palpate_protocols::engine::ENGINE_VERSION;
use palpate_sessions::RECORD_VERSION;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Name of the file in a crate.
pub const METADATA_FILE: &str = "ro-crate-metadata.json";
/// The readable page of a crate.
pub const PAGE_FILE: &str = "index.html";
const ROOT: &str = "./";
const CONTEXT: &str = "https://w3id.org/ro/crate/1.2/context";
const SPECIFICATION: &str = "https://w3id.org/ro/crate/1.2";
const PROFILE: &str = "https://w3id.org/ro/wfrun/process/0.5";
/// Beginning of the id of this program, before its version.
const PROGRAM: &str = "pkg:generic/palpate@";

/// With what a crate was made, as far as its numbers depend on it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CrateOrigin {
    pub version: String,
    /// State of the source, where the program knows it.
    pub commit: Option<String>,
    pub computer: ComputerClass,
    /// Pages of the steps are dated with it.
    pub made_at: DateTime<Utc>,
}

impl CrateOrigin {
    /// This program on this computer.
    #[must_use]
    pub fn here(made_at: DateTime<Utc>) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            commit: option_env!("PALPATE_COMMIT").map(str::to_owned),
            computer: ComputerClass::here(),
            made_at,
        }
    }

    /// Whether both are the same program, as far as is known.
    #[must_use]
    pub fn is_same_program(&self, other: &Self) -> bool {
        let is_same_commit = match (&self.commit, &other.commit) {
            (Some(a), Some(b)) => a == b,
            _ => true,
        };
        self.version == other.version && is_same_commit
    }
}

/// Size and hash of every file by name.
pub(super) type FileDescriptions = BTreeMap<String, (u64, String)>;

/// Everything that a crate is described from.
#[derive(Clone, Copy)]
pub(super) struct CrateDescription<'a> {
    pub study: &'a CrateStudy,
    pub sessions: &'a [CrateSession],
    pub steps: &'a [StepRecord],
    pub findings: &'a [Finding],
    pub origin: &'a CrateOrigin,
    pub files: &'a FileDescriptions,
}

/// The text of the metadata file.
pub(super) fn text(about: &CrateDescription<'_>) -> String {
    let mut graph = Graph::default();
    graph.add(json!({
        "@id": METADATA_FILE, "@type": "CreativeWork", "name": "Metadata of the crate",
        "about": reference(ROOT), "conformsTo": reference(SPECIFICATION),
    }));
    root(about, &mut graph);
    graph.add(json!({
        "@id": PROFILE, "@type": ["CreativeWork", "Profile"], "name": "Process Run Crate", "version": "0.5",
    }));
    people(about, &mut graph);
    program(about.origin, &mut graph);
    entities::quantities(&mut graph);
    for session in about.sessions {
        session_entities(about, session, &mut graph);
    }
    for step in about.steps {
        step_entities(about, step, &mut graph);
    }
    for (name, (bytes, sum)) in about.files {
        graph.add(file_entity(name, *bytes, sum, page_citations(name, about.findings)));
    }
    for finding in about.findings {
        let by = finding.recommendation;
        graph.add(json!({
            "@id": by.url, "@type": "CreativeWork", "name": by.citation,
        }));
    }
    let object = json!({ "@context": CONTEXT, "@graph": graph.entities });
    format!("{object:#}\n")
}

fn page_citations(name: &str, findings: &[Finding]) -> Value {
    match name {
        PAGE_FILE => {
            let mut urls: Vec<&str> = findings.iter().map(|one| one.recommendation.url).collect();
            urls.sort_unstable();
            urls.dedup();
            urls.into_iter().map(reference).collect()
        }
        _ => Value::Null,
    }
}

fn root(about: &CrateDescription<'_>, graph: &mut Graph) {
    let study = about.study;
    let in_folder = |name: &str| {
        let is_below =
            |folder: String| name.strip_prefix(&folder).is_some_and(|rest| rest.starts_with('/'));
        about.sessions.iter().any(|one| is_below(one.folder()))
            || about.steps.iter().any(|one| is_below(one.step.folder()))
    };
    let folders = about.sessions.iter().map(|one| folder_id(&one.folder()));
    let folders = folders.chain(about.steps.iter().map(|one| folder_id(&one.step.folder())));
    let alone = about.files.keys().filter(|name| !in_folder(name)).map(|name| iri_of_name(name));
    let parts: Vec<Value> = folders.chain(alone).map(|id| reference(&id)).collect();
    let actions = about.sessions.iter().map(|one| local_id("recording", &one.name));
    let actions = actions.chain(about.steps.iter().map(|one| local_id("step", &one.step.name)));
    let actions: Vec<Value> = actions.map(|id| reference(&id)).collect();
    let description = match study.description.as_str() {
        "" => study.title.as_str(),
        words => words,
    };
    let licence = match &study.licence {
        Some(licence) => {
            graph.add(json!({
                "@id": licence.url, "@type": "CreativeWork", "name": licence.name,
                "description": format!("The licence {} of this crate", licence.id), "url": licence.url,
            }));
            reference(&licence.url)
        }
        None => {
            graph.add(json!({
                "@id": "#licence", "@type": "CreativeWork", "name": "No licence is stated",
                "description": "Whoever wants to use the data has to ask the people of the crate.",
            }));
            reference("#licence")
        }
    };
    let authors: Vec<Value> = authors(about).iter().map(|id| reference(id)).collect();
    graph.add(json!({
        "@id": ROOT, "@type": "Dataset", "name": study.title, "description": description,
        "datePublished": about.origin.made_at.format("%Y-%m-%d").to_string(),
        "dateCreated": time(about.origin.made_at),
        "conformsTo": reference(PROFILE), "license": licence, "author": authors, "hasPart": parts,
        "mentions": actions, "variableMeasured": entities::QUANTITIES.map(|one| reference(one.0)),
    }));
}

/// People of the study, else whoever operated the rig.
fn authors(about: &CrateDescription<'_>) -> Vec<String> {
    let people = &about.study.people;
    let named: Vec<String> =
        people.iter().enumerate().map(|(index, one)| person_id(one, index)).collect();
    if !named.is_empty() {
        return named;
    }
    let mut operators: Vec<String> =
        about.sessions.iter().filter_map(|one| operator_id(about, &one.labels.operator)).collect();
    operators.sort();
    operators.dedup();
    operators
}

/// The person of the study with this name, or one who is known by this name only.
fn operator_id(about: &CrateDescription<'_>, name: &str) -> Option<String> {
    let name = name.trim();
    let mut known = about.study.people.iter().enumerate();
    match known.find(|(_, one)| one.name == name) {
        Some((index, one)) => Some(person_id(one, index)),
        None => (!name.is_empty()).then(|| local_id("operator", name)),
    }
}

fn people(about: &CrateDescription<'_>, graph: &mut Graph) {
    for (index, one) in about.study.people.iter().enumerate() {
        let affiliation = one.affiliation.as_ref().map(|name| {
            let id = local_id("organization", name);
            graph.add(json!({ "@id": id, "@type": "Organization", "name": name }));
            reference(&id)
        });
        graph.add(json!({
            "@id": person_id(one, index), "@type": "Person", "name": one.name,
            "affiliation": affiliation, "identifier": one.page(),
        }));
    }
    for session in about.sessions {
        if let Some(id) = operator_id(about, &session.labels.operator) {
            let name = session.labels.operator.trim();
            graph.add(json!({ "@id": id, "@type": "Person", "name": name }));
        }
    }
}

fn program(origin: &CrateOrigin, graph: &mut Graph) {
    let computer = &origin.computer;
    let facts = [
        ("commit", json!(origin.commit)),
        ("engine", json!(ENGINE_VERSION)),
        ("record", json!(RECORD_VERSION)),
        ("architecture", json!(computer.architecture)),
        ("system", json!(computer.system)),
        ("vectors", json!(computer.vectors)),
        ("functions", json!(computer.functions)),
    ];
    let mut ids = Vec::new();
    for (name, value) in facts.into_iter().filter(|(_, value)| !value.is_null() && value != "") {
        let id = local_id("palpate", name);
        graph.add(json!({
            "@id": id, "@type": "PropertyValue", "name": name, "propertyID": name, "value": value,
        }));
        ids.push(reference(&id));
    }
    graph.add(json!({
        "@id": program_id(&origin.version), "@type": "SoftwareApplication", "name": "palpate",
        "description": "Workbench for soft-tissue indentation", "version": origin.version,
        "url": program_id(&origin.version), "additionalProperty": ids,
    }));
}

/// The id of a version of this program, as bills of materials give it (ECMA-427, package URL).
fn program_id(version: &str) -> String {
    format!("{PROGRAM}{version}")
}

/// The program that recorded a session, or imported it.
fn recorder(session: &CrateSession, graph: &mut Graph) -> Value {
    let version = &session.manifest.software_version;
    let id = program_id(version);
    graph.add(json!({
        "@id": id, "@type": "SoftwareApplication", "name": "palpate",
        "version": version, "url": id,
    }));
    reference(&id)
}

fn session_entities(about: &CrateDescription<'_>, session: &CrateSession, graph: &mut Graph) {
    let folder = session.folder();
    let id = folder_id(&folder);
    let parts = about.files.keys().filter(|name| name.starts_with(&format!("{folder}/")));
    let parts: Vec<Value> = parts.map(|name| reference(&iri_of_name(name))).collect();
    let manifest = &session.manifest;
    let verdict = match &session.verdict {
        Some((verdict, reason)) => format!("; {verdict}: {reason}"),
        None => String::new(),
    };
    let protocol = manifest.plan["name"].as_str().unwrap_or("imported");
    let specimen = entities::specimen(session, graph);
    let rig = entities::rig(session, graph);
    let described = [specimen.clone(), rig].into_iter().flatten();
    let described: Vec<Value> = described.collect();
    let entries = entities::entries(session, graph);
    graph.add(json!({
        "@id": id, "@type": "Dataset", "name": session.name,
        "description": format!("Session {} of the protocol {protocol}, {} samples{verdict}", manifest.session_id, session.samples),
        "identifier": manifest.session_id, "dateCreated": time(manifest.started_at),
        "measurementTechnique": "indentation", "about": described, "hasPart": parts,
        "variableMeasured": entities::QUANTITIES.map(|one| reference(one.0)),
        "additionalProperty": entries,
    }));
    let inputs = [&session.protocol, &session.calibration];
    let inputs =
        inputs.into_iter().flatten().map(|one: &ExtractedFile| reference(&iri_of_name(&one.file)));
    let inputs: Vec<Value> = inputs.collect();
    let recorder = recorder(session, graph);
    let what = if manifest.imported.is_some() { "Import" } else { "Recording" };
    graph.add(json!({
        "@id": local_id("recording", &session.name), "@type": "CreateAction",
        "name": format!("{what} of {}", session.name),
        "description": format!("{what} of the protocol {protocol}"),
        "startTime": time(manifest.started_at), "endTime": time(session.ended_at()),
        "instrument": recorder, "object": inputs, "result": reference(&id),
        "agent": operator_id(about, &session.labels.operator).map(|id| reference(&id)),
        "actionStatus": "http://schema.org/CompletedActionStatus",
    }));
}

fn step_entities(about: &CrateDescription<'_>, record: &StepRecord, graph: &mut Graph) {
    let step = &record.step;
    let folder = step.folder();
    let results = about.files.keys().filter(|name| name.starts_with(&format!("{folder}/")));
    let results: Vec<Value> = results.map(|name| reference(&iri_of_name(name))).collect();
    graph.add(json!({
        "@id": folder_id(&folder), "@type": "Dataset", "name": format!("Results of {}", step.name),
        "description": format!("Files that '{}' wrote", step.line()), "hasPart": results,
    }));
    let is_read = |path: &str| {
        let own = |word: &String| {
            path == word || path.starts_with(&format!("{}/", word.trim_end_matches('/')))
        };
        step.words.iter().any(own)
    };
    let sessions = about.sessions.iter().filter(|one| is_read(&one.folder()));
    let sessions = sessions.map(|one| folder_id(&one.folder()));
    let others = about.files.keys().filter(|name| !name.starts_with("sessions/") && is_read(name));
    let others = others.filter(|name| !name.starts_with(&format!("{folder}/")));
    let objects: Vec<Value> =
        sessions.chain(others.map(|name| iri_of_name(name))).map(|id| reference(&id)).collect();
    let agent = authors(about).first().map(|id| reference(id));
    graph.add(json!({
        "@id": local_id("step", &step.name), "@type": "CreateAction", "name": step.name,
        "description": step.line(), "instrument": reference(&program_id(&about.origin.version)), "object": objects,
        "result": results, "agent": agent,
        "startTime": time(record.started_at), "endTime": time(record.ended_at),
        "actionStatus": "http://schema.org/CompletedActionStatus",
    }));
}

/// With what a crate says it was made.
pub(super) fn read_origin(text: &str) -> Result<CrateOrigin, String> {
    let object: Value = serde_json::from_str(text).map_err(|err| err.to_string())?;
    let graph = object["@graph"].as_array().ok_or("it has no @graph")?;
    let find = |id: &str| graph.iter().find(|one| one["@id"] == id);
    // Programs that recorded sessions have no properties.
    let is_maker = |one: &&Value| {
        let id = one["@id"].as_str().unwrap_or_default();
        id.starts_with(PROGRAM) && !one["additionalProperty"].is_null()
    };
    let program = graph.iter().find(is_maker).ok_or("it does not say which palpate made it")?;
    let words = |value: &Value| value.as_str().map(str::to_owned);
    let fact = |name: &str| words(&find(&local_id("palpate", name))?["value"]);
    let made_at = find(ROOT).and_then(|root| words(&root["dateCreated"]));
    let made_at = made_at.ok_or("it has no dateCreated")?;
    let made_at = DateTime::parse_from_rfc3339(&made_at).map_err(|err| err.to_string())?;
    Ok(CrateOrigin {
        version: words(&program["version"]).ok_or("it states no version of palpate")?,
        commit: fact("commit"),
        computer: ComputerClass {
            architecture: fact("architecture").unwrap_or_default(),
            system: fact("system").unwrap_or_default(),
            vectors: fact("vectors").unwrap_or_default(),
            functions: fact("functions").unwrap_or_default(),
        },
        made_at: made_at.with_timezone(&Utc),
    })
}
