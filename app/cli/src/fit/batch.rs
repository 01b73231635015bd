//! Fits many sources on several threads; results come in the order of the sources.

use super::super::{Failure, output::Output, source_failure, terminal::on_ctrl_c};
use palpate_analysis::compliance::ComplianceCorrection;
use palpate_analysis::fit::{FitRecipe, SourceFit, SourceFitError, fit_each};
use palpate_analysis::pool::WorkEvent;
use palpate_analysis::report::text;
use palpate_analysis::source::SourceError;
use palpate_rheology::fit::{FitReport, FittedParameter};
use serde::Serialize;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

type SourceResult = Result<FitReport, SourceFailure>;

enum SourceFailure {
    /// The session was rejected, which is not a failure of the batch.
    Rejected(String),
    Failed(Failure),
}

impl From<SourceFitError> for SourceFailure {
    fn from(none: SourceFitError) -> Self {
        match none {
            SourceFitError::Source(SourceError::Rejected { reason }) => Self::Rejected(reason),
            SourceFitError::Source(err) => Self::Failed(source_failure(err)),
            none => Self::Failed(Failure::failed(none)),
        }
    }
}

#[derive(Serialize)]
struct Line<'a> {
    source: &'a Path,
    #[serde(flatten)]
    report: &'a FitReport,
    notes: &'a [String],
    #[serde(skip_serializing_if = "Option::is_none")]
    compliance: Option<&'a ComplianceCorrection>,
}

pub(super) fn run(
    sources: &[PathBuf],
    jobs: usize,
    recipe: &FitRecipe,
    output: &Output,
) -> Result<(), Failure> {
    let is_ending = Arc::new(AtomicBool::new(false));
    end_on_signals(&is_ending)?;
    let bar = output.count_bar(sources.len() as u64);
    let mut rows = Vec::with_capacity(sources.len());
    let (mut failed, mut rejected) = (0, 0);
    fit_each(sources, jobs, recipe, &is_ending, |event| match event {
        WorkEvent::Done(count) => {
            bar.set_position(count as u64);
            if is_ending.load(Ordering::Relaxed) {
                bar.set_message("the batch ends after the fits in progress");
            }
        }
        WorkEvent::Next(answer) => {
            let source = sources[rows.len()].as_path();
            let path = source.display().to_string();
            let answer = answer.map_err(SourceFitError::from);
            let (notes, compliance, result) = split_answer(answer.and_then(|read| Ok(read?)));
            match &result {
                Err(SourceFailure::Failed(_)) => failed += 1,
                Err(SourceFailure::Rejected(_)) => rejected += 1,
                Ok(_) => {}
            }
            bar.suspend(|| {
                for note in &notes {
                    output.note(&format!("{path}: {note}"));
                }
                match &result {
                    Ok(report) => output.object(&Line {
                        source,
                        report,
                        notes: &notes,
                        compliance: compliance.as_ref(),
                    }),
                    Err(SourceFailure::Rejected(reason)) => {
                        output.object(&json!({ "source": path, "rejected": reason }))
                    }
                    Err(SourceFailure::Failed(failure)) => output.object(&json!({
                        "source": path, "error": failure.sentence(), "exit": failure.code(),
                    })),
                }
            });
            rows.push(result);
        }
    })
    .map_err(|err| {
        Failure::failed(format!("no thread can be started for the fits ({err}); try again"))
    })?;
    drop(bar);
    output.text_only(|| table(sources, &rows));
    if rejected > 0 {
        output.note(&format!(
            "{} sources, {rejected} of them rejected; --include-rejected fits the rejected sources too",
            sources.len()
        ));
    }
    if failed == 0 {
        return Ok(());
    }
    let unfitted = format!("{failed} of {} sources", sources.len());
    Err(Failure::failed(if is_ending.load(Ordering::Relaxed) {
        format!("{unfitted} were not fitted, because the batch was interrupted")
    } else {
        format!("{unfitted} were not fitted; the output states the reasons")
    }))
}

/// The first signal ends after the fits under way, the second at once.
pub(super) fn end_on_signals(is_ending: &Arc<AtomicBool>) -> Result<(), Failure> {
    let is_ending = Arc::clone(is_ending);
    on_ctrl_c(move || {
        if is_ending.swap(true, Ordering::Relaxed) {
            std::process::exit(1);
        }
    })
}

/// Notes, the correction of depths, and the fit or its failure.
fn split_answer(
    answer: Result<SourceFit, SourceFitError>,
) -> (Vec<String>, Option<ComplianceCorrection>, SourceResult) {
    match answer {
        Ok(fitted) => (
            with_correction(fitted.notes, fitted.compliance.as_ref()),
            fitted.compliance,
            fitted.result.map_err(|err| SourceFitError::Fit(err).into()),
        ),
        Err(none) => (Vec::new(), None, Err(none.into())),
    }
}

/// Adds a note on a correction that was applied.
fn with_correction(
    mut notes: Vec<String>,
    correction: Option<&ComplianceCorrection>,
) -> Vec<String> {
    let applied = correction.filter(|correction| correction.is_applied);
    notes.extend(applied.map(ComplianceCorrection::sentence));
    notes
}

/// One row per source: parameters with intervals, quality, number of sentences; or the reason of a failure.
/// Parameters that were fixed everywhere have no column.
fn table(sources: &[PathBuf], rows: &[SourceResult]) -> String {
    let reports = || rows.iter().flatten();
    let known = reports().next().map_or(&[][..], |first| &first.parameters);
    let is_shown = |one: &&FittedParameter| {
        let is_found =
            |report: &FitReport| report.parameter(&one.name).is_some_and(|own| !own.is_fixed);
        reports().any(is_found)
    };
    let shown: Vec<&FittedParameter> = known.iter().filter(is_shown).collect();
    let mut head = vec!["source".to_owned()];
    head.extend(shown.iter().map(|one| text::parameter_head(one)));
    head.extend(["R²", "rmse (mN)", "sentences"].map(String::from));
    let mut lines = vec![head];
    for (source, row) in sources.iter().zip(rows) {
        let mut line = vec![source.display().to_string()];
        match row {
            Ok(report) => {
                let cells = shown.iter().filter_map(|one| report.parameter(&one.name));
                line.extend(cells.map(text::cell));
                line.push(format!("{:.6}", report.r2));
                line.push(format!("{:.3}", report.rmse_n * 1e3));
                line.push(report.sentences().count().to_string());
            }
            Err(SourceFailure::Rejected(reason)) => line.push(format!("rejected: {reason}")),
            Err(SourceFailure::Failed(failure)) => {
                line.push(format!("failed: {}", failure.sentence()));
            }
        }
        lines.push(line);
    }
    text::in_columns(&lines)
}
