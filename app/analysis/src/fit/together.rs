//! Several recordings fitted together, with some parameters the same in all.

use super::{Intervals, IntervalsWanted, no_systematic};
use crate::report::fit_json::{Beside, JointObject, Overlay};
use crate::sources::Recordings;
use palpate_rheology::fit::{
    FitError, FitOptions, Fitted, JointReport, Systematic, Traced, systematic_joint,
};
use palpate_runner::Stopwatch;

/// Stands for all parameters of the specimen.
const BODY: &str = "body";

#[derive(Clone, Debug)]
pub struct TogetherRequest<'a> {
    /// The family, and which of its parameters are found.
    pub options: &'a FitOptions,
    /// Names of the parameters that are the same in all, `body` for all of the specimen.
    pub shared: Vec<&'a str>,
    /// Whether the systematic uncertainty from calibrations and compliances is estimated.
    pub is_systematic: bool,
    /// Intervals that take more than one pass.
    pub intervals: IntervalsWanted,
}

/// A fit of several recordings, with the details of each beside its report.
#[derive(Clone, Debug)]
pub struct Together {
    pub report: JointReport,
    /// The modelled force along each recording.
    pub overlays: Vec<Overlay>,
    /// Intervals of each recording, as far as they were asked for.
    pub intervals: Vec<Intervals>,
    /// Systematic uncertainty of each recording.
    pub systematic: Option<Vec<Systematic>>,
    /// Wall seconds of the fit alone.
    pub seconds: f64,
    pub notes: Vec<String>,
}

/// Fits recordings together. `progress` hears for which recording how many fits of the bootstrap are done.
pub fn fit_together(
    records: &Recordings,
    request: &TogetherRequest<'_>,
    mut progress: impl FnMut(usize, usize),
) -> Result<Together, FitError> {
    let body = request.options.body_names();
    let names = request.shared.iter().flat_map(|name| match *name {
        BODY => body.clone(),
        name => vec![name],
    });
    let shared: Vec<&str> = names.collect();
    let borrowed = records.borrowed();
    let watch = Stopwatch::start();
    let fitted = Fitted::joint(&borrowed, request.options, &shared)?;
    let mut report = fitted.joint_report();
    let seconds = watch.seconds();
    let mut notes = Vec::new();
    let find = |traced: &[Traced<'_>]| systematic_joint(traced, request.options, &shared);
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
    let overlays = overlays.map(|(one, (_, samples))| Overlay::of(&one.report, samples));
    let intervals = (0..borrowed.len())
        .map(|record| request.intervals.find(&fitted, record, |done| progress(record, done)));
    Ok(Together {
        overlays: overlays.collect(),
        intervals: intervals.collect::<Result<_, _>>()?,
        systematic,
        seconds,
        notes,
        report,
    })
}

impl Together {
    #[must_use]
    pub fn beside<'a>(&'a self, records: &'a Recordings) -> Vec<Beside<'a>> {
        self.overlays
            .iter()
            .zip(&self.intervals)
            .zip(&records.all)
            .map(|((overlay, intervals), record)| Beside {
                overlay,
                intervals,
                systematic: None,
                compliance: record.compliance.as_ref(),
            })
            .collect()
    }

    #[must_use]
    pub fn object<'a>(&'a self, options: &FitOptions, beside: &[Beside<'a>]) -> JointObject<'a> {
        let systematic = self.systematic.as_deref();
        JointObject::of(options.family(), &self.report, beside, systematic, self.seconds)
    }
}
