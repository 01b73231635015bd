//! Search, refinement, judgement: the fit from end to end.

use super::columns::{OuterPoint, ParameterPoint};
use super::identify::{self, JudgedParameters};
use super::nonnegative::non_negative;
use super::options::FitOptions;
use super::refine::{GAIN_THIN, RefinedFit, StopRule, refine};
use super::report::{FitReport, JointReport};
use super::sample::{FitError, FitSample, NamedSamples};
use super::search::best_outers;
use super::signal::SignalRecord;
use super::system::{Rows, System};
use super::uncertainty::Uncertainty;
use crate::families::{Family, Model, ModelError};
use std::sync::{Arc, OnceLock};

/// Identifies a force model from depth and force alone, by weighted least squares on the exact response. The default of
/// `options` is the modified Kelvin body
/// `F + tau_eps F' = mu1 x + mu2 x^2 + mu3 x^3 + tau_sig x x'` with initial force and sensor offset.
///
/// The result depends on nothing but the arguments; no starting guess is needed. Standard errors
/// and intervals allow for the scatter found and for the autocorrelation of the residuals.
///
/// ```
/// use palpate_rheology::fit::{FitOptions, FitSample, fit};
/// use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
/// use palpate_model::{Depth, Newtons, Seconds};
///
/// // A ramp of 0.75 mm/s to 30 mm and a hold, ten samples a second.
/// let tissue = ModifiedKelvin::THESIS;
/// let mut state = KelvinState::at_rest();
/// let samples: Vec<FitSample> = (0..900)
///     .map(|i| {
///         let t = f64::from(i) * 0.1;
///         let depth = Depth((0.75 * t).min(30.0));
///         let dt = Seconds(if i == 0 { 0.0 } else { 0.1 });
///         let force = state.step(&tissue, depth, dt);
///         FitSample { t: Seconds(t), depth, force, sigma: Newtons(0.02) }
///     })
///     .collect();
///
/// let report = fit(&samples, &FitOptions::default())?;
/// assert!((report.value("tau_eps").unwrap_or(0.0) - 1.023).abs() < 1e-9);
/// // A body of springs that are straight cannot grow stiffer with depth.
/// let other = fit(&samples, &FitOptions::by_key("kelvin").expect("a family"))?;
/// assert!(other.rmse_n > 0.1);
/// # Ok::<(), palpate_rheology::fit::FitError>(())
/// ```
pub fn fit(samples: &[FitSample], options: &FitOptions) -> Result<FitReport, FitError> {
    Ok(FitSolution::of(samples, options)?.report())
}

/// Identifies several records together, such as two speeds on one specimen or several specimens.
///
/// The parameters named in `shared`, any of [`FitOptions::body_names`], are the same in all
/// records; the others are each record's own, and so are initial force, offset and contact.
///
/// ```
/// # use palpate_rheology::fit::{FitOptions, FitSample, fit_joint};
/// # use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
/// # use palpate_model::{Depth, Newtons, Seconds};
/// # let record = |speed: f64| -> Vec<FitSample> {
/// #     let mut state = KelvinState::at_rest();
/// #     (0..400)
/// #         .map(|i| {
/// #             let t = f64::from(i) * 0.1;
/// #             let depth = Depth((speed * t).min(30.0));
/// #             let dt = Seconds(if i == 0 { 0.0 } else { 0.1 });
/// #             let force = state.step(&ModifiedKelvin::THESIS, depth, dt);
/// #             FitSample { t: Seconds(t), depth, force, sigma: Newtons(0.02) }
/// #         })
/// #         .collect()
/// # };
/// // Two ramps without any hold: neither alone could tell mu1 from tau_sig.
/// let (slow, fast) = (record(0.5), record(0.75));
/// let records = [("slow", slow.as_slice()), ("fast", fast.as_slice())];
/// let options = FitOptions::default();
/// let report = fit_joint(&records, &options, &options.body_names())?;
/// let tau = report.records[0].report.value("tau_eps");
/// assert!((tau.unwrap_or(0.0) - 1.023).abs() < 1e-8);
/// # Ok::<(), palpate_rheology::fit::FitError>(())
/// ```
pub fn fit_joint(
    records: &[(&str, &[FitSample])],
    options: &FitOptions,
    shared: &[&str],
) -> Result<JointReport, FitError> {
    Ok(FitSolution::fit_jointly(records, options, shared)?.joint_report())
}

/// One body for all records from the thinned records alone, a small share of a standard error from that of
/// [`fit_joint`] and many times cheaper: for fits whose predictions are looked at and whose numbers are not.
pub fn fit_body(records: &[(&str, &[FitSample])], options: &FitOptions) -> Result<Model, FitError> {
    let system = joint_system(records, options, &options.body_names())?;
    let points = search_start(&system)?;
    system.model(&points)
}

/// The model of a family with its outer parameters given: only the coefficients are fitted, those that
/// must not be negative not below zero. Neither offset nor initial force.
///
/// This is how a generalised Maxwell body is fitted whose relaxation times were laid down beforehand, one
/// to a decade.
pub fn fit_coefficients(
    family: Arc<dyn Family>,
    outer: &[f64],
    records: &[(&str, &[FitSample])],
) -> Result<Model, FitError> {
    let refused =
        |err: ModelError| FitError::Unsupported { family: family.name(), reason: err.to_string() };
    // Judged before it is used: its numbers are the caller's.
    let nothing = vec![0.0; family.linear().len()];
    family.model(outer, &nothing).map_err(refused)?;
    let mut options = FitOptions::of(Arc::clone(&family)).at_rest();
    options.fix("f_offset", 0.0)?;
    let system = joint_system(records, &options, &options.body_names())?;
    let outer = OuterPoint { values: outer.to_vec(), contact: 0.0 };
    let outers = vec![outer; records.len()];
    let factor = system.values_pass(&outers, Rows::All);
    let factor = factor.ok_or(FitError::Overflow)?;
    let solution = non_negative(&factor, &system.bounds());
    family.model(&outers[0].values, &solution).map_err(refused)
}

/// A finished fit that still has its records, for intervals that need more than one pass.
///
/// ```
/// use palpate_rheology::fit::{Bootstrap, FitOptions, FitSolution};
/// # use palpate_rheology::fit::FitSample;
/// # use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
/// # use palpate_model::{Depth, Newtons, Seconds};
/// # let mut state = KelvinState::at_rest();
/// # let samples: Vec<FitSample> = (0..900)
/// #     .map(|i| {
/// #         let t = f64::from(i) * 0.1;
/// #         let depth = Depth((0.75 * t).min(30.0));
/// #         let dt = Seconds(if i == 0 { 0.0 } else { 0.1 });
/// #         let error = 0.02 * f64::from(i * i * 37 % 101 - 50) / 29.0;
/// #         let force = Newtons(state.step(&ModifiedKelvin::THESIS, depth, dt).0 + error);
/// #         FitSample { t: Seconds(t), depth, force, sigma: Newtons(0.02) }
/// #     })
/// #     .collect();
/// // `samples` as in the example of `fit`, with some noise.
/// let fitted = FitSolution::of(&samples, &FitOptions::default())?;
/// let report = fitted.report();
/// let tau = report.parameter("tau_eps").and_then(|tau| tau.ci95);
/// let profile = fitted.profile(0)?;
/// let repeated = fitted.bootstrap(0, Bootstrap { seed: 1, repeats: 20 }, |_| ())?;
/// for sentence in report.sentences() {
///     assert!(!sentence.is_empty());
/// }
/// assert!(tau.is_some() && profile.len() == 7 && repeated.len() == 7);
/// # Ok::<(), palpate_rheology::fit::FitError>(())
/// ```
#[derive(Clone, Debug)]
pub struct FitSolution<'a> {
    pub(super) system: System<'a>,
    pub(super) refined: RefinedFit,
    /// Parameters that the redrawn path hardly separates, although the measured depths hide it.
    pub(super) inseparable: Vec<String>,
    pub(super) uncertainty: OnceLock<Uncertainty>,
}

impl<'a> FitSolution<'a> {
    /// Fits one record; [`fit`] says how.
    pub fn of(samples: &'a [FitSample], options: &FitOptions) -> Result<Self, FitError> {
        Self::fit_jointly(&[("the record", samples)], options, &[])
    }

    /// Fits several records together; [`fit_joint`] says how.
    pub fn fit_jointly(
        records: &[(&'a str, &'a [FitSample])],
        options: &FitOptions,
        shared: &[&str],
    ) -> Result<Self, FitError> {
        let system = joint_system(records, options, shared)?;
        let points = search_start(&system)?;
        Self::refined(system, &points)
    }

    /// Fits several records together in what the load cell reported, where their signals are given: noise, zero and
    /// contact position then have the uncertainty that they have. [`fit_joint`] says what `shared` is.
    pub fn fit_signals(
        records: &[SignalRecord<'a>],
        options: &FitOptions,
        shared: &[&str],
    ) -> Result<Self, FitError> {
        let named: Vec<NamedSamples<'a>> =
            records.iter().map(|one| (one.name, one.samples)).collect();
        let system = joint_system(&named, options, shared)?;
        let mut points = search_start(&system)?;
        let system = system.with_signals(records);
        for (point, signal) in points.iter_mut().zip(&system.signals) {
            if signal.is_some()
                && let Some(offset) = point.at.last_mut()
            {
                *offset = 0.0;
            }
        }
        let first = Self::refined(system, &points)?;
        if !first.system.has_signal() {
            return Ok(first);
        }
        let system = first.system.with_drift_of_records(&first.refined.points);
        Self::refined(system, &first.refined.points)
    }

    /// Fits other records of the same kind that differ little. What takes more than a scan to find is not searched
    /// again.
    pub(super) fn refit<'b>(
        &self,
        records: &[NamedSamples<'b>],
    ) -> Result<FitSolution<'b>, FitError>
    where
        'a: 'b,
    {
        let system = self.system.with_records(records)?;
        if system.source.has_one_time() {
            let points = search_start(&system)?;
            return FitSolution::refined(system, &points);
        }
        FitSolution::refined(system, &self.refined.points)
    }

    pub(super) fn refined(system: System<'a>, start: &[ParameterPoint]) -> Result<Self, FitError> {
        let refined = refine(&system, start, Rows::All, StopRule::Noise);
        let is_number = |point: &ParameterPoint| {
            let mut values = point.outer.values.iter().chain(&point.at);
            values.all(|value| value.is_finite()) && point.outer.contact.is_finite()
        };
        let Some(refined) = refined.filter(|end| end.points.iter().all(is_number)) else {
            // A blind design divides by nothing; say which parameters rather than that.
            identify::check(&system, start, JudgedParameters::Linear)?;
            return Err(FitError::Overflow);
        };
        let inseparable =
            match identify::check(&system, &refined.points, JudgedParameters::WithOuter) {
                // A search over several outer parameters ends on flat ground; their intervals are as wide as that.
                Err(FitError::Inseparable { names, .. }) if !system.source.has_one_time() => names,
                judged => {
                    judged?;
                    Vec::new()
                }
            };
        system.model(&refined.points)?;
        Ok(Self { system, refined, inseparable, uncertainty: OnceLock::new() })
    }
}

pub(super) fn joint_system<'a>(
    records: &[NamedSamples<'a>],
    options: &FitOptions,
    shared: &[&str],
) -> Result<System<'a>, FitError> {
    let mut is_shared = vec![false; options.names().len()];
    for name in shared {
        let index = options.index_of(name)?;
        if !options.layout.is_body(index) {
            return Err(FitError::NotShareable {
                name: (*name).to_owned(),
                known: options.body_names().join(", "),
            });
        }
        is_shared[index] = true;
    }
    if records.is_empty() {
        return Err(FitError::TooFewSamples { samples: 0, parameters: options.free_count() });
    }
    System::new(records, options, is_shared)
}

/// The end of the search on the thinned records.
pub(super) fn search_start(system: &System<'_>) -> Result<Vec<ParameterPoint>, FitError> {
    let found = best_outers(system).and_then(|outers| system.solved(&outers, Rows::Thin));
    let Some((points, _)) = found else {
        identify::check(system, &system.middle_points(), JudgedParameters::Linear)?;
        return Err(FitError::Overflow);
    };
    let is_contact_known = (0..points.len()).all(|record| !system.is_contact_free(record));
    // Where bounds keep a coefficient from zero they tell more than a condition does.
    if is_contact_known && !system.bounds().contains(&true) {
        identify::check(system, &points, JudgedParameters::Linear)?;
    }
    if system.source.has_one_time() || system.unknowns.len() == system.linear {
        return Ok(points);
    }
    let rows = system.search_rows();
    let refined = refine(system, &points, rows, StopRule::Gain(GAIN_THIN));
    let points = refined.ok_or(FitError::Overflow)?.points;
    // All samples would refuse what the thinned records refuse, at many times the cost.
    system.model(&points)?;
    Ok(points)
}
