//! Mean and scatter of a value in groups of sessions, and by how much two groups differ.

use palpate_model::estimate::student_t975;

/// Mean of a group, and how far its values scatter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupStatistics {
    pub count: usize,
    pub mean: f64,
    /// Of one value, with one degree of freedom less than values; none of a single value.
    pub std_dev: Option<f64>,
}

impl GroupStatistics {
    /// Of finite values; none without any.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        let count = values.len();
        if count == 0 {
            return None;
        }
        let mean = values.iter().sum::<f64>() / count as f64;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let std_dev = (count > 1).then(|| (squares / (count - 1) as f64).sqrt());
        Some(Self { count, mean, std_dev })
    }

    /// Squared standard error of the mean.
    fn mean_variance(&self) -> Option<f64> {
        Some(self.std_dev?.powi(2) / self.count as f64)
    }
}

/// Difference of two means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanDifference {
    /// The second mean less the first.
    pub value: f64,
    /// Half of its 95 % interval.
    pub half_width: f64,
}

/// By how much the mean of the second group differs from that of the first, without the assumption that both scatter
/// alike (Welch, Biometrika 34:28, 1947; degrees of freedom by Satterthwaite, Biometrics Bulletin 2:110, 1946). None
/// where a group has one value only, or neither scatters.
#[must_use]
pub fn mean_difference(
    first: &GroupStatistics,
    second: &GroupStatistics,
) -> Option<MeanDifference> {
    let [a, b] = [first.mean_variance()?, second.mean_variance()?];
    let variance = a + b;
    if variance <= 0.0 {
        return None;
    }
    let own = |part: f64, of: &GroupStatistics| part.powi(2) / (of.count - 1) as f64;
    let freedom = variance.powi(2) / (own(a, first) + own(b, second));
    let half_width = student_t975(freedom) * variance.sqrt();
    Some(MeanDifference { value: second.mean - first.mean, half_width })
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::random::SplitMix;

    /// Half of the interval by integrating the density of Student's t numerically at 7.943 degrees of freedom, where the
    /// quantile is 2.308865; ours is good to 1e-3 from 6 on.
    #[test]
    fn the_interval_is_that_of_an_integrated_density() {
        let first = GroupStatistics::of(&[27.5, 21.0, 19.0, 23.6, 17.0, 17.9]).unwrap();
        let second = GroupStatistics::of(&[27.1, 22.0, 20.8, 23.4]).unwrap();
        let found = mean_difference(&first, &second).unwrap();
        assert!((found.value - 2.325).abs() < 1e-9);
        assert!((found.half_width - 4.890_377).abs() < 1e-3 * found.half_width);
    }

    #[test]
    fn nothing_is_stated_of_what_does_not_scatter() {
        assert_eq!(GroupStatistics::of(&[]), None);
        let one = GroupStatistics::of(&[2.0]).unwrap();
        assert_eq!((one.mean, one.std_dev), (2.0, None));
        let two = GroupStatistics::of(&[1.0, 3.0]).unwrap();
        assert_eq!(two.std_dev, Some(2.0_f64.sqrt()));
        assert_eq!(mean_difference(&one, &two), None);
        let same = GroupStatistics::of(&[4.0, 4.0]).unwrap();
        assert_eq!(mean_difference(&same, &same), None);
    }

    /// 4000 pairs of groups of five and four with different scatter: 95 % within three standard errors of the count, 1 %,
    /// and what Welch's own approximation is off by in groups so small, another 1 %.
    #[test]
    fn intervals_hold_the_true_difference() {
        let mut random = SplitMix::seeded(5);
        let draws = 4000;
        let mut held = 0;
        for _ in 0..draws {
            let mut group = |count: usize, mean: f64, scatter: f64| {
                let values: Vec<f64> =
                    (0..count).map(|_| mean + scatter * random.normal()).collect();
                GroupStatistics::of(&values).unwrap()
            };
            let (first, second) = (group(5, 1.0, 0.1), group(4, 1.5, 0.3));
            let found = mean_difference(&first, &second).unwrap();
            held += usize::from((found.value - 0.5).abs() <= found.half_width);
        }
        let share = held as f64 / f64::from(draws);
        assert!((0.93..0.97).contains(&share), "{share}");
    }
}
