//! The cheapest setting for a tolerance and a rate.

use super::{FamilyRow, TradeCurves};
use crate::distinct;
use crate::tolerance::Tolerance;
use palpate_model::units::Newtons;
use serde::Serialize;

/// Times repeat to this share on a quiet machine.
const REPEATABLE: f64 = 0.1;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AdvisedSetting {
    pub setting: String,
    /// Its error as a share of the largest force.
    pub error_of_peak: f64,
    /// The share of each period of the rate that it takes; for a fit, none.
    pub share_of_period: Option<f64>,
    /// Its cost in ns: of a period's worth of simulated time, of a step, or of a fit.
    pub cost_ns: f64,
}

/// A setting, or the reason why there is none.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Advice {
    Use(AdvisedSetting),
    /// Why none does, in a sentence.
    None(String),
}

/// The cheapest settings for one tolerance and one rate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Recommendation {
    pub tolerance: String,
    /// Updates per second wanted.
    pub rate_hz: f64,
    /// Share of each period that may be used.
    pub share_allowed: f64,
    /// For the modified Kelvin body.
    pub integrator: Advice,
    /// For each target among the families: its name and the advice.
    pub families: Vec<(String, Advice)>,
    /// How far a recording may be thinned before it is fitted.
    pub fit: Advice,
    /// How many relaxation times the live fit needs: its error of tau, as a share, stands for that of the
    /// force.
    pub live: Advice,
}

impl TradeCurves {
    /// The cheapest row of each table (of those within a tenth, the most exact) whose error is within the tolerance and which, `rate_hz` times a
    /// second, takes no more than `share` (0 to 1) of each period. An integrator may take several steps
    /// a period and never takes one longer than the period. The fit has no rate to keep up with.
    pub fn recommend(&self, tolerance: Tolerance, rate_hz: f64, share: f64) -> Recommendation {
        let targets = distinct(self.families.iter().map(|row| row.target.as_str()));
        let families = targets.into_iter().map(|target| {
            let rows = self.families.iter().filter(|row| row.target == target);
            let advice = family(&rows.collect::<Vec<_>>(), tolerance, rate_hz, share);
            (target.to_owned(), advice)
        });
        Recommendation {
            tolerance: tolerance.to_string(),
            rate_hz,
            share_allowed: share,
            integrator: self.integrator(tolerance, rate_hz, share),
            families: families.collect(),
            fit: self.thinning(tolerance),
            live: self.bank(tolerance, rate_hz, share),
        }
    }

    fn bank(&self, tolerance: Tolerance, rate_hz: f64, share: f64) -> Advice {
        let peak = Newtons(self.peak.ramp_hold_n);
        let allowed = tolerance.in_newtons(peak).0 / peak.0;
        let candidates = self.live.iter().filter_map(|row| {
            let error = row.tau_error?;
            let choice = AdvisedSetting {
                setting: format!("{} relaxation times", row.nodes),
                error_of_peak: error,
                share_of_period: Some(row.cost.ns * 1e-9 * rate_hz),
                cost_ns: row.cost.ns,
            };
            Some((choice, error <= allowed))
        });
        best(candidates.collect(), tolerance, Some((rate_hz, share)))
    }

    fn integrator(&self, tolerance: Tolerance, rate_hz: f64, share: f64) -> Advice {
        let period = 1.0 / rate_hz;
        // A step of a rounded tenth of a millisecond still fits a period.
        let fitting = self.integrators.iter().filter(|row| row.step_s <= period * (1.0 + 1e-9));
        let candidates = fitting.filter_map(|row| {
            let error = row.error?;
            let choice = AdvisedSetting {
                setting: format!(
                    "{} in {}, a step every {} ms",
                    row.scheme.name(),
                    row.precision.name(),
                    row.step_s * 1e3
                ),
                error_of_peak: error.share_of(&self.peak),
                share_of_period: Some(row.second_ns * 1e-9),
                cost_ns: row.second_ns * period,
            };
            Some((choice, error.is_within(tolerance, &self.peak)))
        });
        best(candidates.collect(), tolerance, Some((rate_hz, share)))
    }

    fn thinning(&self, tolerance: Tolerance) -> Advice {
        let peak = self.peak.ramp_hold_n;
        let candidates = self.fit.iter().map(|row| {
            let choice = AdvisedSetting {
                setting: format!("{} samples a second, {} in all", row.rate_hz, row.samples),
                error_of_peak: row.error_n / peak,
                share_of_period: None,
                cost_ns: row.cost.ns,
            };
            (choice, row.error_n <= tolerance.in_newtons(Newtons(peak)).0)
        });
        best(candidates.collect(), tolerance, None)
    }
}

fn family(rows: &[&FamilyRow], tolerance: Tolerance, rate_hz: f64, share: f64) -> Advice {
    let candidates = rows.iter().map(|row| {
        let choice = AdvisedSetting {
            setting: row.family.clone(),
            error_of_peak: row.error_n / row.peak_n,
            share_of_period: Some(row.cost.ns * 1e-9 * rate_hz),
            cost_ns: row.cost.ns,
        };
        let allowed = tolerance.in_newtons(Newtons(row.peak_n)).0;
        (choice, row.error_n <= allowed)
    });
    best(candidates.collect(), tolerance, Some((rate_hz, share)))
}

/// The cheapest of those exact enough, if it is cheap enough.
fn best(
    candidates: Vec<(AdvisedSetting, bool)>,
    tolerance: Tolerance,
    pace: Option<(f64, f64)>,
) -> Advice {
    let all = candidates.iter().map(|(choice, _)| choice);
    let nearest = all.min_by(|a, b| a.error_of_peak.total_cmp(&b.error_of_peak));
    let exact = candidates.iter().filter(|(_, is_exact)| *is_exact).map(|(choice, _)| choice);
    let exact: Vec<&AdvisedSetting> = exact.collect();
    let least = |choices: &[&AdvisedSetting]| {
        let costs = choices.iter().map(|choice| choice.cost_ns);
        costs.fold(f64::INFINITY, f64::min)
    };
    // Those that keep pace, or else the cheapest, to state by how much it does not.
    let in_time: Vec<&AdvisedSetting> = exact
        .iter()
        .filter(|choice| {
            pace.is_none_or(|(_, share)| choice.share_of_period.is_none_or(|used| used <= share))
        })
        .copied()
        .collect();
    let (known, slack) = match in_time.is_empty() {
        // Of those whose times do not differ by more than their repeatability, the most exact.
        false => (in_time, REPEATABLE),
        true => (exact, 0.0),
    };
    let limit = least(&known) * (1.0 + slack);
    let cheapest = known
        .into_iter()
        .filter(|choice| choice.cost_ns <= limit)
        .min_by(|a, b| a.error_of_peak.total_cmp(&b.error_of_peak));
    match (cheapest, nearest, pace) {
        (None, None, Some((rate, _))) => Advice::None(format!(
            "nothing was measured at {rate} updates a second; measure all rows, or ask for a lower rate"
        )),
        (None, None, None) => Advice::None("nothing was measured".into()),
        (None, Some(nearest), _) => Advice::None(format!(
            "no measured setting is within {tolerance}; the nearest is {} with an error of {:.2e} of the peak force",
            nearest.setting, nearest.error_of_peak
        )),
        (Some(choice), _, Some((rate, share)))
            if choice.share_of_period.is_some_and(|used| used > share) =>
        {
            Advice::None(format!(
                "no setting is fast enough: even the cheapest within {tolerance}, {}, takes {:.3} % of each period at {rate} updates a second, but at most {} % is allowed",
                choice.setting,
                100.0 * choice.share_of_period.unwrap_or_default(),
                100.0 * share
            ))
        }
        (Some(choice), _, _) => Advice::Use(choice.clone()),
    }
}
