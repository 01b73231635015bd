//! `palpate info`: what a session contains.

use super::Failure;
use super::output::Output;
use clap::Args;
use palpate_analysis::analysed;
use palpate_analysis::report::catalog::one_line;
use palpate_analysis::report::said;
use palpate_model::about::About;
use palpate_model::rig::SignalFacts;
use palpate_runner::base::FoundBase;
use palpate_sessions::analyses::{Analysis, inputs_of};
use palpate_sessions::edits::{Edit, Review, Verdict};
use palpate_sessions::log::Session;
use palpate_sessions::{EDITS_FILE, HealthSummary, Imported};
use serde::Serialize;
use std::path::PathBuf;

/// Tell what a session contains
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// Session folder
    session: PathBuf,
}

#[derive(Serialize)]
struct Info<'a> {
    session_id: &'a str,
    started_at: String,
    software_version: &'a str,
    engine_version: u32,
    record_version: u32,
    operator: &'a str,
    specimen: &'a str,
    indenter: &'a str,
    about: &'a About,
    signal: Option<&'a SignalFacts>,
    imported: Option<&'a Imported>,
    rig: Option<&'a str>,
    rig_settings: Option<&'a std::collections::BTreeMap<String, String>>,
    plan: &'a serde_json::Value,
    acknowledgements: &'a [String],
    samples: usize,
    duration_s: f64,
    phases: Vec<(String, usize)>,
    is_complete: bool,
    ending: Option<&'a str>,
    reason: Option<&'a str>,
    time_use_s: Option<&'a [(String, f64)]>,
    raw_bytes: u64,
    health: Option<&'a HealthSummary>,
    #[serde(flatten)]
    base: FoundBase,
    verdict: Option<Verdict>,
    verdict_reason: Option<&'a str>,
    edits: &'a [Edit],
    tags: Vec<&'a str>,
    review: Option<Review>,
    analyses: &'a [Analysis],
    notes: &'a [String],
}

pub(super) fn run(args: &InfoArgs, output: &Output) -> Result<(), Failure> {
    let opened = analysed::open(&args.session, None).map_err(super::source_failure)?;
    let (session, edits) = (opened.edited.session, opened.edited.edits);
    let mut now = inputs_of(&args.session).map_err(super::recalibrate::failure)?;
    // The review itself is among the edits; what came after it is told by their order.
    now.retain(|one| one.what != EDITS_FILE);
    now.extend(opened.analyses.input());
    let manifest = &session.manifest;
    let info = Info {
        session_id: &manifest.session_id,
        started_at: manifest.started_at_text(),
        software_version: &manifest.software_version,
        engine_version: manifest.engine_version,
        record_version: manifest.record_version,
        operator: &manifest.operator,
        specimen: &manifest.specimen,
        indenter: &manifest.indenter,
        about: &manifest.about,
        signal: manifest.signal.as_ref(),
        imported: manifest.imported.as_ref(),
        rig: manifest.rig.as_ref().map(|rig| rig.identity.as_str()),
        rig_settings: manifest.rig.as_ref().map(|rig| &rig.settings),
        plan: &manifest.plan,
        acknowledgements: &manifest.acknowledgements,
        samples: session.rows.len(),
        duration_s: session.rows.last().map_or(0.0, |row| row.host.seconds().0),
        phases: phases(&session),
        is_complete: session.end.is_some(),
        ending: session.end.as_ref().map(|end| end.outcome.as_str()),
        reason: session.end.as_ref().map(|end| end.reason.as_str()),
        time_use_s: session.end.as_ref().map(|end| end.time_use.as_slice()),
        raw_bytes: session.beside.raw_bytes,
        health: Some(&session.beside.health).filter(|health| health.messages > 0),
        base: FoundBase::of_session(&session),
        verdict: edits.verdict().map(|(verdict, _)| verdict),
        verdict_reason: edits.verdict().map(|(_, edit)| edit.reason.as_str()),
        edits: &edits.all,
        tags: edits.tags().into_iter().collect(),
        review: edits.review(&now),
        analyses: &opened.analyses.all,
        notes: &session.notes,
    };
    output.answer("info", &info, || text(&info));
    Ok(())
}

/// Samples in each stretch of one phase, in order.
fn phases(session: &Session) -> Vec<(String, usize)> {
    let mut phases: Vec<(String, usize)> = Vec::new();
    for row in &session.rows {
        match phases.last_mut() {
            Some((name, count)) if name == row.phase.name() => *count += 1,
            _ => phases.push((row.phase.name().into(), 1)),
        }
    }
    phases
}

fn text(info: &Info<'_>) -> String {
    let or_dash = |text: &str| {
        if text.is_empty() { "-".to_string() } else { one_line(text) }
    };
    let mut lines = vec![
        format!("session    {}", info.session_id),
        format!("started    {}", info.started_at),
        format!("operator   {}", or_dash(info.operator)),
        format!("specimen   {}", or_dash(info.specimen)),
        format!("indenter   {}", or_dash(info.indenter)),
    ];
    lines.extend(
        info.about
            .lines()
            .iter()
            .map(|(key, value)| format!("           {key} {}", one_line(value))),
    );
    lines.extend(protocol_text(info.plan));
    lines.extend(info.imported.map(imported_text));
    lines.extend(info.rig.map(|rig| format!("rig        {rig}")));
    lines.extend(
        info.rig_settings
            .into_iter()
            .flatten()
            .map(|(key, value)| format!("           {key} {value}")),
    );
    let signal = info.signal.map(said::signal);
    lines.extend(signal.map(|lines| format!("signal     {}", lines.join("\n           "))));
    lines.extend(recorded(info));
    lines.extend(info.edits.iter().map(edit_text));
    if !info.tags.is_empty() {
        lines.push(format!("tags       {}", info.tags.join(", ")));
    }
    let review = info.review.as_ref().map(said::review);
    lines.extend(review.map(|review| format!("review     {review}")));
    lines.extend(info.analyses.iter().map(analysis_text));
    let notes = info.notes.iter();
    lines.extend(notes.map(|note| format!("note       {}", one_line(note))));
    lines.join("\n")
}

/// What was recorded, and how that ended.
fn recorded(info: &Info<'_>) -> Vec<String> {
    let mut lines = vec![format!(
        "written by palpate {}, engine {}",
        info.software_version, info.engine_version
    )];
    lines.push(format!("samples    {} over {:.1} s", info.samples, info.duration_s));
    let phases: Vec<String> =
        info.phases.iter().map(|(name, count)| format!("{name} {count}")).collect();
    lines.push(format!("phases     {}", phases.join(", ")));
    lines.extend(info.acknowledgements.iter().map(|line| format!("accepted   {line}")));
    lines.push(match (info.ending, info.reason) {
        (Some(ending), Some(reason)) => format!("ending     {ending}: {reason}"),
        _ => "ending     none: the recording was interrupted".into(),
    });
    if let Some(time_use) = info.time_use_s.filter(|use_s| !use_s.is_empty()) {
        let spent: Vec<String> =
            time_use.iter().map(|(phase, secs)| format!("{phase} {secs:.1} s")).collect();
        lines.push(format!("time use   {}", spent.join(", ")));
    }
    if info.raw_bytes > 0 {
        let count = info.raw_bytes;
        lines.push(format!("raw        {count} bytes as exchanged with devices"));
    }
    let health = info.health.map(said::health).unwrap_or_default();
    lines.extend(health.iter().map(|(name, text)| format!("{name:<10} {text}")));
    let facts = info.base.facts();
    lines.extend(facts.map(|(name, mm, error)| format!("{name:<10} {mm:.3} ± {error:.3} mm")));
    lines
}

fn imported_text(imported: &Imported) -> String {
    let read = imported.readings.iter();
    let mut lines = vec![format!("imported   {}", imported.source())];
    lines.extend(read.map(|one| format!("           {} {}, {}", one.what, one.found, one.how)));
    let facts = imported.facts.iter();
    lines.extend(facts.map(|(key, value)| format!("           {key}: {value}")));
    lines.join("\n")
}

fn edit_text(edit: &Edit) -> String {
    let why = match edit.reason.as_str() {
        "" => String::new(),
        reason => format!(": {}", one_line(reason)),
    };
    format!(
        "edit       {} {}: {}{why}",
        said::at(&edit.at),
        one_line(&edit.by),
        said::change(&edit.change)
    )
}

fn analysis_text(one: &Analysis) -> String {
    let at = said::at(&one.at);
    let why = match one.reason.as_str() {
        "" => String::new(),
        reason => format!(": {reason}"),
    };
    let what = one.what.word();
    format!("analysis   {at} {}: {what} '{}'{why}", one.by, one.name)
}

/// The protocol by name and version with the values chosen, where the plan is one of ours.
fn protocol_text(plan: &serde_json::Value) -> Option<String> {
    let mut line =
        format!("protocol   {}, version {}", plan["name"].as_str()?, plan["version"].as_u64()?);
    if let Some(values) = plan["source"]["values"].as_object() {
        for (name, value) in values {
            line += &format!("\n           {name} {}", value.as_str().unwrap_or_default());
        }
    }
    Some(line)
}
