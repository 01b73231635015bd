//! The page of a report, part by part.

use super::super::budget::{BUDGET_TITLE, UncertaintyBudget};
use super::super::text::{ParameterText, capital, parameter_head, quality};
use super::super::{calibration as calibrations, calibration_plot, figures, session_text};
use super::comparison::comparison;
use super::files::{MADE, attributes, sealed};
use super::history::{afterwards, deviations, events, made_with};
use super::{FitPart, ReportSubject};
use crate::report::figures::TimeAlignment;
use palpate_figures::page::{HtmlBody, document};
use palpate_figures::uncertain::error_alone;
use palpate_rheology::fit::FittedParameter;

pub(super) fn page(subjects: &[ReportSubject], align: TimeAlignment, made: &str) -> String {
    let (title, level) = match subjects {
        [one] => (title_of(one), 2),
        several => (format!("Comparison of {} sessions", several.len()), 3),
    };
    let mut body = HtmlBody::default();
    body.heading(1, &title);
    body.paragraph_with_tag(MADE, made);
    if subjects.len() > 1 {
        let mut part = HtmlBody::default();
        comparison(&mut part, subjects, align);
        body.section("comparison", part);
    }
    for subject in subjects {
        let mut part = HtmlBody::default();
        if level > 2 {
            part.heading(2, &title_of(subject));
        }
        session(&mut part, subject, level);
        body.section("session", part);
    }
    let mut part = HtmlBody::default();
    files(&mut part, subjects);
    body.section("files", part);
    sealed(&document(&title, body))
}

fn title_of(subject: &ReportSubject) -> String {
    let manifest = &subject.manifest;
    let what = match manifest.specimen.trim() {
        "" => subject.name.as_str(),
        specimen => specimen,
    };
    let protocol = manifest.plan["name"].as_str().unwrap_or("imported");
    let day = manifest.started_at.format("%Y-%m-%d %H:%M");
    format!("{what}: {protocol}, {day} UTC")
}

fn session(body: &mut HtmlBody, subject: &ReportSubject, level: u8) {
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

fn summary(body: &mut HtmlBody, subject: &ReportSubject, level: u8) {
    let manifest = &subject.manifest;
    body.heading(level, "Measurement");
    let plan = &manifest.plan;
    let protocol = plan["name"].as_str().map(|name| {
        let version = plan["version"].as_u64().unwrap_or_default();
        format!("{name}, version {version}")
    });
    let mut facts = vec![
        ("session", manifest.session_id.clone()),
        ("folder", subject.name.clone()),
        ("read by analysis", subject.analysis.clone().unwrap_or_default()),
        ("specimen", manifest.specimen.clone()),
        ("operator", manifest.operator.clone()),
        ("started", session_text::format_utc(&manifest.started_at)),
        ("indenter", manifest.indenter.clone()),
        ("protocol", protocol.unwrap_or_default()),
    ];
    let values = plan["source"]["values"].as_object().into_iter().flatten();
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

fn ending(subject: &ReportSubject) -> String {
    match &subject.end {
        Some(end) => format!("{}: {}", end.outcome, end.reason),
        None => "none: the recording was interrupted".to_owned(),
    }
}

fn worth(body: &mut HtmlBody, subject: &ReportSubject, level: u8) {
    body.heading(level, "Data quality");
    let verdict = match subject.edits.verdict() {
        Some((verdict, edit)) => format!("{verdict}, says {}: {}", edit.by, edit.reason),
        None => "none".to_owned(),
    };
    let review = match &subject.review {
        Some(review) => format!("{}; {}", session_text::describe_review(review), review.reason),
        None => "not reviewed".to_owned(),
    };
    let tags: Vec<&str> = subject.edits.tags().into_iter().collect();
    body.facts(
        "Data quality and review",
        &[("verdict", verdict), ("review", review), ("tags", tags.join(", "))],
    );
    if !subject.notes.is_empty() {
        body.paragraph("Notes on the data:");
        body.list(subject.notes.iter().map(String::as_str));
    }
}

fn measured(body: &mut HtmlBody, subject: &ReportSubject, level: u8) {
    body.heading(level, "Force");
    let traces = &subject.traces;
    let thinning = capital(&traces.thinning());
    body.figure(
        &figures::force_time(traces).svg(),
        &format!("Force over time, with shaded phases. {thinning}.{}", traces.limit_above()),
    );
    body.figure(
        &figures::force_depth(traces).svg(),
        "Force over depth from contact. The line has fewer points than the recording; every sample is within half a pixel of it.",
    );
}

fn fit(body: &mut HtmlBody, subject: &ReportSubject, level: u8) {
    body.heading(level, "Fit");
    match &subject.fit {
        Ok(part) => fit_part(body, part),
        Err(reason) => body.paragraph(&format!("Not fitted: {reason}.")),
    }
}

fn fit_part(body: &mut HtmlBody, part: &FitPart) {
    let report = &part.report;
    body.paragraph(&format!("{}; {}.", capital(&report.model), quality(report)));
    parameters(body, &report.parameters);
    body.list(report.sentences().chain(part.remarks.iter().map(String::as_str)));
    let caption = "Measured force, fitted force and the residual. The band around the fitted force is twice the standard uncertainty of the calibration, where the calibration states it. The figure shows the lowest and the highest sample of each pixel column.";
    body.figure(&part.figure.svg(), caption);
}

pub(super) const PARAMETER_HEADS: [&str; 6] = [
    "parameter",
    "value ± standard error",
    "unit",
    "95 % interval",
    "systematic",
    "total 95 % interval",
];

/// Cells of a parameter below [`PARAMETER_HEADS`].
pub(super) fn cells(parameter: &FittedParameter) -> Vec<String> {
    let text = ParameterText::of(parameter);
    let systematic = parameter.systematic_error.map(|error| format!("± {}", error_alone(error)));
    vec![
        text.name,
        text.value,
        text.unit,
        text.interval,
        systematic.unwrap_or_default(),
        text.total,
    ]
}

/// The parameters of a fit and their uncertainty budget.
pub(super) fn parameters(body: &mut HtmlBody, parameters: &[FittedParameter]) {
    let mut rows: Vec<Vec<String>> = parameters.iter().map(cells).collect();
    let statistical = "Parameters. The 95 % interval is statistical";
    if parameters.iter().any(|one| one.total95.is_some()) {
        let caption = format!(
            "{statistical}; the systematic column is the standard uncertainty from calibration and compliance, whose error is the same in every repeat; the total interval includes the statistical and the systematic part."
        );
        body.table(&caption, &PARAMETER_HEADS, &rows);
    } else {
        let known = PARAMETER_HEADS.len() - 2;
        rows.iter_mut().for_each(|row| row.truncate(known));
        body.table(&format!("{statistical}."), &PARAMETER_HEADS[..known], &rows);
    }
    budget(body, parameters);
}

fn budget(body: &mut HtmlBody, parameters: &[FittedParameter]) {
    let budget = UncertaintyBudget::of(parameters);
    let Some(columns) = Some(&budget.parameters).filter(|columns| !columns.is_empty()) else {
        return;
    };
    let heads = columns.iter().map(|one| parameter_head(one.parameter));
    let heads: Vec<String> = std::iter::once("source".to_owned()).chain(heads).collect();
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let sources = budget.sources();
    let row = |source: &&str| {
        let cells = columns.iter().map(|one| {
            let row = one.rows.iter().find(|row| row.source == *source);
            row.map_or(String::new(), |row| format!("{} ({})", row.uncertainty(), row.share()))
        });
        std::iter::once((*source).to_owned()).chain(cells).collect()
    };
    let rows: Vec<Vec<String>> = sources.iter().map(row).collect();
    let caption = format!(
        "{BUDGET_TITLE}: standard uncertainty from each source, and its share of the variance; the largest of each parameter is bold."
    );
    body.table_with_bold(&caption, &heads, &rows, |row, column| {
        columns[column - 1].rows.first().is_some_and(|largest| largest.source == sources[row])
    });
    body.list(budget.remedies.iter().map(String::as_str));
}

fn calibration(body: &mut HtmlBody, subject: &ReportSubject, level: u8) {
    body.heading(level, "Calibration");
    match &subject.calibration {
        None => body.paragraph("The session has no calibration; its forces are those in its file."),
        Some((calibration, Err(reason))) => {
            body.paragraph(&format!("{}: {reason}.", calibration.name));
        }
        Some((calibration, Ok(details))) => {
            body.pre(&calibrations::calibration_page(calibration, None, details, &[]));
            let caption = "The calibration curve with its readings, residuals and slope, and the standard uncertainty of a force with every stated term.";
            body.figure(&calibration_plot::picture(calibration, details), caption);
        }
    }
}

fn files(body: &mut HtmlBody, subjects: &[ReportSubject]) {
    body.heading(2, "Files that this page describes");
    body.paragraph(
        "The table lists the SHA-256 (FIPS 180-4) of each file. 'palpate report --check' or any program that computes SHA-256 can compare this page with the present files.",
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
