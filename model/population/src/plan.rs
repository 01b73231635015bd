//! How much a study of another size would find, by studies drawn from a population.

use crate::fit::{PopulationFit, PopulationOptions, fit_population};
use crate::study::{Evidence, Study, StudySession};
use nalgebra::DVector;
use palpate_model::random::SplitMix;
use serde::Serialize;

/// An effect with a smaller probability is said to be there.
const SIGNIFICANCE: f64 = 0.05;
/// Share of the drawn studies in which an interval is as narrow as is said.
pub const ASSURANCE: f64 = 0.8;

/// What studies of one size find.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlannedStudy {
    /// Number of the outermost groups, then of members of each group of a level, the last of sessions.
    pub counts: Vec<usize>,
    pub sessions: usize,
    /// In the order of [`PopulationFit::effects`].
    pub effects: Vec<PlannedEffect>,
    /// Drawn studies whose population was found.
    pub studies: usize,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlannedEffect {
    pub effect: String,
    pub parameter: String,
    /// Half the length of the 95 % interval, in logarithms, that is not exceeded in [`ASSURANCE`] of the studies; infinite where
    /// more of them have no answer.
    pub half_width: f64,
    /// Share of all studies in which the effect is seen: its probability without an effect is below 0.05.
    pub power: f64,
}

/// The sessions of a study as a tree, each group a pattern for drawn ones.
enum Pattern<'a> {
    Group(Vec<Pattern<'a>>),
    Session(&'a StudySession),
}

impl<'a> Pattern<'a> {
    fn of(study: &Study, sessions: &[&'a StudySession], level: usize) -> Self {
        if level + 1 == study.levels.len() {
            let own = sessions.iter().copied().map(|one| vec![one]).collect();
            return Self::Group(alternating(own).iter().map(|one| Self::Session(one[0])).collect());
        }
        let mut groups: Vec<(&str, Vec<&'a StudySession>)> = Vec::new();
        for session in sessions.iter().copied() {
            let name = session.groups[level].as_str();
            match groups.iter_mut().find(|(known, _)| *known == name) {
                Some((_, own)) => own.push(session),
                None => groups.push((name, vec![session])),
            }
        }
        let groups = alternating(groups.into_iter().map(|(_, own)| own).collect());
        Self::Group(groups.iter().map(|own| Self::of(study, own, level + 1)).collect())
    }
}

/// Groups of different effects in turn, so that the first few have all of them.
fn alternating<'a>(groups: Vec<Vec<&'a StudySession>>) -> Vec<Vec<&'a StudySession>> {
    let kind = |group: &[&'a StudySession]| -> Vec<&'a [f64]> {
        group.iter().map(|one| one.design.as_slice()).collect()
    };
    let mut kinds: Vec<Vec<Vec<&'a StudySession>>> = Vec::new();
    for group in groups {
        match kinds.iter_mut().find(|own| kind(&own[0]) == kind(&group)) {
            Some(own) => own.push(group),
            None => kinds.push(vec![group]),
        }
    }
    let longest = kinds.iter().map(Vec::len).max().unwrap_or_default();
    let turns = (0..longest).flat_map(|turn| kinds.iter().filter_map(move |kind| kind.get(turn)));
    turns.cloned().collect()
}

struct Drawing<'a> {
    study: &'a Study,
    fit: &'a PopulationFit,
    counts: &'a [usize],
    random: SplitMix,
}

impl Drawing<'_> {
    fn study(&mut self, pattern: &Pattern<'_>) -> Study {
        let mut sessions = Vec::new();
        let nowhere = DVector::zeros(self.study.parameters.len());
        self.add(pattern, &nowhere, &mut Vec::new(), &mut sessions);
        Study { sessions, ..self.study.clone() }
    }

    fn add(
        &mut self,
        pattern: &Pattern<'_>,
        shift: &DVector<f64>,
        path: &mut Vec<String>,
        sessions: &mut Vec<StudySession>,
    ) {
        let level = path.len();
        match pattern {
            Pattern::Session(like) => sessions.push(self.session(like, shift, path)),
            Pattern::Group(members) => {
                // Groups begin with other members, so that few members of each have all effects between them.
                let first = path.last().and_then(|place| place.parse().ok()).unwrap_or(0);
                let members = members.iter().cycle().skip(first % members.len());
                for (k, member) in (0..self.counts[level]).zip(members) {
                    let shift = shift + self.shift(level);
                    path.push(k.to_string());
                    self.add(member, &shift, path, sessions);
                    path.pop();
                }
            }
        }
    }

    fn shift(&mut self, level: usize) -> DVector<f64> {
        let count = self.study.parameters.len();
        let own = &self.fit.standard_deviations[level * count..(level + 1) * count];
        DVector::from_iterator(count, own.iter().map(|one| one.value * self.random.normal()))
    }

    fn session(
        &mut self,
        like: &StudySession,
        shift: &DVector<f64>,
        path: &[String],
    ) -> StudySession {
        let count = self.study.parameters.len();
        let mut values = shift + self.error(&like.evidence, count);
        for (place, one) in self.fit.effects.iter().enumerate() {
            values[place % count] += like.design[place / count] * one.value;
        }
        StudySession {
            name: path.join(" / "),
            groups: path[..path.len() - 1].to_vec(),
            values: values.as_slice().to_vec(),
            ..like.clone()
        }
    }

    /// An error of what a session knows; none in a direction of which it knows nothing, whose value does not count.
    fn error(&mut self, evidence: &Evidence, count: usize) -> DVector<f64> {
        let Evidence::Information(information) = evidence else {
            return DVector::zeros(count);
        };
        let eigen = information.clone().symmetric_eigen();
        let least = eigen.eigenvalues.amax() * f64::EPSILON;
        let sizes = eigen.eigenvalues.map(|value| {
            let normal = self.random.normal();
            if value > least { normal / value.sqrt() } else { 0.0 }
        });
        &eigen.eigenvectors * sizes
    }
}

/// Joins levels whose groups have one member each: their standard deviations are one.
fn separable(mut study: Study, counts: &[usize]) -> Study {
    for level in (1..counts.len()).rev().filter(|level| counts[*level] == 1) {
        study.levels.remove(level - 1);
        // The member of a group is always the first; of sessions their groups stand for them.
        let last = counts.len() - 1;
        let place = if level < last { level } else { level - 1 };
        for session in &mut study.sessions {
            session.groups.remove(place.min(session.groups.len() - 1));
        }
    }
    study
}

/// What studies of another size would find of a population: `counts` of groups, from the outermost to sessions, drawn `studies`
/// times with the effects and the evidence of the sessions of `study` in turn.
///
/// Only sampling is drawn: that the standard deviations themselves are known badly from few animals is not in it.
#[must_use]
pub fn plan_study(
    study: &Study,
    fit: &PopulationFit,
    counts: &[usize],
    studies: usize,
    seed: u64,
) -> PlannedStudy {
    let sessions: Vec<&StudySession> = study.sessions.iter().collect();
    let pattern = Pattern::of(study, &sessions, 0);
    let mut drawing = Drawing { study, fit, counts, random: SplitMix::seeded(seed) };
    let mut found = Vec::new();
    for _ in 0..studies {
        let drawn = separable(drawing.study(&pattern), counts);
        found.extend(fit_population(&drawn, &PopulationOptions::default()).ok());
    }
    let effects = fit.effects.iter().enumerate().map(|(k, one)| {
        let mut widths: Vec<f64> = found
            .iter()
            .map(|fit| 0.5 * (fit.effects[k].interval[1] - fit.effects[k].interval[0]))
            .collect();
        // A study without an answer has no interval.
        widths.resize(studies, f64::INFINITY);
        widths.sort_by(f64::total_cmp);
        let seen = found.iter().filter(|fit| fit.effects[k].p_value < SIGNIFICANCE).count();
        let place = (ASSURANCE * widths.len() as f64).ceil() as usize;
        PlannedEffect {
            effect: one.effect.clone(),
            parameter: one.parameter.clone(),
            half_width: widths.get(place.max(1) - 1).copied().unwrap_or(f64::INFINITY),
            power: seen as f64 / studies.max(1) as f64,
        }
    });
    PlannedStudy {
        counts: counts.to_vec(),
        sessions: counts.iter().product(),
        effects: effects.collect(),
        studies: found.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::balanced;

    /// Intervals of a balanced study have the length of Student's t times the root of the animals' mean square, which is
    /// distributed as chi squared; an effect that is not there is seen in five percent.
    #[test]
    fn drawn_studies_find_what_mean_squares_let_expect() {
        let mut study = balanced(9.0, 2.0, 1.0);
        study.effects.push("treated".into());
        for one in &mut study.sessions {
            let animal: f64 = one.groups[0].parse().unwrap();
            // The first three, so that studies of fewer animals must choose them in turn.
            one.design.push(f64::from(u8::from(animal < 3.0)));
        }
        let mut fit = fit_population(&study, &PopulationOptions::default()).unwrap();
        fit.effects[1].value = 0.0;
        // Variances of a mean square of 9, whatever the fit found with its effect.
        let variances = [7.0 / 6.0, 0.5, 1.0f64];
        for (one, variance) in fit.standard_deviations.iter_mut().zip(variances) {
            one.value = variance.sqrt();
        }
        let studies = 250;
        let planned = plan_study(&study, &fit, &[8, 3, 2], studies, 3);
        assert_eq!((planned.sessions, planned.studies), (48, studies));
        // Student's t at 97.5 % and chi squared at 80 %, both of six degrees of freedom.
        let root = (9.0 * 8.558_060 / 6.0f64).sqrt();
        for (one, share) in planned.effects.iter().zip([1.0 / 24.0, 2.0 / 24.0]) {
            let expected = 2.446_912 * root * f64::sqrt(share);
            // The 80 % quantile of 250 roots of chi squared has a standard error of 3 %: four of them.
            assert!((one.half_width / expected - 1.0).abs() < 0.12, "{one:?} {expected}");
        }
        // One repeat of each site, then one site of each animal, whose mean squares are those of their variances' sums.
        for (counts, square) in [([8, 3, 1], 5.0), ([8, 1, 2], 13.0 / 3.0), ([8, 1, 1], 8.0 / 3.0)]
        {
            let joined = plan_study(&study, &fit, &counts, studies, 4);
            let expected = 2.446_912 * (square / joined.sessions as f64 * 8.558_060 / 6.0).sqrt();
            let found = joined.effects[0].half_width / (expected * f64::sqrt(2.0));
            assert!((found - 1.0).abs() < 0.12 && joined.studies == studies, "{joined:?} {found}");
        }
        // Four standard errors of a share of five percent.
        assert!((planned.effects[1].power - 0.05).abs() < 0.055, "{planned:?}");
        assert!(planned.effects[0].power > 0.99);
    }

    /// Twelve sessions, the first six of one treatment, or two operators in each place in the order in which they measured: small
    /// studies have both all the same, so that each has an answer.
    #[test]
    fn small_studies_have_all_effects() {
        let mut random = SplitMix::seeded(2);
        let mut one_level = balanced(9.0, 2.0, 1.0);
        one_level.effects.push("treated".into());
        one_level.levels = vec!["session".into()];
        one_level.sessions.truncate(12);
        for (k, one) in one_level.sessions.iter_mut().enumerate() {
            one.groups.clear();
            one.design.push(f64::from(u8::from(k >= 6)));
            one.values[0] = random.normal();
        }
        let mut within = balanced(9.0, 2.0, 1.0);
        within.effects.push("operator".into());
        for (k, one) in within.sessions.iter_mut().enumerate() {
            one.design.push((k % 2) as f64);
            one.values[0] += random.normal();
        }
        for (study, sizes) in
            [(one_level, vec![vec![4], vec![6]]), (within, vec![vec![4, 3, 1], vec![4, 1, 2]])]
        {
            let fit = fit_population(&study, &PopulationOptions::default()).unwrap();
            for counts in sizes {
                let planned = plan_study(&study, &fit, &counts, 10, 1);
                assert!(planned.studies >= 8, "{planned:?}");
                let widths = planned.effects.iter().map(|one| one.half_width);
                assert!(widths.into_iter().all(f64::is_finite), "{planned:?}");
            }
        }
    }

    /// Without one of two treatments no study has an answer, and none is said to be narrow.
    #[test]
    fn studies_without_an_answer_are_infinitely_wide() {
        let mut study = balanced(9.0, 2.0, 1.0);
        study.effects.push("treated".into());
        let count = study.sessions.len();
        for (k, one) in study.sessions.iter_mut().enumerate() {
            one.design.push(f64::from(u8::from(k + 1 == count)));
        }
        let fit = fit_population(&study, &PopulationOptions::default()).unwrap();
        for one in &mut study.sessions {
            one.design[1] = 0.0;
        }
        let planned = plan_study(&study, &fit, &[4, 2, 2], 5, 1);
        assert_eq!(planned.studies, 0);
        for one in &planned.effects {
            assert!(one.half_width.is_infinite() && one.power == 0.0, "{one:?}");
        }
    }
}
