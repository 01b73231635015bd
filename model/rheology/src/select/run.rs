//! The selection itself: fits, criteria, predictions, costs, verdict.

use super::cost::StepCost;
use super::criteria::criteria;
use super::facts::{RecordFacts, peak_force};
use super::hold_out::{Fold, HoldOut, HoldOutError, HoldOutPrediction, folds, predict_fold};
use super::ladder::{LadderStep, steps};
use super::verdict::{SampleCounts, SelectionVerdict, decide};
use crate::families::{Family, Model, all_families};
use crate::fit::{FitError, FitOptions, FitSample, JointReport, fit_joint};
use crate::tolerance::Tolerance;
use palpate_model::units::Newtons;
use serde::Serialize;
use std::ops::ControlFlow;
use std::sync::Arc;
use thiserror::Error;

/// Families to compare, and the criterion.
#[derive(Debug)]
pub struct SelectOptions {
    pub families: Vec<Arc<dyn Family>>,
    /// Error of force that does not matter; without it information criteria alone decide.
    pub tolerance: Option<Tolerance>,
    pub hold_out: HoldOut,
    /// The specimen of each record, in their order; fewer where the others are not known.
    pub specimens: Vec<Option<String>>,
}

impl Default for SelectOptions {
    fn default() -> Self {
        Self {
            families: all_families(),
            tolerance: None,
            hold_out: HoldOut::Auto,
            specimens: Vec::new(),
        }
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SelectProgress {
    pub done: usize,
    pub total: usize,
    pub family: String,
}

/// Nothing could be compared.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SelectError {
    #[error("the comparison has no record; give a session or a table")]
    NoRecords,
    #[error("the comparison has no family; give at least one family")]
    NoFamilies,
    #[error(transparent)]
    HoldOut(#[from] HoldOutError),
    #[error(transparent)]
    Fit(#[from] FitError),
    #[error("the comparison was cancelled")]
    Ended,
}

/// A family fitted to all records, and judged.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelCandidate {
    pub family: String,
    pub name: String,
    pub parameters: usize,
    /// Numbers the fit found: parameters, and what each record has of its own.
    pub free: usize,
    /// Root mean square residual in N.
    pub rms_n: f64,
    /// Largest residual in N.
    pub worst_n: f64,
    /// Corrected Akaike criterion above the lowest; null where there are too few samples for it.
    pub aicc_above: Option<f64>,
    pub bic: f64,
    /// Bayesian criterion above the lowest.
    pub bic_above: f64,
    /// Error over what was held out; null where nothing was or its fit was refused.
    pub prediction: Option<HoldOutPrediction>,
    /// Why there is no prediction, if something was held out.
    pub prediction_refused: Option<String>,
    pub cost: StepCost,
    /// Whether its error, of prediction where there is one, is within the tolerance; null without one.
    pub is_within: Option<bool>,
    /// Independent samples that its residuals are worth.
    pub effective_samples: f64,
    pub model: Model,
    pub warnings: Vec<String>,
}

impl ModelCandidate {
    /// The error that a tolerance is compared with: of prediction where `is_predicted`, else of the fit.
    pub(super) fn error(&self, is_predicted: bool) -> Option<f64> {
        if is_predicted { self.prediction.as_ref().map(|one| one.rms_n) } else { Some(self.rms_n) }
    }
}

/// A family that the records do not hold.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RefusedFamily {
    pub family: String,
    pub reason: String,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelSelection {
    pub records: Vec<RecordFacts>,
    /// Samples whose force counts.
    pub samples: usize,
    /// Independent samples that the criteria count: those of the residuals that come closest to noise.
    pub effective_samples: f64,
    /// The tolerance in N.
    pub tolerance_n: Option<f64>,
    /// Whether something was held out and predicted.
    pub is_predicted: bool,
    /// Families in the order given.
    pub candidates: Vec<ModelCandidate>,
    /// Families that the records do not hold.
    pub refused: Vec<RefusedFamily>,
    /// Gain of each extra term.
    pub steps: Vec<LadderStep>,
    /// The choice, or why there is none.
    pub verdict: SelectionVerdict,
}

/// Fits every family to all records together, predicts what is held out, and judges.
///
/// `progress` is called before each fit and may cancel the comparison.
///
/// ```
/// use palpate_rheology::families::{Kelvin, Maxwell, Model, PowerSeries};
/// use palpate_rheology::fit::FitSample;
/// use palpate_rheology::select::{SelectOptions, select};
/// use palpate_model::{Depth, Newtons, Seconds};
/// use std::ops::ControlFlow;
/// use std::sync::Arc;
///
/// let truth = Model { family: "kelvin".into(), outer: vec![1.5], linear: vec![0.15, 0.6] };
/// let record = |speed: f64| -> Vec<FitSample> {
///     let path = (0..400).map(|i| 0.1 * f64::from(i));
///     let path: Vec<_> = path.map(|t| (Seconds(t), Depth((speed * t).min(10.0)))).collect();
///     let forces = truth.along(path.iter().copied()).expect("a force");
///     let noise = |i: usize| 0.01 * ((i * i * 37 + 11 * i) % 101) as f64 / 29.0;
///     let samples = path.iter().zip(forces).enumerate();
///     samples
///         .map(|(i, (&(t, depth), force))| FitSample {
///             t,
///             depth,
///             force: Newtons(force + noise(i)),
///             sigma: Newtons(0.01),
///         })
///         .collect()
/// };
/// let (slow, fast) = (record(0.5), record(4.0));
/// let families = SelectOptions {
///     families: vec![Arc::new(Maxwell), Arc::new(Kelvin), Arc::new(PowerSeries::of_order(3).expect("3"))],
///     ..SelectOptions::default()
/// };
/// let found = select(&[("slow", &slow), ("fast", &fast)], &families, &|_| ControlFlow::Continue(()))?;
/// assert_eq!(found.verdict.family.as_deref(), Some("kelvin"));
/// # Ok::<(), palpate_rheology::select::SelectError>(())
/// ```
pub fn select(
    records: &[(&str, &[FitSample])],
    options: &SelectOptions,
    progress: &dyn Fn(&SelectProgress) -> ControlFlow<()>,
) -> Result<ModelSelection, SelectError> {
    if records.is_empty() {
        return Err(SelectError::NoRecords);
    }
    if options.families.is_empty() {
        return Err(SelectError::NoFamilies);
    }
    check(records)?;
    let mut facts: Vec<RecordFacts> =
        records.iter().map(|(name, samples)| RecordFacts::of(name, samples)).collect();
    for (facts, specimen) in facts.iter_mut().zip(&options.specimens) {
        facts.specimen.clone_from(specimen);
    }
    let samples: Vec<&[FitSample]> = records.iter().map(|record| record.1).collect();
    let folds = folds(options.hold_out, &facts, &samples)?;
    let (fitted, refused) = fit_families(records, options, (&facts, &folds), progress)?;
    if fitted.is_empty()
        && let Some((_, reason)) = refused.first()
    {
        return Err(reason.clone().into());
    }
    let samples = fitted.first().map_or(0, |(_, fit, _)| fit.samples);
    let best = fitted.iter().min_by(|a, b| a.1.weighted_square.total_cmp(&b.1.weighted_square));
    let effective = best.map_or(0.0, |(_, fit, _)| fit.effective_samples);
    // The force of the tissue: a sensor offset is no part of it.
    if let Some(best) = best {
        for ((facts, own), (_, samples)) in facts.iter_mut().zip(&best.1.records).zip(records) {
            facts.peak_n = peak_force(samples, own.report.value("f_offset").unwrap_or(0.0));
        }
    }
    let mut candidates: Vec<ModelCandidate> = fitted
        .into_iter()
        .map(|(family, fit, predicted)| candidate(family, records, fit, predicted, effective))
        .collect::<Result<_, FitError>>()?;
    let peak = facts.iter().fold(0.0f64, |all, one| all.max(one.peak_n));
    let tolerance_n = options.tolerance.map(|one| one.in_newtons(Newtons(peak)).0);
    let is_predicted = candidates.iter().any(|one| one.prediction.is_some());
    compare(&mut candidates, tolerance_n, is_predicted);
    let counts = SampleCounts { records: records.len(), samples, effective };
    let verdict = decide(&candidates, tolerance_n, is_predicted, counts);
    Ok(ModelSelection {
        steps: steps(&candidates),
        verdict,
        records: facts,
        samples,
        effective_samples: effective,
        tolerance_n,
        is_predicted,
        candidates,
        refused: refused
            .into_iter()
            .map(|(family, reason)| RefusedFamily { family, reason: reason.to_string() })
            .collect(),
    })
}

/// A family with its fit to all records, and its predictions of what was held out or why there are none.
type FamilyFit<'a> = (&'a dyn Family, JointReport, Result<Vec<super::RecordPrediction>, String>);
/// Families that the records do not hold, by key.
type Refusals = Vec<(String, FitError)>;

/// Fits every family, and again without each fold to predict it.
fn fit_families<'a>(
    records: &[(&str, &[FitSample])],
    options: &'a SelectOptions,
    (facts, folds): (&[RecordFacts], &[Fold]),
    progress: &dyn Fn(&SelectProgress) -> ControlFlow<()>,
) -> Result<(Vec<FamilyFit<'a>>, Refusals), SelectError> {
    let per_family = 1 + folds.len();
    let begin = |done: usize, family: &dyn Family| {
        let state = SelectProgress {
            done,
            total: options.families.len() * per_family,
            family: family.key(),
        };
        match progress(&state) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(SelectError::Ended),
        }
    };
    let (mut fitted, mut refused) = (Vec::new(), Vec::new());
    for (index, family) in options.families.iter().enumerate() {
        begin(index * per_family, &**family)?;
        // An initial force that fades is not defined for families of several relaxation times, and would make the
        // others look costlier.
        let own = FitOptions::of(Arc::clone(family)).at_rest();
        let fit = fit_joint(records, &own, &own.body_names());
        let mut predicted = Ok(Vec::new());
        for (number, fold) in folds.iter().enumerate() {
            begin(index * per_family + 1 + number, &**family)?;
            if let (Ok(_), Ok(known)) = (&fit, &mut predicted) {
                match predict_fold(&own, records, facts, fold) {
                    Ok(more) => known.extend(more),
                    Err(reason) => predicted = Err(reason.to_string()),
                }
            }
        }
        match fit {
            Ok(fit) => fitted.push((&**family, fit, predicted)),
            Err(reason) => refused.push((family.key(), reason)),
        }
    }
    Ok((fitted, refused))
}

/// Criteria above the lowest, and errors against the tolerance.
fn compare(candidates: &mut [ModelCandidate], tolerance_n: Option<f64>, is_predicted: bool) {
    let lowest = |value: fn(&ModelCandidate) -> f64| {
        candidates.iter().map(value).fold(f64::INFINITY, f64::min)
    };
    let (bic, aicc) =
        (lowest(|one| one.bic), lowest(|one| one.aicc_above.unwrap_or(f64::INFINITY)));
    for one in candidates {
        one.bic_above = one.bic - bic;
        one.aicc_above = one.aicc_above.map(|value| value - aicc);
        one.is_within = tolerance_n
            .map(|tolerance| one.error(is_predicted).is_some_and(|error| error <= tolerance));
    }
}

/// Refuses records that no family could be fitted to, before anything is measured on them.
fn check(records: &[(&str, &[FitSample])]) -> Result<(), SelectError> {
    for (name, samples) in records {
        if samples.is_empty() {
            let reason = FitError::TooFewSamples { samples: 0, parameters: 2 };
            return Err(match records.len() {
                1 => reason,
                _ => FitError::InRecord { record: (*name).to_owned(), reason: Box::new(reason) },
            }
            .into());
        }
    }
    Ok(())
}

/// A row of the comparison; the criteria are relative to the lowest only once all are known.
fn candidate(
    family: &dyn Family,
    records: &[(&str, &[FitSample])],
    fit: JointReport,
    predicted: Result<Vec<super::RecordPrediction>, String>,
    effective: f64,
) -> Result<ModelCandidate, FitError> {
    let first = fit.records.first().ok_or(FitError::Overflow)?;
    let model = first.report.body.clone();
    let terms = model.terms().map_err(|_| FitError::Overflow)?;
    let mean = fit.weighted_square / fit.samples as f64;
    let (aicc, bic) = criteria(mean, effective, fit.free);
    let (prediction, prediction_refused) = match predicted {
        Ok(records) => (HoldOutPrediction::of(records), None),
        Err(reason) => (None, Some(reason)),
    };
    let pairs = fit.records.iter().zip(records);
    let worst = pairs.map(|(one, (_, samples))| one.report.worst(samples).0);
    Ok(ModelCandidate {
        family: family.key(),
        name: family.name(),
        parameters: model.outer.len() + model.linear.len(),
        free: fit.free,
        rms_n: fit.rmse_n,
        worst_n: worst.fold(0.0, f64::max),
        aicc_above: aicc,
        bic,
        bic_above: 0.0,
        prediction,
        prediction_refused,
        cost: StepCost::of(&terms),
        is_within: None,
        effective_samples: fit.effective_samples,
        model,
        warnings: fit.warnings(),
    })
}
