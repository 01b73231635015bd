//! Several recordings fitted together, with some parameters the same in all.

use super::depths::{CorrectedRecord, settle};
use super::{FitIntervals, IntervalRequest, no_systematic};
use crate::recordings::Recordings;
use crate::report::fit_json::{FitDetails, FitOverlay, JointObject};
use palpate_rheology::fit::{
    FitError, FitOptions, FitSolution, JointReport, SignalRecord, SystematicUncertainty,
    TracedRecord,
};
use palpate_runner::Stopwatch;

/// Stands for all parameters of the specimen.
const BODY: &str = "body";

#[derive(Clone, Debug)]
pub struct JointFitRequest<'a> {
    /// The family, and which of its parameters are found.
    pub options: &'a FitOptions,
    /// Names of the parameters that are the same in all, `body` for all of the specimen.
    pub shared: Vec<&'a str>,
    /// Whether the systematic uncertainty from calibrations and compliances is estimated.
    pub is_systematic: bool,
    /// Intervals that take more than one pass.
    pub intervals: IntervalRequest,
}

/// A fit of several recordings, with the details of each beside its report.
#[derive(Clone, Debug)]
pub struct JointFit {
    pub report: JointReport,
    /// The modelled force along each recording.
    pub overlays: Vec<FitOverlay>,
    /// Intervals of each recording, as far as they were asked for.
    pub intervals: Vec<FitIntervals>,
    /// Systematic uncertainty of each recording.
    pub systematic: Option<Vec<SystematicUncertainty>>,
    /// Wall seconds of the fit alone.
    pub seconds: f64,
    pub notes: Vec<String>,
}

/// Fits recordings together, and corrects their depths by the modelled force where they were corrected. `progress` hears for
/// which recording how many fits of the bootstrap are done.
pub fn fit_together(
    records: &mut Recordings,
    request: &JointFitRequest<'_>,
    mut progress: impl FnMut(usize, usize),
) -> Result<JointFit, FitError> {
    let body = request.options.body_names();
    let names = request.shared.iter().flat_map(|name| match *name {
        BODY => body.clone(),
        name => vec![name],
    });
    let shared: Vec<&str> = names.collect();
    let watch = Stopwatch::start();
    let kept = settle_together(records, request.options, &shared);
    let borrowed = records.borrowed();
    let signals: Vec<SignalRecord<'_>> = records.signals();
    let fitted = FitSolution::fit_signals(&signals, request.options, &shared)?;
    let mut report = fitted.joint_report();
    let seconds = watch.seconds();
    let mut notes: Vec<String> = kept.map(str::to_owned).into_iter().collect();
    let find = |traced: &[TracedRecord<'_>]| fitted.systematic(traced);
    let found = request.is_systematic.then(|| records.systematic(find));
    let systematic = found.and_then(|found| {
        found.unwrap_or_else(|reason| {
            notes.push(no_systematic(&reason));
            None
        })
    });
    if let Some(found) = &systematic {
        report = report.with_systematic(found);
    }
    let overlays = report.records.iter().zip(&borrowed);
    let overlays = overlays.map(|(one, (_, samples))| FitOverlay::of(&one.report, samples));
    let intervals = (0..borrowed.len())
        .map(|record| request.intervals.find(&fitted, record, |done| progress(record, done)));
    Ok(JointFit {
        overlays: overlays.collect(),
        intervals: intervals.collect::<Result<_, _>>()?,
        systematic,
        seconds,
        notes,
        report,
    })
}

fn settle_together(
    records: &mut Recordings,
    options: &FitOptions,
    shared: &[&str],
) -> Option<&'static str> {
    let known: Vec<_> =
        records.all.iter().map(|one| (one.name.clone(), one.signal.clone())).collect();
    let corrected = records.all.iter_mut();
    let corrected =
        corrected.map(|one| CorrectedRecord { samples: &mut one.samples, raw: one.raw.as_ref() });
    settle(&mut corrected.collect::<Vec<_>>(), |samples| {
        let signals = known.iter().zip(samples).map(|((name, signal), samples)| SignalRecord {
            name,
            samples,
            signal: signal.as_ref(),
        });
        let signals: Vec<SignalRecord<'_>> = signals.collect();
        let report = FitSolution::fit_signals(&signals, options, shared)?.joint_report();
        Ok(report.records.into_iter().map(|one| one.report).collect())
    })
}

impl JointFit {
    #[must_use]
    pub fn details<'a>(&'a self, records: &'a Recordings) -> Vec<FitDetails<'a>> {
        self.overlays
            .iter()
            .zip(&self.intervals)
            .zip(&records.all)
            .map(|((overlay, intervals), record)| FitDetails {
                overlay,
                intervals,
                systematic: None,
                compliance: record.compliance.as_ref(),
            })
            .collect()
    }

    #[must_use]
    pub fn object<'a>(
        &'a self,
        options: &FitOptions,
        beside: &[FitDetails<'a>],
    ) -> JointObject<'a> {
        let systematic = self.systematic.as_deref();
        JointObject::of(options.family(), &self.report, beside, systematic, self.seconds)
    }
}
