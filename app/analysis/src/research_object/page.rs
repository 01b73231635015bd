//! `index.html`: a crate as people read it.

use super::completeness::Finding;
use super::contents::CrateSession;
use super::entities::iri_of_name;
use super::metadata::{CrateDescription, METADATA_FILE};
use super::study_file::STUDY_FILE;
use crate::report::session_text::format_utc;
use crate::report::text::counted;
use palpate_figures::page::{HtmlBody, document};
use palpate_model::metadata::plain_value;

pub(super) fn page(about: &CrateDescription<'_>) -> String {
    let study = about.study;
    let origin = about.origin;
    let mut body = HtmlBody::default();
    body.heading(1, &study.title);
    body.paragraph(&format!("Made {} by palpate {}", format_utc(&origin.made_at), origin.version));
    if !study.description.is_empty() {
        body.paragraph(&study.description);
    }
    people(&mut body, about);
    body.heading(2, "Numbers and figures");
    results(&mut body, about);
    body.heading(2, "Compute them again");
    body.paragraph(&format!(
        "'palpate reproduce FOLDER' on this folder, or on its zip file, compares every file with SHA256SUMS, runs every step of {STUDY_FILE} and compares each number and figure. The files here were computed on {}.",
        origin.computer
    ));
    body.heading(2, "Sessions");
    sessions(&mut body, about.sessions);
    body.heading(2, "What a reader will miss");
    missing(&mut body, about.findings, about.sessions.len());
    body.heading(2, "Files");
    body.paragraph(&format!(
        "{} describes every file with its size and SHA-256 for programs.",
        METADATA_FILE
    ));
    let links = about.files.keys().map(|name| (iri_of_name(name), name.clone()));
    body.links(links.collect::<Vec<_>>().iter().map(|(to, name)| (to.as_str(), name.as_str())));
    document(&study.title, body)
}

fn people(body: &mut HtmlBody, about: &CrateDescription<'_>) {
    let study = about.study;
    let rows = study.people.iter().map(|one| {
        vec![
            one.name.clone(),
            one.orcid.clone().unwrap_or_default(),
            one.affiliation.clone().unwrap_or_default(),
        ]
    });
    let rows: Vec<Vec<String>> = rows.collect();
    if !rows.is_empty() {
        body.table("People", &["name", "ORCID", "affiliation"], &rows);
        let pages: Vec<String> = study.people.iter().filter_map(|one| one.page()).collect();
        body.links(pages.iter().map(|page| (page.as_str(), page.as_str())));
    }
    match &study.licence {
        Some(licence) => {
            body.paragraph(&format!("Licence: {}.", licence.name));
            body.links([(licence.url.as_str(), licence.url.as_str())]);
        }
        None => body
            .strong("No licence is stated; ask the people of the crate before you use the data."),
    }
}

fn results(body: &mut HtmlBody, about: &CrateDescription<'_>) {
    for record in about.steps {
        let step = &record.step;
        body.heading(3, &step.name);
        body.pre(&step.line());
        let folder = format!("{}/", step.folder());
        let files = about.files.keys().filter(|name| name.starts_with(&folder));
        let files: Vec<(String, String)> =
            files.map(|name| (iri_of_name(name), name[folder.len()..].to_owned())).collect();
        body.links(files.iter().map(|(to, name)| (to.as_str(), name.as_str())));
    }
}

fn sessions(body: &mut HtmlBody, sessions: &[CrateSession]) {
    let row = |one: &CrateSession| {
        let words =
            |name: &str| one.labels.value(name).as_ref().map(plain_value).unwrap_or_default();
        let verdict = match &one.verdict {
            Some((verdict, reason)) => format!("{verdict}: {reason}"),
            None => "none".to_owned(),
        };
        let analyses: Vec<String> =
            one.analyses.iter().map(|one| format!("{} ({})", one.name, one.kind)).collect();
        let protocol = one.manifest.plan["name"].as_str().unwrap_or("imported");
        vec![
            one.name.clone(),
            words("specimen"),
            words("animal.name"),
            words("operator"),
            format_utc(&one.manifest.started_at),
            protocol.to_owned(),
            verdict,
            one.calibration.as_ref().map(|one| one.name.clone()).unwrap_or_default(),
            analyses.join(", "),
        ]
    };
    let rows: Vec<Vec<String>> = sessions.iter().map(row).collect();
    let heads = [
        "session",
        "specimen",
        "animal",
        "operator",
        "started (UTC)",
        "protocol",
        "verdict",
        "calibration",
        "analyses",
    ];
    let caption = format!("{} of the crate", counted(sessions.len(), "session"));
    body.table(&caption, &heads, &rows);
}

fn missing(body: &mut HtmlBody, findings: &[Finding], of: usize) {
    if findings.is_empty() {
        return body.paragraph("Nothing that the recommendations below name is missing.");
    }
    let sentences: Vec<String> = findings.iter().map(|one| one.text(of)).collect();
    body.list(sentences.iter().map(String::as_str));
    body.heading(3, "Recommendations");
    let mut sources: Vec<_> = findings.iter().map(|one| one.recommendation).collect();
    sources.sort_by_key(|one| one.short);
    sources.dedup();
    let lines: Vec<String> =
        sources.iter().map(|one| format!("[{}] {}", one.short, one.citation)).collect();
    let links = lines.iter().zip(&sources).map(|(line, source)| (source.url, line.as_str()));
    body.links(links);
}
