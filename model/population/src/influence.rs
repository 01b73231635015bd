//! How much of a population rests on one of its groups.

use crate::fit::{PopulationFit, PopulationOptions, fit_population};
use crate::study::{Study, StudyError};
use serde::Serialize;
use std::collections::HashSet;

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

/// A group of a study, or one of its sessions.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct GroupPlace {
    pub level: usize,
    /// Names from the outermost group on.
    pub path: Vec<String>,
}

impl GroupPlace {
    /// As it is printed; a session has its own name alone.
    #[must_use]
    pub fn name(&self, study: &Study) -> String {
        match self.level + 1 == study.levels.len() {
            true => self.path.last().cloned().unwrap_or_default(),
            false => self.path.join(" / "),
        }
    }
}

impl Study {
    /// All groups and, last, all sessions.
    #[must_use]
    pub fn all_groups(&self) -> Vec<GroupPlace> {
        let mut found = Vec::new();
        let mut known = HashSet::new();
        for level in 0..self.levels.len() {
            for session in &self.sessions {
                let path = session.path(level).into_iter().map(str::to_owned).collect();
                let place = GroupPlace { level, path };
                if known.insert(place.clone()) {
                    found.push(place);
                }
            }
        }
        found
    }

    fn without(&self, group: &GroupPlace) -> Self {
        let kept = self.sessions.iter().filter(|one| one.path(group.level) != group.path);
        Self { sessions: kept.cloned().collect(), ..self.clone() }
    }
}

/// The population of a study without one group, all standard deviations found again, beside that of the whole.
///
/// # Errors
/// What is left says nothing of the population, for instance since one animal alone is of a treatment.
pub fn influence(
    study: &Study,
    whole: &PopulationFit,
    group: &GroupPlace,
) -> Result<Influence, StudyError> {
    let rest = fit_population(&study.without(group), &PopulationOptions::default())?;
    let pairs = whole.effects.iter().zip(&rest.effects);
    Ok(Influence {
        level: study.levels[group.level].clone(),
        group: group.name(study),
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
        let places = study.all_groups();
        let found = influence(&study, &fit, &places[4]).unwrap();
        assert!((found.effects[0] - mean).abs() < 1e-9, "{found:?}");
        let change = (mean - 7.0) / fit.effects[0].std_error;
        assert!((found.largest_change() - change.abs()).abs() < 1e-6, "{found:?} {change}");
        // The innermost level is the session itself.
        assert_eq!(places.len(), 6 + 18 + 36);
        assert_eq!((places[8].level, places[8].name(&study)), (1, "0 / 2".to_owned()));
        assert_eq!(places[24].name(&study), study.sessions[0].name);
        let session = influence(&study, &fit, &places[30]).unwrap();
        assert!(session.largest_change() < found.largest_change());
    }
}
