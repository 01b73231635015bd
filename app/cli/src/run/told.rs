//! What a run came to, and what one will do, in words and as one object.

use super::super::Failure;
use super::super::output::Output;
use super::Led;
use palpate_analysis::report::text::parameter_lines;
use palpate_model::estimate::LiveEstimate;
use palpate_protocols::engine::EndingKind;
use palpate_protocols::preview::Preview;
use palpate_runner::RunView;
use palpate_runner::base::FoundBase;
use palpate_sessions::Verdict;
use palpate_sessions::recover::{Health, Patient, examine};
use serde::Serialize;
use std::path::PathBuf;

#[derive(Serialize)]
struct RunReport {
    plan: String,
    session: PathBuf,
    ending: &'static str,
    reason: String,
    /// What is in the session.
    samples: u64,
    /// What came after it and is in no file, because no disk took it.
    samples_lost: u64,
    duration_s: f64,
    contact_mm: Option<f64>,
    contact_std_error_mm: Option<f64>,
    #[serde(flatten)]
    base: FoundBase,
    force_peak_n: Option<f64>,
    verdict: Option<Verdict>,
    verdict_reason: Option<String>,
    late_worst_s: Option<f64>,
    late_given_up_s: Option<f64>,
    live: Option<LiveEstimate>,
    #[serde(skip_serializing_if = "Option::is_none")]
    slave: Option<serde_json::Value>,
    /// The same in words.
    #[serde(skip)]
    slave_text: Option<String>,
}

pub(super) fn report(view: &RunView, led: Option<&Led>, output: &Output) -> Result<(), Failure> {
    let Some(outcome) = &view.outcome else {
        return Err(Failure::failed("the run did not end"));
    };
    // What a failed disk, or another program, left is only known from what can be read.
    let left = view.log_error.as_ref().map(|_| examine(&view.folder));
    let kept = left.as_ref().map_or(view.samples, |left| left.samples);
    let (slave, slave_text) = led.and_then(|led| (led.report)(output)).unzip();
    let report = RunReport {
        plan: view.plan_name.clone(),
        session: view.folder.clone(),
        ending: outcome.ending.name(),
        reason: outcome.reason.clone(),
        samples: kept,
        samples_lost: view.samples.saturating_sub(kept),
        duration_s: view.now.seconds().0,
        contact_mm: view.contact.map(|contact| contact.position.0),
        contact_std_error_mm: view.contact.map(|contact| contact.std_error_mm),
        base: view.base,
        force_peak_n: view.force_peak.map(|force| force.0),
        verdict: view.verdict.as_ref().map(|(verdict, _)| *verdict),
        verdict_reason: view.verdict.as_ref().map(|(_, reason)| reason.clone()),
        late_worst_s: view.lateness.map(|late| late.worst.0),
        late_given_up_s: view.lateness.map(|late| late.given_up.0),
        live: view.live.clone(),
        slave,
        slave_text,
    };
    if let Some(late) = report.late_given_up_s.filter(|late| *late > 0.0) {
        output.note(&format!(
            "the computer did not keep up: the run took {late:.1} s longer than its session time"
        ));
    }
    output.answer(led.map_or("run", |led| led.command), &report, || run_text(&report));
    if let (Some(reason), Some(left)) = (&view.log_error, &left) {
        return Err(Failure::failed(not_kept(reason, left, &report)));
    }
    let no_verdict = view.verdict_error.as_ref().map(|reason| {
        let folder = view.folder.display();
        format!("the recording is whole, but the verdict could not be written beside it: {reason}; say it again with 'palpate verdict {folder}'")
    });
    if outcome.ending == EndingKind::Finish {
        return no_verdict.map_or(Ok(()), |sentence| Err(Failure::failed(sentence)));
    }
    no_verdict.iter().for_each(|sentence| output.note(sentence));
    Err(Failure::failed(format!(
        "{}: {}; the data so far is in {}",
        outcome.ending,
        outcome.reason,
        view.folder.display()
    )))
}

/// What is missing of a session whose log was not kept as it was written, and what to do.
fn not_kept(reason: &str, left: &Patient, report: &RunReport) -> String {
    let (folder, lost) = (left.path.display(), report.samples_lost);
    let of = report.samples + lost;
    let lost = match left.health {
        Health::Healthy => format!("all {of} samples are there all the same"),
        Health::Interrupted => format!("the last {lost} of {of} samples are lost"),
        _ => format!("{lost} of {of} samples are lost: {}", left.findings.join("; ")),
    };
    let way = match left.health {
        Health::Healthy => format!("look with 'palpate doctor {folder}' before you use them"),
        Health::Foreign | Health::Lost => "measure again".to_owned(),
        _ => format!("'palpate recover {folder}' keeps what is whole"),
    };
    format!("the session log was not kept as it was recorded: {reason}; {lost}; {way}")
}

fn run_text(report: &RunReport) -> String {
    let mut lines = vec![format!(
        "{}: {} after {:.1} s, {} samples in {}",
        report.plan,
        report.ending,
        report.duration_s,
        report.samples,
        report.session.display()
    )];
    if let (Some(at), Some(error)) = (report.contact_mm, report.contact_std_error_mm) {
        lines.push(format!("contact at {at:.3} ± {error:.3} mm from home"));
    }
    let facts = report.base.facts();
    lines.extend(facts.map(|(name, mm, error)| format!("{name} {mm:.3} ± {error:.3} mm")));
    if let Some(peak) = report.force_peak_n {
        lines.push(format!("peak force {peak:.3} N"));
    }
    lines.extend(report.slave_text.clone());
    if let (Some(verdict), Some(reason)) = (report.verdict, &report.verdict_reason) {
        lines.push(format!("{verdict}: {reason}"));
    }
    if let Some(live) = &report.live {
        lines.push(format!(
            "live fit, its statistical part alone ('palpate fit {}' tells what the calibration adds):",
            report.session.display()
        ));
        lines.extend(parameter_lines(&live.parameters));
        let reasons = live.verdicts.iter().filter_map(|verdict| verdict.reason.as_ref());
        lines.extend(reasons.map(|reason| format!("  {reason}")));
    }
    lines.join("\n")
}

pub(super) fn preview_text(preview: &Preview) -> String {
    let mut lines: Vec<String> = preview
        .steps
        .iter()
        .map(|step| {
            format!(
                "{:<10} {:>8.1} s, at most {:.1} s",
                step.phase.name(),
                step.expected.0,
                step.longest.0
            )
        })
        .collect();
    lines.push(format!(
        "total      {:>8.1} s, at most {:.1} s; peak force {:.1} to {:.1}; up to {:.1} MB",
        preview.expected.0,
        preview.longest.0,
        preview.force_band[0],
        preview.force_band[1],
        preview.storage_bytes as f64 * 1e-6
    ));
    lines.extend(preview.refusals.iter().map(|line| format!("refused: {line}")));
    lines.extend(preview.acknowledgements.iter().map(|line| format!("to acknowledge: {line}")));
    lines.extend(preview.notes.iter().map(|line| format!("note: {line}")));
    lines.join("\n")
}
