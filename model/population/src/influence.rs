//! How much of a population rests on one of its groups.

use crate::fit::{PopulationFit, PopulationOptions, fit_population};
use crate::study::{Study, StudyError};
use serde::Serialize;

/// The population without one group or session.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Influence {
    pub level: String,
    pub group: String,
    /// Means and effects without it, in logarithms and the order of [`PopulationFit::effects`].
    pub effects: Vec<f64>,
    /// How far each of them moves when the group is left out, in standard errors of the whole (Belsley, Kuh & Welsch,
    /// Regression Diagnostics, 1980, section 2.1).
    pub changes: Vec<f64>,
    /// Standard deviations without it, in the order of [`PopulationFit::standard_deviations`].
    pub standard_deviations: Vec<f64>,
}

impl Influence {
    /// The largest change of a mean or effect, in standard errors.
    #[must_use]
    pub fn largest_change(&self) -> f64 {
        self.changes.iter().fold(0.0, |largest, change| change.abs().max(largest))
    }
}

impl Study {
    /// Levels and names of all groups and, last, of the sessions; a name is behind those that it belongs to.
    #[must_use]
    pub fn all_groups(&self) -> Vec<(usize, String)> {
        let mut found = Vec::new();
        let mut known = std::collections::HashSet::new();
        for level in 0..self.levels.len() {
            for session in &self.sessions {
                let group = (level, session.group(level));
                if known.insert(group.clone()) {
                    found.push(group);
                }
            }
        }
        found
    }

    fn without(&self, level: usize, group: &str) -> Self {
        let kept = self.sessions.iter().filter(|one| one.group(level) != group);
        Self { sessions: kept.cloned().collect(), ..self.clone() }
    }
}

/// The population of a study without one group of a level, all standard deviations found again, beside that of the whole.
///
/// # Errors
/// What is left says nothing of the population, for instance since one animal alone is of a treatment.
pub fn influence(
    study: &Study,
    whole: &PopulationFit,
    level: usize,
    group: &str,
) -> Result<Influence, StudyError> {
    let rest = fit_population(&study.without(level, group), &PopulationOptions::default())?;
    let pairs = whole.effects.iter().zip(&rest.effects);
    Ok(Influence {
        level: study.levels[level].clone(),
        group: group.to_owned(),
        effects: rest.effects.iter().map(|one| one.value).collect(),
        changes: pairs.map(|(all, rest)| (rest.value - all.value) / all.std_error).collect(),
        standard_deviations: rest.standard_deviations.iter().map(|one| one.value).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::balanced;

    /// Without one of six animals, the mean is that of the other five.
    #[test]
    fn a_mean_without_a_group_is_that_of_the_others() {
        let study = balanced(9.0, 2.0, 1.0);
        let fit = fit_population(&study, &PopulationOptions::default()).unwrap();
        let values = study.sessions.iter().filter(|one| one.groups[0] != "4");
        let mean = values.clone().map(|one| one.values[0]).sum::<f64>() / values.count() as f64;
        let found = influence(&study, &fit, 0, "4").unwrap();
        assert!((found.effects[0] - mean).abs() < 1e-9, "{found:?}");
        let change = (mean - 7.0) / fit.effects[0].std_error;
        assert!((found.largest_change() - change.abs()).abs() < 1e-6, "{found:?} {change}");
        // The innermost level is the session itself.
        let names = study.all_groups();
        assert_eq!(names.len(), 6 + 18 + 36);
        assert_eq!(names[8], (1, "0 / 2".to_owned()));
        let session = influence(&study, &fit, 2, &names[30].1).unwrap();
        assert!(session.largest_change() < found.largest_change());
    }
}
