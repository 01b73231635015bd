//! A population as data, and in words.

use super::PopulationMethod;
use super::design::Design;
use crate::report::text::table;
use crate::study_table::StudyRow;
use palpate_population::{EffectEstimate, GroupShift, Spread};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// A population of bodies. Parameters are found as logarithms: a mean is a median of the parameter in its unit, an effect a
/// factor, and a spread a standard deviation of the logarithm.
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
    pub spreads: Vec<SpreadRow>,
    /// How far each group is from the mean, in logarithms.
    pub groups: Vec<GroupShift>,
    /// Sessions that could not be fitted, with the reason.
    pub not_fitted: BTreeMap<String, String>,
    pub notes: Vec<String>,
}

/// A level and its number of groups.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LevelRow {
    pub level: String,
    pub groups: usize,
}

impl LevelRow {
    pub(super) fn all(design: &Design, rows: &[StudyRow], kept: &[usize]) -> Vec<Self> {
        let levels = design.levels();
        let outer = levels.len() - 1;
        let rows = levels.into_iter().enumerate().map(|(depth, level)| {
            let paths = kept
                .iter()
                .map(|&row| design.groups(&rows[row])[..=depth.min(outer.max(1) - 1)].to_vec());
            let groups =
                if depth == outer { kept.len() } else { paths.collect::<BTreeSet<_>>().len() };
            Self { level, groups }
        });
        rows.collect()
    }
}

/// A mean or an effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectRow {
    #[serde(flatten)]
    pub estimate: EffectEstimate,
    /// Exponential of the value: the median of the parameter in its unit, or the factor of one unit of the entry.
    pub factor: f64,
    pub factor_interval: [f64; 2],
}

impl EffectRow {
    pub(super) fn of(estimate: &EffectEstimate) -> Self {
        Self {
            factor: estimate.value.exp(),
            factor_interval: estimate.interval.map(f64::exp),
            estimate: estimate.clone(),
        }
    }
}

/// A spread.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SpreadRow {
    #[serde(flatten)]
    pub spread: Spread,
    /// Coefficient of variation of the parameter: standard deviation over mean of a log-normal distribution.
    pub coefficient_of_variation: f64,
}

impl SpreadRow {
    pub(super) fn of(spread: &Spread) -> Self {
        let coefficient_of_variation = spread.value.powi(2).exp_m1().sqrt();
        Self { spread: spread.clone(), coefficient_of_variation }
    }
}

impl PopulationReport {
    /// Tables of means and effects and of spreads, then notes.
    #[must_use]
    pub fn text(&self) -> String {
        let groups = self.levels.iter().map(|one| match (one.groups, one.level.as_str()) {
            (1, level) => format!("1 {level}"),
            (groups, level) => format!("{groups} {level}s"),
        });
        let mut text = format!("{}: {}\n\n", self.model, groups.collect::<Vec<_>>().join(", "));
        let percent = |value: f64| format!("{:.1} %", 100.0 * value);
        let effects = self.effects.iter().map(|row| {
            let [low, high] = row.factor_interval;
            let p_value = match row.estimate.p_value {
                _ if row.estimate.effect == "mean" => "-".to_owned(),
                p if p < 0.001 => "< 0.001".to_owned(),
                p => format!("{p:.3}"),
            };
            vec![
                row.estimate.parameter.clone(),
                row.estimate.effect.clone(),
                format!("{:.4}", row.factor),
                format!("{low:.4} to {high:.4}"),
                format!("{:.1}", row.estimate.freedom),
                p_value,
            ]
        });
        text += &table(
            "parameter | mean or effect | median or factor | 95 % interval | degrees of freedom | p",
            effects,
        );
        text.push_str("\n\n");
        let spreads = self.spreads.iter().map(|row| {
            let end = |end: Option<f64>| end.map_or("open".to_owned(), percent);
            let [low, high] = row.spread.interval;
            vec![
                row.spread.parameter.clone(),
                row.spread.level.clone(),
                percent(row.spread.value),
                format!("{} to {}", end(low), end(high)),
                percent(row.spread.share),
            ]
        });
        text += &table("parameter | between | spread | 95 % interval | share of variance", spreads);
        for spread in self.spreads.iter().filter(|row| row.spread.is_zero) {
            let _ = write!(
                text,
                "\n{}: the sessions show no spread between {}s; that is not proof of none",
                spread.spread.parameter, spread.spread.level
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
