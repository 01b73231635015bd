//! Whether the shifts of groups look like those of a normal distribution.

use crate::fit::{PopulationFit, student};
use statrs::distribution::{ContinuousCDF, Normal};

/// A study of normal shifts has a group called outlying with this probability, for each level and parameter.
const OUTLYING: f64 = 0.05;

/// A group's shift beside what its rank lets expect.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalScore {
    pub group: String,
    /// What the shift of this rank is in the middle of normal ones (Blom, Statistical Estimates and Transformed
    /// Beta-Variables, 1958: (rank - 3/8) / (count + 1/4)).
    pub expected: f64,
    /// The shift over its own standard deviation: that of the level less what is not known of the shift.
    pub found: f64,
}

/// The shifts of a level in one parameter, from the lowest; none where the level has no differences.
#[must_use]
pub fn normal_scores(fit: &PopulationFit, level: &str, parameter: usize) -> Vec<NormalScore> {
    let mut deviations = fit.standard_deviations.iter().filter(|one| one.level == level);
    let deviation = deviations.nth(parameter).map_or(0.0, |one| one.value);
    let groups = fit.groups.iter().filter(|one| one.level == level);
    let found = groups.filter_map(|one| {
        let own = deviation.powi(2) - one.std_errors[parameter].powi(2);
        // A shift that is not known at all says nothing.
        (own > 1e-12 * deviation.powi(2))
            .then(|| (one.group.clone(), one.shifts[parameter] / own.sqrt()))
    });
    let mut found: Vec<(String, f64)> = found.collect();
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    let count = found.len() as f64;
    let ranked = found.into_iter().enumerate().map(|(rank, (group, found))| {
        let share = (rank as f64 + 0.625) / (count + 0.25);
        NormalScore { group, expected: Normal::standard().inverse_cdf(share), found }
    });
    ranked.collect()
}

/// The group of a level that is farther from the others than one of twenty normal studies has any, by Grubbs (Technometrics 11
/// (1969) 1-21), with its distance from their mean in their standard deviation. One such group, or tails that are heavier than normal
/// ones, make the interval of the level's standard deviation too narrow.
#[must_use]
pub fn outlying_group(fit: &PopulationFit, level: &str, parameter: usize) -> Option<NormalScore> {
    let scores = normal_scores(fit, level, parameter);
    let count = scores.len() as f64;
    if count < 3.0 {
        return None;
    }
    let mean = scores.iter().map(|one| one.found).sum::<f64>() / count;
    let squares = scores.iter().map(|one| (one.found - mean).powi(2)).sum::<f64>();
    let deviation = (squares / (count - 1.0)).sqrt();
    let mut distances =
        scores.into_iter().map(|one| NormalScore { found: (one.found - mean) / deviation, ..one });
    let first = distances.next()?;
    let farthest =
        distances.fold(first, |far, one| if one.found.abs() > far.found.abs() { one } else { far });
    let square = farthest.found.powi(2);
    // Student's t of the farthest, with two degrees of freedom less than groups.
    let rest = (count - 1.0).powi(2) - count * square;
    let is_far = rest <= 0.0 || {
        let t = (count * (count - 2.0) * square / rest).sqrt();
        2.0 * count * student(count - 2.0)?.cdf(-t) < OUTLYING
    };
    is_far.then_some(farthest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::balanced;
    use crate::{PopulationOptions, fit_population};

    /// Repeats of a balanced study are one residual up and one down, and their standard deviation is known.
    #[test]
    fn shifts_are_in_their_own_standard_deviations() {
        let fit = fit_population(&balanced(9.0, 2.0, 1.0), &PopulationOptions::default()).unwrap();
        let scores = normal_scores(&fit, "repeat", 0);
        assert_eq!(scores.len(), 36);
        assert!(scores.windows(2).all(|pair| pair[0].found <= pair[1].found));
        assert!((scores[0].expected + scores[35].expected).abs() < 1e-9);
        // R: `qnorm(0.625 / 36.25)`.
        assert!((scores[0].expected + 2.114_381).abs() < 1e-6, "{scores:?}");
        let squares: f64 = scores.iter().map(|one| one.found.powi(2)).sum();
        // Best predictions have their own variance in the mean, as many as degrees of freedom are left of the repeats or more.
        assert!((18.0..=37.0).contains(&squares), "{squares}");
    }

    /// The critical value of ten is 2.290 at five percent, of both ends together (Grubbs & Beck, Technometrics 14 (1972) 847-854,
    /// table I, two and a half percent of one end).
    #[test]
    fn a_group_far_off_is_named() {
        let mut study = balanced(9.0, 2.0, 1.0);
        study.sessions.iter_mut().for_each(|one| one.values[0] *= 0.01);
        let mut fit = fit_population(&study, &PopulationOptions::default()).unwrap();
        fit.groups.retain(|one| one.level == "site");
        fit.groups.truncate(10);
        // Nine shifts of a standard deviation and mean for which the tenth, at `far`, has a chosen distance.
        let mut distance = |far: f64| {
            for (k, one) in fit.groups.iter_mut().enumerate() {
                one.std_errors[0] = 0.0;
                one.shifts[0] = if k == 9 { far } else { k as f64 - 4.0 };
            }
            outlying_group(&fit, "site", 0)
        };
        assert_eq!(distance(10.9), None);
        let found = distance(11.2).unwrap();
        assert_eq!(found.group, fit.groups[9].group);
        assert!((found.found - 2.290).abs() < 0.02, "{found:?}");
    }
}
