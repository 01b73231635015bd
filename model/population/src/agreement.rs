//! How far two ways to measure agree, such as two operators or two rigs.

use crate::fit::{quantile, student};
use serde::Serialize;
use thiserror::Error;

/// Standard deviations to either limit of agreement.
const LIMIT: f64 = 1.96;

/// A place that was measured in both ways.
#[derive(Clone, Debug, PartialEq)]
pub struct PairedPlace {
    pub name: String,
    /// Logarithms of a parameter, one for each session of the way.
    pub first: Vec<f64>,
    pub second: Vec<f64>,
}

/// Limits of agreement: what single sessions of both ways in one place differ by, second less first, in logarithms.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Agreement {
    pub places: usize,
    pub bias: f64,
    /// 95 % interval of the bias.
    pub bias_interval: [f64; 2],
    /// Of the difference between two single sessions.
    pub std_dev: f64,
    /// Between which 95 % of differences lie.
    pub limits: [f64; 2],
    /// 95 % interval of each of them.
    pub limit_intervals: [[f64; 2]; 2],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum AgreementError {
    #[error("{found} places were measured in both ways; agreement needs 3 or more")]
    Places { found: usize },
}

/// What sessions of one way in one place scatter by.
struct Within {
    variance: f64,
    freedom: f64,
    /// One less the mean of one over the sessions of a place: what a mean over sessions hides.
    hidden: f64,
}

impl Within {
    fn of<'a>(all: impl Iterator<Item = &'a [f64]> + Clone) -> Self {
        let square = |values: &[f64]| {
            let middle = mean(values);
            values.iter().map(|value| (value - middle).powi(2)).sum::<f64>()
        };
        let freedom = all.clone().map(|values| values.len() - 1).sum::<usize>() as f64;
        let variance = all.clone().map(square).sum::<f64>() / freedom.max(1.0);
        let places = all.clone().count() as f64;
        let shares = all.map(|values| 1.0 / values.len() as f64).sum::<f64>();
        Self { variance, freedom, hidden: 1.0 - shares / places }
    }

    fn part(&self) -> f64 {
        self.hidden * self.variance
    }

    /// Variance of the part.
    fn uncertainty(&self) -> f64 {
        2.0 * self.part().powi(2) / self.freedom.max(1.0)
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Limits of agreement where a place may have several sessions of each way (Bland & Altman, Statistical Methods in Medical Research
/// 8 (1999) 135-160, sections 2 and 5).
///
/// # Errors
/// Fewer than three places have sessions of both ways.
pub fn agreement(places: &[PairedPlace]) -> Result<Agreement, AgreementError> {
    let is_paired = |place: &&PairedPlace| !place.first.is_empty() && !place.second.is_empty();
    let places: Vec<&PairedPlace> = places.iter().filter(is_paired).collect();
    if places.len() < 3 {
        return Err(AgreementError::Places { found: places.len() });
    }
    let differences = places.iter().map(|place| mean(&place.second) - mean(&place.first));
    let differences: Vec<f64> = differences.collect();
    let (count, bias) = (places.len() as f64, mean(&differences));
    let squares = differences.iter().map(|one| (one - bias).powi(2)).sum::<f64>();
    let of_means = squares / (count - 1.0);
    let within = [
        Within::of(places.iter().map(|place| place.first.as_slice())),
        Within::of(places.iter().map(|place| place.second.as_slice())),
    ];
    let variance = of_means + within.iter().map(Within::part).sum::<f64>();
    let uncertainty = 2.0 * of_means.powi(2) / (count - 1.0)
        + within.iter().map(Within::uncertainty).sum::<f64>();
    let std_dev = variance.sqrt();
    // That of a standard deviation, where there is one.
    let of_std_dev = if variance > 0.0 { uncertainty / (4.0 * variance) } else { 0.0 };
    let t = student(count - 1.0).map_or(f64::NAN, |student| quantile(&student));
    let half = t * (of_means / count).sqrt();
    let of_limit = t * (of_means / count + LIMIT.powi(2) * of_std_dev).sqrt();
    let limits = [-LIMIT, LIMIT].map(|share| bias + share * std_dev);
    Ok(Agreement {
        places: places.len(),
        bias,
        bias_interval: [bias - half, bias + half],
        std_dev,
        limits,
        limit_intervals: limits.map(|limit| [limit - of_limit, limit + of_limit]),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::random::SplitMix;

    /// Peak flow in l/min by two meters, first readings (Bland & Altman, Lancet 327 (1986) 307-310, table): difference -2.1, standard
    /// deviation 38.8, interval of the difference -22.0 to 17.8.
    #[test]
    fn limits_of_single_readings_are_those_of_the_paper() {
        let large =
            [494, 395, 516, 434, 476, 557, 413, 442, 650, 433, 417, 656, 267, 478, 178, 423, 427];
        let mini =
            [512, 430, 520, 428, 500, 600, 364, 380, 658, 445, 432, 626, 260, 477, 259, 350, 451];
        let places: Vec<PairedPlace> = large
            .iter()
            .zip(mini)
            .map(|(large, mini)| PairedPlace {
                name: large.to_string(),
                first: vec![f64::from(mini)],
                second: vec![f64::from(*large)],
            })
            .collect();
        let found = agreement(&places).unwrap();
        assert!(
            (found.bias + 2.1).abs() < 0.05 && (found.std_dev - 38.8).abs() < 0.05,
            "{found:?}"
        );
        assert!((found.bias_interval[0] + 22.0).abs() < 0.1, "{found:?}");
        assert!((found.bias_interval[1] - 17.8).abs() < 0.1, "{found:?}");
        assert_eq!(agreement(&places[..2]), Err(AgreementError::Places { found: 2 }));
    }

    /// Drawn places of two sessions by one way and three by the other: differences of single sessions have a variance of 2 times
    /// 0.04, those of the ways' places, and 0.09 and 0.16 of sessions.
    #[test]
    fn limits_of_repeated_sessions_are_those_of_single_ones() {
        let mut random = SplitMix::seeded(5);
        let truth = 0.5 + LIMIT * f64::sqrt(0.08 + 0.09 + 0.16);
        let (mut covered, mut sum) = (0, 0.0);
        let studies = 400;
        for _ in 0..studies {
            let mut way = |own: f64, count: usize, deviation: f64| -> Vec<f64> {
                let place = own + 0.2 * random.normal();
                (0..count).map(|_| place + deviation * random.normal()).collect()
            };
            let place = |_| PairedPlace {
                name: String::new(),
                first: way(0.0, 2, 0.3),
                second: way(0.5, 3, 0.4),
            };
            let found = agreement(&(0..20).map(place).collect::<Vec<_>>()).unwrap();
            let [low, high] = found.limit_intervals[1];
            covered += usize::from(low <= truth && truth <= high);
            sum += found.std_dev.powi(2);
        }
        // Four standard errors of 95 %; the mean of 400 variances is known to one percent.
        assert!((363..=397).contains(&covered), "{covered}");
        assert!((sum / studies as f64 / 0.33 - 1.0).abs() < 0.04, "{sum}");
    }
}
