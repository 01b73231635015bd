//! `palpate info`: content of a session.

use super::Failure;
use super::output::{Output, merged};
use clap::Args;
use palpate_analysis::analysed_session;
use palpate_analysis::report::catalog::one_line;
use palpate_analysis::report::session_text;
use palpate_runner::base::FoundBase;
use palpate_sessions::analyses::{Analysis, read_session_inputs};
use palpate_sessions::edits::{Edit, Edits, Review};
use palpate_sessions::log::Session;
use palpate_sessions::{EDITS_FILE, HealthSummary, ImportOrigin};
use std::path::PathBuf;

/// Show what a session contains
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// Session folder
    session: PathBuf,
}

/// A session with its journals.
struct Content<'a> {
    session: &'a Session,
    edits: &'a Edits,
    review: Option<Review>,
    analyses: &'a [Analysis],
}

pub(super) fn run(args: &InfoArgs, output: &Output) -> Result<(), Failure> {
    let opened = analysed_session::open(&args.session, None).map_err(super::source_failure)?;
    let (session, edits) = (opened.edited.session, opened.edited.edits);
    let mut now =
        read_session_inputs(&args.session).map_err(super::recalibrate::analysis_failure)?;
    // The review is itself an edit; the order of edits shows what came after it.
    now.retain(|one| one.what != EDITS_FILE);
    now.extend(opened.analyses.input());
    let review = edits.review(&now);
    let content =
        Content { session: &session, edits: &edits, review, analyses: &opened.analyses.all };
    output.answer("info", &content.object(), || content.text());
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

impl Content<'_> {
    fn object(&self) -> serde_json::Value {
        let (session, manifest, end) =
            (self.session, &self.session.manifest, self.session.end.as_ref());
        let rig = manifest.rig.as_ref();
        let verdict = self.edits.verdict();
        let object = serde_json::json!({
            "session_id": manifest.session_id,
            "started_at": manifest.started_at_text(),
            "software_version": manifest.software_version,
            "engine_version": manifest.engine_version,
            "record_version": manifest.record_version,
            "operator": manifest.operator,
            "specimen": manifest.specimen,
            "indenter": manifest.indenter,
            "about": manifest.about,
            "signal": manifest.signal,
            "imported": manifest.imported,
            "rig": rig.map(|rig| &rig.identity),
            "rig_settings": rig.map(|rig| &rig.settings),
            "plan": manifest.plan,
            "acknowledgements": manifest.acknowledgements,
            "samples": session.rows.len(),
            "duration_s": duration_s(session),
            "phases": phases(session),
            "is_complete": end.is_some(),
            "ending": end.map(|end| &end.outcome),
            "reason": end.map(|end| &end.reason),
            "time_use_s": end.map(|end| &end.time_use),
            "raw_bytes": session.auxiliary.raw_bytes,
            "health": health(session),
            "verdict": verdict.map(|(verdict, _)| verdict),
            "verdict_reason": verdict.map(|(_, edit)| &edit.reason),
            "edits": self.edits.all,
            "tags": self.edits.tags(),
            "review": self.review,
            "analyses": self.analyses,
            "notes": session.notes,
        });
        merged(object, &FoundBase::of_session(session))
    }

    fn text(&self) -> String {
        let or_dash = |text: &str| {
            if text.is_empty() { "-".to_string() } else { one_line(text) }
        };
        let manifest = &self.session.manifest;
        let mut lines = vec![
            format!("session    {}", manifest.session_id),
            format!("started    {}", manifest.started_at_text()),
            format!("operator   {}", or_dash(&manifest.operator)),
            format!("specimen   {}", or_dash(&manifest.specimen)),
            format!("indenter   {}", or_dash(&manifest.indenter)),
        ];
        let about = manifest.about.lines();
        lines.extend(
            about.iter().map(|(key, value)| format!("           {key} {}", one_line(value))),
        );
        lines.extend(protocol_text(&manifest.plan));
        lines.extend(manifest.imported.as_ref().map(imported_text));
        if let Some(rig) = &manifest.rig {
            lines.push(format!("rig        {}", rig.identity));
            let settings = rig.settings.iter();
            lines.extend(settings.map(|(key, value)| format!("           {key} {value}")));
        }
        let signal = manifest.signal.as_ref().map(session_text::describe_signal);
        lines.extend(signal.map(|lines| format!("signal     {}", lines.join("\n           "))));
        lines.extend(recording_lines(self.session));
        lines.extend(self.edits.all.iter().map(edit_text));
        let tags: Vec<&str> = self.edits.tags().into_iter().collect();
        if !tags.is_empty() {
            lines.push(format!("tags       {}", tags.join(", ")));
        }
        let review = self.review.as_ref().map(session_text::describe_review);
        lines.extend(review.map(|review| format!("review     {review}")));
        lines.extend(self.analyses.iter().map(analysis_text));
        let notes = self.session.notes.iter();
        lines.extend(notes.map(|note| format!("note       {}", one_line(note))));
        lines.join("\n")
    }
}

fn duration_s(session: &Session) -> f64 {
    session.rows.last().map_or(0.0, |row| row.host.seconds().0)
}

fn health(session: &Session) -> Option<&HealthSummary> {
    Some(&session.auxiliary.health).filter(|health| health.messages > 0)
}

/// The recording and its ending.
fn recording_lines(session: &Session) -> Vec<String> {
    let manifest = &session.manifest;
    let mut lines = vec![format!(
        "written by palpate {}, engine {}",
        manifest.software_version, manifest.engine_version
    )];
    lines.push(format!("samples    {} over {:.1} s", session.rows.len(), duration_s(session)));
    let phases = phases(session);
    let phases: Vec<String> =
        phases.iter().map(|(name, count)| format!("{name} {count}")).collect();
    lines.push(format!("phases     {}", phases.join(", ")));
    lines.extend(manifest.acknowledgements.iter().map(|line| format!("accepted   {line}")));
    lines.push(match &session.end {
        Some(end) => format!("ending     {}: {}", end.outcome.as_str(), end.reason),
        None => "ending     none: the recording was interrupted".into(),
    });
    let time_use = session.end.iter().flat_map(|end| &end.time_use);
    let spent: Vec<String> = time_use.map(|(phase, secs)| format!("{phase} {secs:.1} s")).collect();
    if !spent.is_empty() {
        lines.push(format!("time use   {}", spent.join(", ")));
    }
    let count = session.auxiliary.raw_bytes;
    if count > 0 {
        lines.push(format!("raw        {count} bytes exchanged with the devices"));
    }
    let health = health(session).map(session_text::describe_health).unwrap_or_default();
    lines.extend(health.iter().map(|(name, text)| format!("{name:<10} {text}")));
    let base = FoundBase::of_session(session);
    lines.extend(
        base.facts().map(|(name, mm, error)| format!("{name:<10} {mm:.3} ± {error:.3} mm")),
    );
    lines
}

fn imported_text(imported: &ImportOrigin) -> String {
    let read = imported.readings.iter();
    let mut lines = vec![format!("imported   {}", imported.source())];
    lines.extend(read.map(|one| format!("           {} {}, {}", one.what, one.found, one.how)));
    let facts = imported.facts.iter();
    lines.extend(facts.map(|(key, value)| format!("           {key}: {value}")));
    lines.join("\n")
}

fn edit_text(edit: &Edit) -> String {
    let (at, by, change) = (
        session_text::format_utc(&edit.at),
        one_line(&edit.by),
        session_text::describe_edit(&edit.change),
    );
    format!("edit       {at} {by}: {change}{}", reason_text(&edit.reason))
}

fn analysis_text(one: &Analysis) -> String {
    let (at, kind) = (session_text::format_utc(&one.at), one.what.word());
    format!("analysis   {at} {}: {kind} '{}'{}", one.by, one.name, reason_text(&one.reason))
}

fn reason_text(reason: &str) -> String {
    if reason.is_empty() { String::new() } else { format!(": {}", one_line(reason)) }
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
