//! A population as data, and in words.

use super::PopulationMethod;
use super::design::MEAN;
pub(super) use super::questions::ComparisonRow;
use super::questions::{InfluenceReport, PlanReport};
use crate::report::text::{counted, table, typeset};
use palpate_figures::uncertain::significant;
use palpate_population::{
    EffectEstimate, GroupShift, Influence, LevelDeviation, NormalScore, PlannedStudy,
    PopulationFit, Study, outlying_group,
};
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
    /// Differences between any two values of an entry that has three or more.
    pub comparisons: Vec<ComparisonRow>,
    /// How far each group is from the one that it belongs to, in logarithms.
    pub groups: Vec<GroupShift>,
    /// Groups that are farther from the others than one of twenty normal studies has any, at most one of each level and parameter.
    pub outlying: Vec<Outlying>,
    /// What the population is without each group, where that was wanted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub influence: Option<InfluenceReport>,
    /// What studies of other sizes would find, where that was wanted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plan: Option<PlanReport>,
    /// Sessions that could not be fitted, with the reason.
    pub not_fitted: BTreeMap<String, String>,
    pub notes: Vec<String>,
}

/// A group that is far from the others.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outlying {
    pub level: String,
    pub parameter: String,
    pub group: String,
    /// From the mean of all groups, in their standard deviation.
    pub distance: f64,
}

impl Outlying {
    pub(super) fn all(study: &Study, fit: &PopulationFit) -> Vec<Self> {
        let pairs = study.levels.iter().flat_map(|level| {
            study.parameters.iter().enumerate().map(move |(k, parameter)| (level, k, parameter))
        });
        let found = pairs.filter_map(|(level, k, parameter)| {
            let NormalScore { group, found: distance, .. } = outlying_group(fit, level, k)?;
            Some(Self { level: level.clone(), parameter: parameter.clone(), group, distance })
        });
        found.collect()
    }
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
    /// An effect over the standard deviation of one session in its group, all levels together (Westfall, Kenny & Judd, Journal
    /// of Experimental Psychology: General 143 (2014) 2020-2045); none of a mean, or where nothing varies.
    pub effect_size: Option<f64>,
}

impl EffectRow {
    /// Whether it is the mean of all sessions, and not an effect.
    #[must_use]
    pub fn is_mean(&self) -> bool {
        is_mean(&self.effect)
    }

    pub(super) fn of(estimate: &EffectEstimate, unit: Option<String>, fit: &PopulationFit) -> Self {
        let is_mean = is_mean(&estimate.effect);
        let own = fit.standard_deviations.iter();
        let own = own.filter(|one| one.parameter == estimate.parameter);
        let whole = own.map(|one| one.value.powi(2)).sum::<f64>().sqrt();
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
            effect_size: (!is_mean && whole > 0.0).then_some(estimate.value / whole),
        }
    }

    /// The unit as it is printed; empty of a factor.
    pub(super) fn unit_in_print(&self) -> String {
        typeset(self.unit.as_deref().unwrap_or_default())
    }

    pub(super) fn cells(&self) -> Vec<String> {
        let [low, high] = self.factor_interval.map(|end| significant(end, 4));
        let unit = self.unit_in_print();
        vec![
            self.parameter.clone(),
            self.effect.clone(),
            format!("{} {unit}", significant(self.factor, 4)).trim_end().to_owned(),
            format!("{low} to {high}"),
            format!("{:.1}", self.freedom),
            self.p_value.map_or("-".to_owned(), probability),
            self.effect_size.map_or("-".to_owned(), |size| format!("{size:.2}")),
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
    /// Intraclass correlation: of two sessions of one group of this level. None of sessions.
    pub intraclass_correlation: Option<f64>,
    /// The factor that 95 % of pairs of sessions stay below whose groups differ from this level inwards, without the noise of
    /// their curves: of sessions the repeatability limit (ISO 5725-6:1994, 4.1.4).
    pub pair_factor: f64,
}

/// Differences of two sessions that 95 % stay below, in standard deviations of one.
const PAIR: f64 = 1.96 * std::f64::consts::SQRT_2;

impl DeviationRow {
    /// All levels and parameters of a population.
    pub(super) fn all(fit: &PopulationFit) -> Vec<Self> {
        let last = fit.standard_deviations.last().map(|one| one.level.clone());
        let row = |(place, estimate): (usize, &LevelDeviation)| {
            let own = |one: &&LevelDeviation| one.parameter == estimate.parameter;
            let (outer, inner) = fit.standard_deviations.split_at(place);
            let inner = inner.iter().filter(own).map(|one| one.value.powi(2)).sum::<f64>();
            let shared = outer.iter().filter(own).map(|one| one.share).sum::<f64>();
            let is_last = last.as_ref() == Some(&estimate.level);
            Self {
                estimate: estimate.clone(),
                coefficient_of_variation: estimate.value.powi(2).exp_m1().sqrt(),
                intraclass_correlation: (!is_last).then_some(shared + estimate.share),
                pair_factor: (PAIR * inner.sqrt()).exp(),
            }
        };
        fit.standard_deviations.iter().enumerate().map(row).collect()
    }

    pub(super) fn cells(&self) -> Vec<String> {
        let percent = |value: f64| format!("{:.1} %", 100.0 * value);
        let end = |end: Option<f64>| end.map_or("open".to_owned(), percent);
        let [low, high] = self.estimate.interval;
        vec![
            self.estimate.parameter.clone(),
            self.estimate.level.clone(),
            percent(self.estimate.value),
            format!("{} to {}", end(low), end(high)),
            percent(self.estimate.share),
            self.intraclass_correlation.map_or("-".to_owned(), |one| format!("{one:.2}")),
            significant(self.pair_factor, 3),
        ]
    }
}

/// Whether an effect is what all sessions have.
pub(super) fn is_mean(effect: &str) -> bool {
    effect == MEAN
}

/// A probability in three digits.
pub(super) fn probability(p: f64) -> String {
    if p < 0.001 { "< 0.001".to_owned() } else { format!("{p:.3}") }
}

pub(super) const EFFECT_HEAD: &str = "parameter | mean or effect | median or factor | 95 % interval | degrees of freedom | p | effect size";
pub(super) const DEVIATION_HEAD: &str = "parameter | between | standard deviation | 95 % interval | share of variance | ICC | 95 % of pairs within";

pub(super) const COMPARISON_HEAD: &str =
    "parameter | comparison | factor | 95 % interval | p of Holm";

/// Groups that are printed of those left out in turn.
const INFLUENTIAL: usize = 5;

impl PopulationReport {
    /// Tables of means and effects and of standard deviations, of what else was wanted, then notes.
    #[must_use]
    pub fn text(&self) -> String {
        let groups = self.levels.iter().map(|one| counted(one.groups, &one.level));
        let mut parts = vec![format!("{}: {}", self.model, groups.collect::<Vec<_>>().join(", "))];
        parts.push(table(EFFECT_HEAD, self.effects.iter().map(EffectRow::cells)));
        if !self.comparisons.is_empty() {
            let rows = self.comparisons.iter().map(ComparisonRow::cells);
            parts.push(table(COMPARISON_HEAD, rows));
        }
        let rows = self.standard_deviations.iter().map(DeviationRow::cells);
        parts.push(table(DEVIATION_HEAD, rows));
        parts.extend(self.influence_text());
        parts.extend(self.plan_text());
        let remarks = self.remarks();
        if !remarks.is_empty() {
            parts.push(remarks.join("\n"));
        }
        parts.join("\n\n")
    }

    /// What is said of the numbers, a sentence each.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let zero = self.standard_deviations.iter().filter(|row| row.estimate.is_zero);
        let zero = zero.map(|row| {
            let LevelDeviation { parameter, level, .. } = &row.estimate;
            format!(
                "{parameter}: no differences between {level}s are seen; that is not proof of none"
            )
        });
        let outlying = self.outlying.iter().map(|one| {
            let Outlying { parameter, level, group, .. } = one;
            format!(
                "{parameter}: {level} {group} is farther from the others than normal ones are; look at it, since one such {level} may make the interval of the standard deviation between {level}s wrong; one of twenty such tests says so of normal {level}s"
            )
        });
        let not_fitted = self.not_fitted.iter();
        let not_fitted =
            not_fitted.map(|(session, reason)| format!("{session} was not fitted: {reason}"));
        let largest = self.parameters().filter_map(|parameter| self.dominant_level(parameter));
        zero.chain(largest)
            .chain(outlying)
            .chain(not_fitted)
            .chain(self.notes.iter().cloned())
            .collect()
    }

    pub(super) fn parameters(&self) -> impl Iterator<Item = &str> {
        let means = self.effects.iter().filter(|one| is_mean(&one.effect));
        means.map(|one| one.parameter.as_str())
    }

    /// The level that has most of the variance, where it is more than half.
    fn dominant_level(&self, parameter: &str) -> Option<String> {
        let own = self.standard_deviations.iter().map(|row| &row.estimate);
        let mut own = own.filter(|one| one.parameter == parameter);
        let most = own.find(|one| one.share > 0.5)?;
        let LevelDeviation { level, share, .. } = most;
        let percent = 100.0 * share;
        Some(format!("{parameter}: {percent:.0} % of the variance lies between {level}s"))
    }

    pub(super) fn plan_text(&self) -> Option<String> {
        self.plan.as_ref().map(PlanReport::text)
    }

    pub(super) fn influence_text(&self) -> Option<String> {
        let report = self.influence.as_ref()?;
        let head = "left out | changes most | with it | without it | in standard errors";
        let mut text = table(head, self.influence_rows().into_iter().map(Vec::from));
        for (group, reason) in &report.impossible {
            let _ = write!(text, "\nwithout {group}: {reason}");
        }
        Some(text)
    }

    /// The most influential groups: name, the mean or effect that changes most, its factor with and without the group, and the
    /// change in standard errors. None where it was not wanted.
    #[must_use]
    pub fn influence_rows(&self) -> Vec<[String; 5]> {
        let row = |one: &Influence| {
            let changes = one.changes.iter().enumerate();
            let most = changes.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            let (place, change) = most.map_or((0, 0.0), |(place, change)| (place, *change));
            let whole = &self.effects[place];
            [
                format!("{} {}", one.level, one.group),
                format!("{} of {}", whole.effect, whole.parameter),
                significant(whole.factor, 4),
                significant(one.effects[place].exp(), 4),
                format!("{change:+.2}"),
            ]
        };
        let groups = self.influence.iter().flat_map(|report| &report.groups);
        groups.take(INFLUENTIAL).map(row).collect()
    }
}

impl ComparisonRow {
    pub(super) fn cells(&self) -> Vec<String> {
        let mut cells = self.difference.cells();
        cells.truncate(4);
        cells.push(probability(self.adjusted_p));
        cells
    }
}

impl PlanReport {
    fn text(&self) -> String {
        // The means and effects of all parameters would be too wide: the widest decides.
        let row = |one: &PlannedStudy| {
            let widest = one.effects.iter().max_by(|a, b| a.half_width.total_cmp(&b.half_width));
            let widest = widest.map_or("-".to_owned(), |one| {
                let percent = 100.0 * one.half_width.exp_m1();
                match percent.is_finite() {
                    true => format!("{percent:.0} % ({} of {})", one.effect, one.parameter),
                    false => "no answer".to_owned(),
                }
            });
            let effects = one.effects.iter().filter(|one| !is_mean(&one.effect));
            let seen: Vec<String> = effects
                .map(|one| {
                    let percent = 100.0 * one.power;
                    format!("{percent:.0} % ({} of {})", one.effect, one.parameter)
                })
                .collect();
            let counts = one.counts.iter().map(usize::to_string).collect::<Vec<_>>();
            let seen = if seen.is_empty() { "-".to_owned() } else { seen.join(", ") };
            vec![counts.join(" x "), one.sessions.to_string(), widest, seen]
        };
        let levels = self.levels.join(" x ");
        let head =
            format!("{levels} | sessions | widest interval, up or down by | effects seen in");
        let mut text = table(&head, self.studies.iter().map(row));
        let wanted = significant(self.wanted_percent, 3);
        let _ = match self.smallest() {
            Some(one) => write!(
                text,
                "\nthe smallest study in which no end of an interval is off by more than {wanted} % has {} ({} sessions)",
                counted(one.counts[0], &self.levels[0]),
                one.sessions
            ),
            None => write!(
                text,
                "\nin no study of these sizes all ends of intervals are off by {wanted} % or less"
            ),
        };
        text
    }
}

/// What is known of one parameter: names and words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParameterLines {
    pub parameter: String,
    pub facts: Vec<(String, String)>,
}

impl PopulationReport {
    /// Median, effects and standard deviations of each parameter, for a narrow place.
    #[must_use]
    pub fn parameter_lines(&self) -> Vec<ParameterLines> {
        let ends =
            |[low, high]: [f64; 2]| format!("{} to {}", significant(low, 3), significant(high, 3));
        let effect = |one: &EffectRow| match one.p_value {
            None => {
                let unit = one.unit_in_print();
                let value = format!("{} {unit}", significant(one.factor, 3));
                (
                    "median".to_owned(),
                    format!("{} ({})", value.trim_end(), ends(one.factor_interval)),
                )
            }
            Some(p) => {
                let words = format!(
                    "{} ({}), p {}",
                    significant(one.factor, 3),
                    ends(one.factor_interval),
                    probability(p)
                );
                (one.effect.clone(), words)
            }
        };
        let percent = |value: f64| format!("{:.1}", 100.0 * value);
        let deviation = |one: &DeviationRow| {
            let [low, high] = one.estimate.interval;
            let end = |end: Option<f64>| end.map_or("open".to_owned(), percent);
            let value = percent(one.estimate.value);
            (
                format!("between {}s", one.estimate.level),
                format!("{value} % ({} to {} %)", end(low), end(high)),
            )
        };
        let lines = self.parameters().map(|parameter| {
            let effects = self.effects.iter().filter(|one| one.parameter == parameter).map(effect);
            let own = |one: &&DeviationRow| one.estimate.parameter == parameter;
            let deviations = self.standard_deviations.iter().filter(own).map(deviation);
            ParameterLines {
                parameter: parameter.to_owned(),
                facts: effects.chain(deviations).collect(),
            }
        });
        lines.collect()
    }
}
