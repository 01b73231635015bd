//! Comparison of several sessions.

use super::super::figures::{TimeAlignment, Traces, overlays};
use super::super::session_text;
use super::ReportSubject;
use super::html::{PARAMETER_HEADS, cells};
use palpate_figures::page::HtmlBody;

/// Table of the sessions, figures over each other, and a table of parameters.
pub(super) fn comparison(body: &mut HtmlBody, subjects: &[ReportSubject], align: TimeAlignment) {
    body.heading(2, "Comparison");
    let row = |one: &ReportSubject| {
        let verdict = one.edits.verdict();
        vec![
            one.name.clone(),
            one.analysis.clone().unwrap_or_default(),
            one.manifest.specimen.clone(),
            one.manifest.operator.clone(),
            session_text::format_utc(&one.manifest.started_at),
            one.manifest.plan["name"].as_str().unwrap_or("imported").to_owned(),
            verdict.map_or("none".to_owned(), |(verdict, _)| verdict.to_string()),
        ]
    };
    let rows: Vec<Vec<String>> = subjects.iter().map(row).collect();
    let heads =
        ["session", "read by", "specimen", "operator", "started (UTC)", "protocol", "verdict"];
    body.table("Sessions compared", &heads, &rows);
    let traces: Vec<&Traces> = subjects.iter().map(|one| &one.traces).collect();
    let ([time, depth], without_origin) = overlays(&traces, align);
    let left_out = match without_origin.as_slice() {
        [] => String::new(),
        without_origin => {
            format!(" Sessions without this event are not shown: {}.", without_origin.join(", "))
        }
    };
    body.figure(
        &time.svg(),
        &format!(
            "Force over time since {}. The figure shows the lowest and the highest sample of each pixel column.{left_out}",
            align.word()
        ),
    );
    let caption = "Force over depth. The line has fewer points than the recording; every sample is within half a pixel of it.";
    body.figure(&depth.svg(), caption);
    parameters(body, subjects);
}

/// Every parameter, session by session.
fn parameters(body: &mut HtmlBody, subjects: &[ReportSubject]) {
    let fitted: Vec<_> =
        subjects.iter().filter_map(|one| Some((one, &one.fit.as_ref().ok()?.report))).collect();
    let mut rows = Vec::new();
    if let Some((_, first)) = fitted.first() {
        for parameter in &first.parameters {
            for (subject, report) in &fitted {
                let own = report.parameter(&parameter.name);
                rows.extend(own.map(|own| {
                    let mut row = cells(own);
                    row.insert(1, subject.name.clone());
                    row
                }));
            }
        }
    }
    if !rows.is_empty() {
        let mut heads = PARAMETER_HEADS.to_vec();
        heads.insert(1, "session");
        body.table("Parameters of every session", &heads, &rows);
    }
    let refused = subjects.iter().filter_map(|one| {
        let reason = one.fit.as_ref().err()?;
        Some(format!("{} is not fitted: {reason}", one.name))
    });
    let refused: Vec<String> = refused.collect();
    body.list(refused.iter().map(String::as_str));
}
