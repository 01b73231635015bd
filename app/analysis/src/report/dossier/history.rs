//! History of a session: deviations, events, edits and analyses, rig and program.

use super::super::session::{lateness, target_cells};
use super::super::text::capital;
use super::super::{session_text, stored_analysis};
use super::ReportSubject;
use super::html::parameters;
use palpate_figures::page::HtmlBody;
use palpate_protocols::engine::{Effect, Record};
use palpate_runner::fidelity::{Fidelity, TargetResult};
use palpate_sessions::analyses::{Analysis, AnalysisContent};
use palpate_sessions::record::EntryKind;

/// Events listed at most: a page with more is not read.
const EVENTS_MAX: usize = 1000;

pub(super) fn deviations(body: &mut HtmlBody, subject: &ReportSubject, level: u8) {
    body.heading(level, "Deviations");
    match &subject.fidelity {
        Err(reason) => body.paragraph(&format!("{}.", capital(reason))),
        Ok(found) => fidelity(body, found),
    }
}

fn fidelity(body: &mut HtmlBody, found: &Fidelity) {
    let late = lateness(found);
    let time = &found.time_use;
    let missed = found.missed_targets().count();
    body.facts(
        "Samples and time use of the run",
        &[
            ("samples", format!("{}, {} missing, {late}", found.samples, found.dropped)),
            ("longest gap", format!("{:.1} ms", found.longest_gap_s * 1e3)),
            (
                "time",
                format!(
                    "set-up {:.1} s, motion {:.1} s, hold {:.1} s, waiting {:.1} s",
                    time.set_up_s, time.motion_s, time.hold_s, time.waiting_s
                ),
            ),
            ("targets", format!("{}, {missed} missed", found.targets.len())),
        ],
    );
    body.list(found.remarks.iter().map(String::as_str));
    if found.targets.is_empty() {
        return;
    }
    let row = |one: &TargetResult| {
        let mut row = vec![format!("{} {}", one.step_index + 1, one.step)];
        row.extend(target_cells(one));
        row.push(if one.is_within { "met" } else { "missed" }.to_owned());
        row
    };
    let rows: Vec<Vec<String>> = found.targets.iter().map(row).collect();
    let heads = ["step", "cycle", "quantity", "target", "achieved", "error", ""];
    body.table("Targets and achieved values", &heads, &rows);
}

pub(super) fn events(body: &mut HtmlBody, subject: &ReportSubject, level: u8) {
    let decided = subject.entries.iter().filter(|entry| entry.kind == EntryKind::Decision);
    let records = decided.filter_map(|entry| {
        let Ok(Effect::Record(record)) = serde_json::from_value(entry.body.clone()) else {
            return None;
        };
        Some((format!("{:.3}", entry.now.seconds().0), record))
    });
    let (notes, others): (Vec<_>, Vec<_>) =
        records.partition(|(_, record)| matches!(record, Record::Noted { .. }));
    let row = |(at, record): (String, Record)| {
        let text = match record {
            Record::Noted { text } => text,
            other => other.to_string(),
        };
        vec![at, text]
    };
    if !notes.is_empty() {
        body.heading(level, "Notes of the run");
        let rows: Vec<Vec<String>> = notes.into_iter().map(row).collect();
        let heads = ["session time (s)", "note"];
        body.table("Notes made during the run", &heads, &rows);
    }
    body.heading(level, "Events");
    let mut rows: Vec<Vec<String>> = others.into_iter().map(row).collect();
    let remaining = rows.len().saturating_sub(EVENTS_MAX);
    rows.truncate(EVENTS_MAX);
    if rows.is_empty() {
        body.paragraph("None were recorded.");
    } else {
        let heads = ["session time (s)", "event"];
        body.table("Events of the run", &heads, &rows);
    }
    if remaining > 0 {
        body.paragraph(&format!("The log has {remaining} more events."));
    }
}

pub(super) fn afterwards(body: &mut HtmlBody, subject: &ReportSubject, level: u8) {
    body.heading(level, "Edits and analyses");
    let edits = &subject.edits.all;
    if edits.is_empty() {
        body.paragraph("The session has no edits.");
    } else {
        let row = |edit: &palpate_sessions::Edit| {
            vec![
                session_text::format_utc(&edit.at),
                edit.by.clone(),
                session_text::describe_edit(&edit.change),
                edit.reason.clone(),
            ]
        };
        let rows: Vec<Vec<String>> = edits.iter().map(row).collect();
        let heads = ["when (UTC)", "by", "what", "why"];
        body.table("Edits in order of creation", &heads, &rows);
    }
    let analyses = &subject.analyses;
    let made: Vec<_> =
        analyses.all.iter().filter(|one| one.what != AnalysisContent::Withdrawal).collect();
    if made.is_empty() {
        body.paragraph("The session has no analyses.");
        return;
    }
    let row = |one: &&Analysis| {
        let withdrawn = stored_analysis::describe_withdrawal(analyses, &one.name);
        vec![
            one.name.clone(),
            one.what.word().to_owned(),
            session_text::format_utc(&one.at),
            one.by.clone(),
            one.reason.clone(),
            stored_analysis::describe_analysis(&one.what),
            format!("palpate {}", one.software_version),
            withdrawn.unwrap_or_else(|| "counts".to_owned()),
        ]
    };
    let rows: Vec<Vec<String>> = made.iter().map(row).collect();
    let heads = ["name", "kind", "when (UTC)", "by", "why", "what", "made with", "state"];
    body.table("Analyses in order of creation", &heads, &rows);
    for one in made {
        match &one.what {
            AnalysisContent::Fit { results, .. } => {
                body.paragraph(&format!("Fit '{}' found:", one.name));
                parameters(body, &stored_analysis::parameters(results));
                body.list(stored_analysis::sentences(results).iter().map(String::as_str));
            }
            AnalysisContent::Material { words, .. } => {
                body.paragraph(&format!("Material property '{}':", one.name));
                body.pre(words);
            }
            _ => {}
        }
    }
}

pub(super) fn made_with(body: &mut HtmlBody, subject: &ReportSubject, level: u8) {
    let manifest = &subject.manifest;
    body.heading(level, "Rig and program");
    let mut facts = vec![
        (
            "recorded by",
            format!(
                "palpate {}, engine {}, record {}",
                manifest.software_version, manifest.engine_version, manifest.record_version
            ),
        ),
        (
            "read by",
            format!(
                "palpate {}, engine {}",
                env!("CARGO_PKG_VERSION"),
                palpate_protocols::engine::ENGINE_VERSION
            ),
        ),
    ];
    if let Some(rig) = &manifest.rig {
        facts.push(("rig", format!("{}: {}", rig.name, rig.identity)));
        let settings = rig.settings.iter();
        facts.extend(settings.map(|(name, value)| (name.as_str(), value.clone())));
    }
    if let Some(limits) = &manifest.limits {
        facts.push((
            "interlocks",
            format!(
                "force {} to {}, signal {}, {} N/s, position {}",
                limits.force_min,
                limits.force_max,
                limits.volts_max,
                limits.force_rate_max,
                limits.travel_max
            ),
        ));
    }
    let signal = manifest.signal.as_ref().map(session_text::describe_signal);
    facts.extend(signal.map(|lines| ("signal", lines.join("; "))));
    let accepted = manifest.acknowledgements.iter();
    facts.extend(accepted.map(|line| ("acknowledged before the start", line.clone())));
    facts.extend(session_text::describe_health(&subject.auxiliary.health));
    body.facts("Rig, settings and program", &facts);
}
