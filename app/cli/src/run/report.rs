//! Result and preview of a run, as text and as one object.

use super::super::Failure;
use super::super::output::{Output, merged};
use super::RunLeader;
use palpate_analysis::report::text::parameter_lines;
use palpate_protocols::engine::EndingKind;
use palpate_protocols::preview::Preview;
use palpate_runner::RunView;
use palpate_sessions::recover::{SessionExamination, SessionHealth, examine_session};

pub(super) fn report(
    view: &RunView,
    leader: Option<&RunLeader>,
    output: &Output,
) -> Result<(), Failure> {
    let Some(outcome) = &view.outcome else {
        return Err(Failure::failed("the run did not end"));
    };
    // After a failure of the disk, or interference by another program, only the file shows what is left.
    let remains = view.log_error.as_ref().map(|_| examine_session(&view.folder));
    let samples = remains.as_ref().map_or(view.samples, |session| session.samples);
    let missing = view.samples.saturating_sub(samples);
    let (slave, slave_text) = leader.and_then(|leader| (leader.report)(output)).unzip();
    let mut object = serde_json::json!({
        "plan": view.plan_name,
        "session": view.folder.display().to_string(),
        "ending": outcome.ending.name(),
        "reason": outcome.reason,
        "samples": samples,
        "samples_lost": missing,
        "duration_s": view.now.seconds().0,
        "contact_mm": view.contact.map(|contact| contact.position.0),
        "contact_std_error_mm": view.contact.map(|contact| contact.std_error_mm),
        "force_peak_n": view.force_peak.map(|force| force.0),
        "verdict": view.data_quality.as_ref().map(|(verdict, _)| verdict),
        "verdict_reason": view.data_quality.as_ref().map(|(_, reason)| reason),
        "late_worst_s": view.lateness.map(|late| late.worst.0),
        "late_given_up_s": view.lateness.map(|late| late.given_up.0),
        "live": view.live,
    });
    if let Some(slave) = slave {
        object["slave"] = slave;
    }
    if let Some(late) = view.lateness.map(|late| late.given_up.0).filter(|late| *late > 0.0) {
        output.note(&format!(
            "the computer was too slow: the run took {late:.1} s longer than the session shows"
        ));
    }
    let command = leader.map_or("run", |leader| leader.command);
    output.answer(command, &merged(object, &view.base), || {
        run_text(view, outcome.ending.name(), samples, slave_text)
    });
    if let (Some(reason), Some(session)) = (&view.log_error, &remains) {
        return Err(Failure::failed(log_failure(reason, session, missing)));
    }
    let no_verdict = view.data_quality_error.as_ref().map(|reason| {
        let folder = view.folder.display();
        format!("the recording is complete, but its verdict cannot be saved: {reason}; set the verdict with 'palpate verdict {folder}'")
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

/// Missing samples of a session whose log is not as it was written, and the remedy.
fn log_failure(reason: &str, session: &SessionExamination, missing: u64) -> String {
    let (folder, of) = (session.path.display(), session.samples + missing);
    let loss = match session.health {
        SessionHealth::Healthy => format!("all {of} samples are present"),
        SessionHealth::Interrupted => format!("the last {missing} of {of} samples are missing"),
        _ => format!("{missing} of {of} samples are missing: {}", session.findings.join("; ")),
    };
    let remedy = match session.health {
        SessionHealth::Healthy => {
            format!("check the session with 'palpate doctor {folder}' before use")
        }
        SessionHealth::Foreign | SessionHealth::Lost => "measure again".to_owned(),
        _ => format!("'palpate recover {folder}' keeps the intact part"),
    };
    format!("the session log on disk differs from what was recorded: {reason}; {loss}; {remedy}")
}

fn run_text(view: &RunView, ending: &str, samples: u64, slave: Option<String>) -> String {
    let folder = view.folder.display();
    let mut lines = vec![format!(
        "{}: {ending} after {:.1} s, {samples} samples in {folder}",
        view.plan_name,
        view.now.seconds().0
    )];
    if let Some(contact) = view.contact {
        let (at, error) = (contact.position.0, contact.std_error_mm);
        lines.push(format!("contact at {at:.3} ± {error:.3} mm from home"));
    }
    let facts = view.base.facts();
    lines.extend(facts.map(|(name, mm, error)| format!("{name} {mm:.3} ± {error:.3} mm")));
    lines.extend(view.force_peak.map(|peak| format!("peak force {:.3} N", peak.0)));
    lines.extend(slave);
    lines
        .extend(view.data_quality.as_ref().map(|(verdict, reason)| format!("{verdict}: {reason}")));
    if let Some(live) = &view.live {
        lines.push(format!(
            "live fit, with the statistical uncertainty only ('palpate fit {folder}' adds the uncertainty of the calibration):"
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
        "total      {:>8.1} s, at most {:.1} s; peak force {:.1} to {:.1}; up to {:.1} MB on disk",
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
