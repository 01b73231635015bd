//! A population as data, and in words.

use super::design::MEAN;
use super::{PopulationMethod, PopulationOrigin};
use crate::report::text::{counted, table};
use palpate_figures::uncertain::significant;
use palpate_population::{EffectEstimate, GroupShift, LevelDeviation, Study};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// A population. Parameters are found as logarithms: a mean is a median of the parameter in its unit, an effect a factor, and a
/// standard deviation that of the logarithm.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PopulationReport {
    pub model: String,
    pub method: PopulationMethod,
    /// Rounds of expanding the curves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rounds: Option<usize>,
    /// Number of sessions that count.
    pub sessions: usize,
    pub levels: Vec<LevelRow>,
    pub effects: Vec<EffectRow>,
    pub standard_deviations: Vec<DeviationRow>,
    /// How far each group is from the one that it belongs to, in logarithms.
    pub groups: Vec<GroupShift>,
    /// Sessions that could not be fitted, with the reason.
    pub not_fitted: BTreeMap<String, String>,
    pub notes: Vec<String>,
    /// What a saved population has besides.
    #[serde(skip)]
    pub origin: PopulationOrigin,
}

/// A level and its number of groups.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LevelRow {
    pub level: String,
    pub groups: usize,
}

impl LevelRow {
    pub(super) fn all(study: &Study) -> Vec<Self> {
        let groups = |depth: usize| {
            let paths = study.sessions.iter().map(|one| one.groups.get(..=depth));
            // The last level is the sessions themselves.
            paths.collect::<Option<BTreeSet<_>>>().map_or(study.sessions.len(), |all| all.len())
        };
        let levels = study.levels.iter().enumerate();
        levels.map(|(depth, level)| Self { level: level.clone(), groups: groups(depth) }).collect()
    }
}

/// A mean or an effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectRow {
    pub effect: String,
    pub parameter: String,
    /// Unit of the parameter; none of a factor.
    pub unit: Option<String>,
    /// In logarithms, as `std_error` and `interval`.
    pub value: f64,
    pub std_error: f64,
    pub freedom: f64,
    pub interval: [f64; 2],
    /// Exponential of the value: the median of the parameter in its unit, or the factor of one unit of the entry.
    pub factor: f64,
    pub factor_interval: [f64; 2],
    /// Probability of an effect as far from a factor of one, or farther, if there were none; none of a mean.
    pub p_value: Option<f64>,
}

impl EffectRow {
    pub(super) fn of(estimate: &EffectEstimate, unit: Option<String>) -> Self {
        let is_mean = estimate.effect == MEAN;
        Self {
            effect: estimate.effect.clone(),
            parameter: estimate.parameter.clone(),
            unit: unit.filter(|_| is_mean),
            value: estimate.value,
            std_error: estimate.std_error,
            freedom: estimate.freedom,
            interval: estimate.interval,
            factor: estimate.value.exp(),
            factor_interval: estimate.interval.map(f64::exp),
            p_value: (!is_mean).then_some(estimate.p_value),
        }
    }

    fn cells(&self) -> Vec<String> {
        let [low, high] = self.factor_interval.map(|end| significant(end, 4));
        let p_value = match self.p_value {
            None => "-".to_owned(),
            Some(p) if p < 0.001 => "< 0.001".to_owned(),
            Some(p) => format!("{p:.3}"),
        };
        let unit = self.unit.as_deref().unwrap_or_default();
        vec![
            self.parameter.clone(),
            self.effect.clone(),
            format!("{} {unit}", significant(self.factor, 4)).trim_end().to_owned(),
            format!("{low} to {high}"),
            format!("{:.1}", self.freedom),
            p_value,
        ]
    }
}

/// A standard deviation between the groups of a level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeviationRow {
    #[serde(flatten)]
    pub estimate: LevelDeviation,
    /// Coefficient of variation of the parameter: standard deviation over mean of a log-normal distribution.
    pub coefficient_of_variation: f64,
}

impl DeviationRow {
    pub(super) fn of(estimate: &LevelDeviation) -> Self {
        let coefficient_of_variation = estimate.value.powi(2).exp_m1().sqrt();
        Self { estimate: estimate.clone(), coefficient_of_variation }
    }

    fn cells(&self) -> Vec<String> {
        let percent = |value: f64| format!("{:.1} %", 100.0 * value);
        let end = |end: Option<f64>| end.map_or("open".to_owned(), percent);
        let [low, high] = self.estimate.interval;
        vec![
            self.estimate.parameter.clone(),
            self.estimate.level.clone(),
            percent(self.estimate.value),
            format!("{} to {}", end(low), end(high)),
            percent(self.estimate.share),
        ]
    }
}

impl PopulationReport {
    /// Tables of means and effects and of standard deviations, then notes.
    #[must_use]
    pub fn text(&self) -> String {
        let groups = self.levels.iter().map(|one| counted(one.groups, &one.level));
        let mut text = format!("{}: {}\n\n", self.model, groups.collect::<Vec<_>>().join(", "));
        let head = "parameter | mean or effect | median or factor | 95 % interval | degrees of freedom | p";
        text += &table(head, self.effects.iter().map(EffectRow::cells));
        text.push_str("\n\n");
        let head = "parameter | between | standard deviation | 95 % interval | share of variance";
        text += &table(head, self.standard_deviations.iter().map(DeviationRow::cells));
        for row in self.standard_deviations.iter().filter(|row| row.estimate.is_zero) {
            let LevelDeviation { parameter, level, .. } = &row.estimate;
            let _ = write!(
                text,
                "\n{parameter}: no differences between {level}s are seen; that is not proof of none"
            );
        }
        for (session, reason) in &self.not_fitted {
            let _ = write!(text, "\n{session} was not fitted: {reason}");
        }
        for note in &self.notes {
            let _ = write!(text, "\n{note}");
        }
        text
    }
}
