//! Questions to a population: which values of an entry differ, on which group it rests, and what another study would find.

use super::PopulationError;
use super::curves::Workers;
use super::design::Design;
use super::report::EffectRow;
use palpate_population::{
    Contrast, Influence, PlannedStudy, PopulationFit, Study, holm, influence, plan_study,
};
use serde::Serialize;
use std::collections::BTreeMap;

/// Number of studies drawn for each size of a study.
const DRAWN_STUDIES: usize = 50;
/// Of more sessions than this, groups alone are left out in turn: each takes a fit of all others.
const SESSIONS_LEFT_OUT_MAX: usize = 500;
/// Numbers of outermost groups of the studies that are drawn, as many as are measured in practice.
const GROUPS: [usize; 7] = [4, 6, 8, 12, 16, 24, 32];
/// Numbers of sessions in each innermost group: more help little where groups differ.
const SESSIONS: [usize; 2] = [1, 2];

/// The difference between two values of an entry.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComparisonRow {
    #[serde(flatten)]
    pub difference: EffectRow,
    /// The probability multiplied for the number of comparisons of one entry and parameter, by Holm.
    pub adjusted_p: f64,
}

/// What the population is without each group.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct InfluenceReport {
    /// The most influential first.
    pub groups: Vec<Influence>,
    /// Groups without which there is no population, with the reason.
    pub impossible: BTreeMap<String, String>,
}

/// Sizes of studies and what each would find.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanReport {
    /// Percent by which an end of an interval may be off the median or factor.
    pub wanted_percent: f64,
    /// The names of the levels of the counts.
    pub levels: Vec<String>,
    pub studies: Vec<PlannedStudy>,
}

impl PlanReport {
    /// The study with the fewest outermost groups, then sessions, in which all means and effects are as narrow as wanted.
    #[must_use]
    pub fn smallest(&self) -> Option<&PlannedStudy> {
        let wanted = (self.wanted_percent / 100.0).ln_1p();
        let enough = |one: &&PlannedStudy| one.effects.iter().all(|one| one.half_width <= wanted);
        self.studies.iter().filter(enough).min_by_key(|one| (one.counts[0], one.sessions))
    }
}

pub(super) fn contrasts(design: &Design) -> Vec<Contrast> {
    design.comparisons().into_iter().flat_map(|(_, all)| all).collect()
}

/// The fitted contrasts with their probabilities adjusted, those of each entry and parameter together.
pub(super) fn comparisons(
    design: &Design,
    study: &Study,
    fit: &PopulationFit,
) -> Vec<ComparisonRow> {
    let parameters = study.parameters.len();
    let mut rest = fit.contrasts.as_slice();
    let mut rows = Vec::new();
    for (_, contrasts) in design.comparisons() {
        let (own, others) = rest.split_at(contrasts.len() * parameters);
        rest = others;
        for parameter in 0..parameters {
            let own: Vec<_> = own.iter().skip(parameter).step_by(parameters).collect();
            let adjusted = holm(&own.iter().map(|one| one.p_value).collect::<Vec<_>>());
            rows.extend(own.into_iter().zip(adjusted).map(|(one, adjusted_p)| ComparisonRow {
                difference: EffectRow::of(one, None, fit),
                adjusted_p,
            }));
        }
    }
    rows
}

pub(super) fn influences(
    study: &Study,
    fit: &PopulationFit,
    workers: &Workers<'_>,
) -> Result<InfluenceReport, PopulationError> {
    let mut groups = study.all_groups();
    if study.sessions.len() > SESSIONS_LEFT_OUT_MAX {
        groups.retain(|one| one.level + 1 < study.levels.len());
    }
    let found = workers.all("groups left out", &groups, |group| influence(study, fit, group))?;
    let mut report = InfluenceReport::default();
    for (group, found) in groups.into_iter().zip(found) {
        match found {
            Ok(found) => report.groups.push(found),
            Err(reason) => {
                let name = format!("{} {}", study.levels[group.level], group.name(study));
                report.impossible.insert(name, reason.to_string());
            }
        }
    }
    report.groups.sort_by(|a, b| b.largest_change().total_cmp(&a.largest_change()));
    Ok(report)
}

pub(super) fn plan(
    study: &Study,
    fit: &PopulationFit,
    wanted_percent: f64,
    workers: &Workers<'_>,
) -> Result<PlanReport, PopulationError> {
    let inner = typical_members(study);
    let mut sizes = Vec::new();
    for groups in GROUPS {
        for sessions in SESSIONS {
            let mut counts = vec![groups];
            counts.extend(&inner);
            // With one level, the sessions are the outermost groups.
            if study.levels.len() > 1 {
                counts.push(sessions);
            }
            if !sizes.contains(&counts) {
                sizes.push(counts);
            }
        }
    }
    let studies = workers.all("study sizes", &sizes, |counts| {
        plan_study(study, fit, counts, DRAWN_STUDIES, counts[0] as u64)
    })?;
    Ok(PlanReport { wanted_percent, levels: study.levels.clone(), studies })
}

/// The number of members in a group of each level but the last, rounded, of the levels between the outermost and the sessions.
fn typical_members(study: &Study) -> Vec<usize> {
    let count = |level: usize| {
        let names = study.sessions.iter().map(|one| one.path(level));
        names.collect::<std::collections::BTreeSet<_>>().len()
    };
    let counts: Vec<usize> = (0..study.levels.len() - 1).map(count).collect();
    counts
        .windows(2)
        .map(|pair| (pair[1] as f64 / pair[0] as f64).round().max(1.0) as usize)
        .collect()
}
