//! The page of a report, part by part.

use super::super::page::{Body, document};
use super::super::text::{ParameterText, capital, quality, typeset};
use super::super::{calibration as calibrations, calibration_plot, figures, kept, said};
use super::compared::comparison;
use super::files::{MADE, attributes, sealed};
use super::{FitPart, Subject};
use crate::report::figures::Align;
use crate::widgets::uncertain::{error_alone, interval};
use palpate_model::fit::Parameter;
use palpate_protocols::engine::{Effect, Record};
use palpate_protocols::fidelity::{Achieved, Fidelity};
use palpate_sessions::analyses::Analysed;
use palpate_sessions::record::EntryKind;

/// More events of a session than this make a page that nobody reads.
const EVENTS_MAX: usize = 1000;

/// The whole page.
pub(super) fn page(subjects: &[Subject], align: Align, made: &str) -> String {
    let (title, level) = match subjects {
        [one] => (title_of(one), 2),
        several => (format!("Comparison of {} sessions", several.len()), 3),
    };
    let mut body = Body::default();
    body.heading(1, &title);
    body.opened(MADE, made);
    if subjects.len() > 1 {
        let mut part = Body::default();
        comparison(&mut part, subjects, align);
        body.section("comparison", part);
    }
    for subject in subjects {
        let mut part = Body::default();
        if level > 2 {
            part.heading(2, &title_of(subject));
        }
        session(&mut part, subject, level);
        body.section("session", part);
    }
    let mut part = Body::default();
    files(&mut part, subjects);
    body.section("files", part);
    sealed(&document(&title, body))
}

fn title_of(subject: &Subject) -> String {
    let manifest = &subject.manifest;
    let what = match manifest.specimen.trim() {
        "" => subject.name.as_str(),
        specimen => specimen,
    };
    let protocol = manifest.plan["name"].as_str().unwrap_or("imported");
    let day = manifest.started_at.format("%Y-%m-%d %H:%M");
    format!("{what}: {protocol}, {day} UTC")
}

fn session(body: &mut Body, subject: &Subject, level: u8) {
    summary(body, subject, level);
    worth(body, subject, level);
    measured(body, subject, level);
    fit(body, subject, level);
    if let Some(part) = &subject.cycles {
        body.heading(level, "Cycles");
        body.pre(&part.text);
        let caption = "Loops, peaks, shift and relaxation, cycle by cycle.";
        body.figure(&part.figure, caption);
    }
    calibration(body, subject, level);
    deviations(body, subject, level);
    events(body, subject, level);
    afterwards(body, subject, level);
    made_with(body, subject, level);
}

fn summary(body: &mut Body, subject: &Subject, level: u8) {
    let manifest = &subject.manifest;
    body.heading(level, "What was measured");
    let plan = &manifest.plan;
    let protocol = plan["name"].as_str().map(|name| {
        let version = plan["version"].as_u64().unwrap_or_default();
        format!("{name}, version {version}")
    });
    let mut facts = vec![
        ("session", manifest.session_id.clone()),
        ("folder", subject.name.clone()),
        (
            "read by analysis",
            subject.analysis.clone().unwrap_or_default(),
        ),
        ("specimen", manifest.specimen.clone()),
        ("operator", manifest.operator.clone()),
        ("started", said::at(&manifest.started_at)),
        ("indenter", manifest.indenter.clone()),
        ("protocol", protocol.unwrap_or_default()),
    ];
    let values = plan["source"]["values"].as_object();
    let values = values.into_iter().flatten();
    facts.extend(
        values.map(|(name, value)| (name.as_str(), value.as_str().unwrap_or_default().to_owned())),
    );
    facts.extend(manifest.about.lines());
    let imported = manifest.imported.as_ref();
    facts.extend(imported.map(|from| ("imported from", from.source())));
    let rig = manifest.rig.as_ref().map(|rig| rig.identity.clone());
    facts.push(("rig", rig.unwrap_or_default()));
    facts.push(("ending", ending(subject)));
    let length = format!("{} over {:.1} s", subject.samples, subject.duration_s);
    facts.push(("samples", length));
    let base = subject.base.facts();
    facts.extend(base.map(|(name, mm, error)| (name, format!("{mm:.3} ± {error:.3} mm"))));
    body.facts("The session", &facts);
}

fn ending(subject: &Subject) -> String {
    match &subject.end {
        Some(end) => format!("{}: {}", end.outcome, end.reason),
        None => "none: the recording was interrupted".to_owned(),
    }
}

fn worth(body: &mut Body, subject: &Subject, level: u8) {
    body.heading(level, "What it is worth");
    let verdict = match subject.edits.verdict() {
        Some((verdict, edit)) => format!("{verdict}, says {}: {}", edit.by, edit.reason),
        None => "nobody gave a verdict".to_owned(),
    };
    let review = match &subject.review {
        Some(review) => format!("{}; {}", said::review(review), review.reason),
        None => "nobody reviewed it".to_owned(),
    };
    let tags: Vec<&str> = subject.edits.tags().into_iter().collect();
    body.facts(
        "Verdict and review",
        &[
            ("verdict", verdict),
            ("review", review),
            ("tags", tags.join(", ")),
        ],
    );
    if !subject.notes.is_empty() {
        body.paragraph("What a reader of the data must know:");
        body.list(subject.notes.iter().map(String::as_str));
    }
}

fn measured(body: &mut Body, subject: &Subject, level: u8) {
    body.heading(level, "Force");
    let traces = &subject.traces;
    let thinning = capital(&traces.thinning());
    body.figure(
        &figures::force_time(traces).svg(),
        &format!("Force over time, phases shaded. {thinning}."),
    );
    body.figure(
        &figures::force_depth(traces).svg(),
        "Force over depth from contact. No sample is further than half a pixel from what is drawn.",
    );
}

fn fit(body: &mut Body, subject: &Subject, level: u8) {
    body.heading(level, "Fit");
    match &subject.fit {
        Ok(part) => fit_part(body, part),
        Err(reason) => body.paragraph(&format!("Not fitted: {reason}.")),
    }
}

fn fit_part(body: &mut Body, part: &FitPart) {
    let report = &part.report;
    body.paragraph(&format!("{}; {}.", capital(&report.model), quality(report)));
    let heads = [
        "parameter",
        "value ± standard error",
        "unit",
        "95 % interval",
        "systematic",
    ];
    let rows: Vec<Vec<String>> = report.parameters.iter().map(cells).collect();
    let caption = "Parameters. The interval is statistical; the last column is the standard uncertainty that calibration and compliance add, the same in every repeat.";
    body.table(caption, &heads, &rows);
    body.list(
        report
            .sentences()
            .chain(part.remarks.iter().map(String::as_str)),
    );
    let caption = "Measured and fitted force, with twice the standard uncertainty of the calibration around it where that is stated, and what the fit leaves over. Drawn are the lowest and the highest of each column of pixels.";
    body.figure(&part.figure.svg(), caption);
}

/// Name, value, unit, interval and systematic uncertainty of a parameter.
pub(super) fn cells(parameter: &Parameter) -> Vec<String> {
    let text = ParameterText::of(parameter);
    let ends = parameter.ci95.zip(parameter.std_error);
    let ends = ends.map(|(ends, error)| interval(ends, parameter.value, error));
    let systematic = parameter.systematic_error.map(error_alone);
    vec![
        text.name,
        text.value,
        typeset(&parameter.unit),
        ends.unwrap_or_default(),
        systematic
            .map(|error| format!("± {error}"))
            .unwrap_or_default(),
    ]
}

fn calibration(body: &mut Body, subject: &Subject, level: u8) {
    body.heading(level, "Calibration");
    match &subject.calibration {
        None => body.paragraph("The session has none: its forces are those of its file."),
        Some((calibration, Err(reason))) => {
            body.paragraph(&format!("{}: {reason}.", calibration.name));
        }
        Some((calibration, Ok(told))) => {
            body.pre(&calibrations::whole(calibration, None, told, &[]));
            let caption = "The curve with its readings, what it misses of them, its slope, and the standard uncertainty of a force with every term that is stated.";
            body.figure(&calibration_plot::picture(calibration, told), caption);
        }
    }
}

fn deviations(body: &mut Body, subject: &Subject, level: u8) {
    body.heading(level, "Deviations");
    match &subject.fidelity {
        Err(reason) => body.paragraph(&format!("{}.", capital(reason))),
        Ok(found) => fidelity(body, found),
    }
}

fn fidelity(body: &mut Body, found: &Fidelity) {
    let late = match found.late {
        0 => "none late".to_owned(),
        late => format!("{late} late, by up to {:.0} ms", found.late_worst_s * 1e3),
    };
    let time = &found.time_use;
    let missed = found.missed().count();
    body.facts(
        "How well the run did what its plan said",
        &[
            (
                "samples",
                format!("{}, {} missing, {late}", found.samples, found.dropped),
            ),
            (
                "longest gap",
                format!("{:.1} ms", found.longest_gap_s * 1e3),
            ),
            (
                "time",
                format!(
                    "set-up {:.1} s, motion {:.1} s, hold {:.1} s, waiting {:.1} s",
                    time.set_up_s, time.motion_s, time.hold_s, time.waiting_s
                ),
            ),
            (
                "targets",
                format!("{}, {missed} missed", found.targets.len()),
            ),
        ],
    );
    body.list(found.remarks.iter().map(String::as_str));
    if found.targets.is_empty() {
        return;
    }
    let row = |one: &Achieved| {
        let error = one.error_percent.map_or_else(
            || format!("{:+.4} {}", one.achieved - one.target, one.unit),
            |percent| format!("{percent:+.3} %"),
        );
        vec![
            format!("{} {}", one.step_index + 1, one.step),
            if one.cycle == 0 {
                String::new()
            } else {
                one.cycle.to_string()
            },
            one.quantity.to_owned(),
            format!("{:.4} {}", one.target, one.unit),
            format!("{:.4} {}", one.achieved, one.unit),
            error,
            if one.is_within { "met" } else { "missed" }.to_owned(),
        ]
    };
    let rows: Vec<Vec<String>> = found.targets.iter().map(row).collect();
    let heads = [
        "step", "cycle", "quantity", "target", "achieved", "error", "",
    ];
    body.table("Targets and what was done", &heads, &rows);
}

fn events(body: &mut Body, subject: &Subject, level: u8) {
    let entries = subject.entries.iter();
    let decided = entries.filter(|entry| entry.kind == EntryKind::Decision);
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
        body.table("Written down while it ran", &heads, &rows);
    }
    body.heading(level, "Events");
    let mut rows: Vec<Vec<String>> = others.into_iter().map(row).collect();
    let left = rows.len().saturating_sub(EVENTS_MAX);
    rows.truncate(EVENTS_MAX);
    if rows.is_empty() {
        body.paragraph("None were recorded.");
    } else {
        let heads = ["session time (s)", "what"];
        body.table("What was decided in the run", &heads, &rows);
    }
    if left > 0 {
        body.paragraph(&format!("{left} more are in the log."));
    }
}

fn afterwards(body: &mut Body, subject: &Subject, level: u8) {
    body.heading(level, "What was said and made of it afterwards");
    let edits = &subject.edits.all;
    if edits.is_empty() {
        body.paragraph("Nothing was said of it.");
    } else {
        let row = |edit: &palpate_sessions::Edit| {
            vec![
                said::at(&edit.at),
                edit.by.clone(),
                said::change(&edit.change),
                edit.reason.clone(),
            ]
        };
        let rows: Vec<Vec<String>> = edits.iter().map(row).collect();
        let heads = ["when (UTC)", "by", "what", "why"];
        body.table("Edits, in the order made", &heads, &rows);
    }
    let analyses = &subject.analyses;
    let made = analyses.all.iter();
    let made: Vec<_> = made
        .filter(|one| one.what != Analysed::Withdrawal)
        .collect();
    if made.is_empty() {
        body.paragraph("No analysis is kept beside it.");
        return;
    }
    let rows: Vec<Vec<String>> = made
        .iter()
        .map(|one| {
            let withdrawn = kept::withdrawn(analyses, &one.name);
            vec![
                one.name.clone(),
                one.what.word().to_owned(),
                said::at(&one.at),
                one.by.clone(),
                one.reason.clone(),
                kept::deed(&one.what),
                format!("palpate {}", one.software_version),
                withdrawn.unwrap_or_else(|| "counts".to_owned()),
            ]
        })
        .collect();
    let heads = [
        "name",
        "kind",
        "when (UTC)",
        "by",
        "why",
        "what",
        "made with",
        "state",
    ];
    body.table("Analyses, in the order made", &heads, &rows);
    for one in made {
        let lines = kept::fit_lines(one);
        if !lines.is_empty() {
            body.paragraph(&format!("Fit '{}' found:", one.name));
            body.pre(&lines.join("\n"));
        }
    }
}

fn made_with(body: &mut Body, subject: &Subject, level: u8) {
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
    let signal = manifest.signal.as_ref().map(said::signal);
    facts.extend(signal.map(|lines| ("signal", lines.join("; "))));
    let accepted = manifest.acknowledgements.iter();
    facts.extend(accepted.map(|line| ("accepted before the start", line.clone())));
    facts.extend(said::health(&subject.beside.health));
    body.facts("With what it was measured and read", &facts);
}

fn files(body: &mut Body, subjects: &[Subject]) {
    body.heading(2, "Files that this page describes");
    body.paragraph(
        "Each file by the SHA-256 of its bytes (FIPS 180-4). 'palpate report --check' with this page compares them with the files there are; any other program that makes these hashes can do so too.",
    );
    let mut rows = Vec::new();
    let mut marks = Vec::new();
    for subject in subjects {
        let id = &subject.manifest.session_id;
        for file in &subject.files {
            let place = format!("{}/{}", subject.name, file.what);
            rows.push(vec![place, file.sha256.clone()]);
            marks.push(attributes(id, &subject.name, file));
        }
    }
    let heads = ["file", "SHA-256"];
    body.table_with("Files", &heads, &rows, |index| marks[index].clone());
}
