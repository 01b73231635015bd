//! Whether the shifts of groups look like those of a normal distribution.

use crate::fit::PopulationFit;
use statrs::distribution::{ContinuousCDF, Normal};

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
}
