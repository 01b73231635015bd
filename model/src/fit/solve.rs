//! Search, refinement, judgement: the fit from end to end.

use super::identify::{self, Judged};
use super::options::{CONTACT, FitOptions, PARAMETER_NAMES, TAU};
use super::refine::{Ranges, Refined, refine};
use super::report::{FitReport, JointReport};
use super::sample::{FitError, FitSample};
use super::scan::{best_start, contact_range, log_tau_range, union};
use super::system::System;

/// Identifies the modified Kelvin body
/// `F + tau_eps F' = mu1 x + mu2 x^2 + mu3 x^3 + tau_sig x x'` with initial force and sensor
/// offset, from depth and force alone, by weighted least squares on the exact response.
///
/// The result depends on nothing but the arguments; no starting guess is needed. Standard errors
/// and intervals allow for the scatter found and for the memory of the residuals.
///
/// ```
/// use palpate_model::fit::{FitOptions, FitSample, fit};
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
/// assert!((report.body().tau_eps - 1.023).abs() < 1e-9);
/// # Ok::<(), palpate_model::fit::FitError>(())
/// ```
pub fn fit(samples: &[FitSample], options: &FitOptions) -> Result<FitReport, FitError> {
    Ok(Fitted::of(samples, options)?.report())
}

/// Identifies several records together, such as two speeds on one specimen or several specimens.
///
/// The parameters named in `shared`, any of `tau_eps, mu1, mu2, mu3, tau_sig`, are the same in all
/// records; the others are each record's own, and so are initial force, offset and contact.
///
/// ```
/// # use palpate_model::fit::{FitOptions, FitSample, fit_joint};
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
/// let shared = ["tau_eps", "mu1", "mu2", "mu3", "tau_sig"];
/// let records = [("slow", slow.as_slice()), ("fast", fast.as_slice())];
/// let report = fit_joint(&records, &FitOptions::default(), &shared)?;
/// assert!((report.records[0].report.body().tau_eps - 1.023).abs() < 1e-8);
/// # Ok::<(), palpate_model::fit::FitError>(())
/// ```
pub fn fit_joint(
    records: &[(&str, &[FitSample])],
    options: &FitOptions,
    shared: &[&str],
) -> Result<JointReport, FitError> {
    Ok(Fitted::joint(records, options, shared)?.joint_report())
}

/// A finished fit that still has its records, for intervals that need more than one pass.
///
/// ```
/// use palpate_model::fit::{Bootstrap, FitOptions, Fitted};
/// # use palpate_model::fit::FitSample;
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
/// let fitted = Fitted::of(&samples, &FitOptions::default())?;
/// let report = fitted.report();
/// let tau = report.parameter("tau_eps").and_then(|tau| tau.ci95);
/// let profile = fitted.profile(0)?;
/// let repeated = fitted.bootstrap(0, Bootstrap { seed: 1, repeats: 20 }, |_| ())?;
/// for sentence in report.sentences() {
///     assert!(!sentence.is_empty());
/// }
/// assert!(tau.is_some() && profile.len() == 7 && repeated.len() == 7);
/// # Ok::<(), palpate_model::fit::FitError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Fitted<'a> {
    pub(super) system: System<'a>,
    pub(super) refined: Refined,
    pub(super) ranges: Vec<Ranges>,
}

impl<'a> Fitted<'a> {
    /// Fits one record; [`fit`] says how.
    pub fn of(samples: &'a [FitSample], options: &FitOptions) -> Result<Self, FitError> {
        Self::solve(System::new(
            &[("the record", samples)],
            options,
            [false; 8],
        )?)
    }

    /// Fits several records together; [`fit_joint`] says how.
    pub fn joint(
        records: &[(&'a str, &'a [FitSample])],
        options: &FitOptions,
        shared: &[&str],
    ) -> Result<Self, FitError> {
        let mut is_shared = [false; 8];
        for name in shared {
            let index = PARAMETER_NAMES
                .iter()
                .position(|known| known == name)
                .ok_or_else(|| FitError::UnknownParameter {
                    name: (*name).to_owned(),
                    known: PARAMETER_NAMES.join(", "),
                })?;
            if index > 4 {
                return Err(FitError::NotShareable {
                    name: (*name).to_owned(),
                });
            }
            is_shared[index] = true;
        }
        if records.is_empty() {
            return Err(FitError::TooFewSamples {
                samples: 0,
                parameters: options.free_count(),
            });
        }
        Self::solve(System::new(records, options, is_shared)?)
    }

    fn solve(system: System<'a>) -> Result<Self, FitError> {
        let mut ranges: Vec<Ranges> = system
            .records
            .iter()
            .map(|record| Ranges {
                log_tau: log_tau_range(record.samples),
                contact: contact_range(record, system.depth_mm),
            })
            .collect();
        if system.is_shared(TAU) {
            // One relaxation time, one range: what any of the records can show.
            let all = union(ranges.iter().map(|range| range.log_tau));
            ranges.iter_mut().for_each(|range| range.log_tau = all);
        }
        let start = best_start(&system);
        if system.fixed(CONTACT).is_some() {
            identify::check(&system, &start, Judged::Linear)?;
        }
        let refined = refine(&system, &start, &ranges);
        let values = refined.points.iter().flat_map(|point| point.at);
        if !refined.sum.is_finite() || values.into_iter().any(|value| !value.is_finite()) {
            // A blind design divides by nothing; say which parameters rather than that.
            identify::check(&system, &refined.points, Judged::Linear)?;
            return Err(FitError::Overflow);
        }
        identify::check(&system, &refined.points, Judged::WithTau)?;
        Ok(Self {
            system,
            refined,
            ranges,
        })
    }
}
