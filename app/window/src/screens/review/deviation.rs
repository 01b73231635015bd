//! How far a value is from those it belongs to, by statistics that one outlier does not move.

/// Makes the median absolute deviation of normal values their standard deviation.
const NORMAL: f64 = 1.4826;
/// Fewer values say nothing of how far apart values are.
const VALUES_MIN: usize = 4;
/// From so many values on: the largest distance that one in twenty groups of normal values has by chance, which is larger
/// where the median absolute deviation is of few. Found by drawing 60 000 groups of each size.
const OUTLIERS: [(usize, f64); 13] = [
    (4, 6.9),
    (5, 8.0),
    (6, 5.5),
    (7, 5.9),
    (8, 4.9),
    (9, 5.0),
    (10, 4.6),
    (11, 4.7),
    (12, 4.35),
    (14, 4.2),
    (16, 4.1),
    (20, 4.0),
    (30, 3.8),
];

/// The median; none without values.
pub(super) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|one| one.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    let high = *sorted.get(middle)?;
    Some(if sorted.len() % 2 == 1 { high } else { 0.5 * (sorted[middle - 1] + high) })
}

/// How far a value is from the median of its group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Deviation {
    /// In robust standard deviations, the value's own standard uncertainty included; above zero for one above the median.
    pub distance: f64,
    /// Further than chance explains.
    pub is_outlier: bool,
}

/// Distance of each value from the median, of values with their standard uncertainties; none where there are too few, or
/// where most are equal.
pub(super) fn deviations(values: &[(f64, f64)]) -> Option<Vec<Deviation>> {
    let plain: Vec<f64> = values.iter().map(|(value, _)| *value).collect();
    let middle = median(&plain).filter(|_| values.len() >= VALUES_MIN)?;
    let apart: Vec<f64> = plain.iter().map(|value| (value - middle).abs()).collect();
    let unit = NORMAL * median(&apart)?;
    let (_, limit) = OUTLIERS.iter().rev().find(|(count, _)| *count <= values.len())?;
    let deviation = |(value, uncertainty): &(f64, f64)| {
        let distance = (value - middle) / unit.hypot(*uncertainty);
        Deviation { distance, is_outlier: distance.abs() > *limit }
    };
    (unit > 0.0).then(|| values.iter().map(deviation).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::random::SplitMix;

    fn exact(values: &[f64]) -> Option<Vec<Deviation>> {
        deviations(&values.iter().map(|value| (*value, 0.0)).collect::<Vec<_>>())
    }

    #[test]
    fn one_outlier_does_not_move_the_scale() {
        let found = exact(&[1.0, 2.0, 3.0, 4.0, 100.0]).unwrap();
        assert_eq!(found[2].distance, 0.0);
        // The distances are 2, 1, 0, 1, 97, and their median is 1.
        assert!((found[0].distance + 2.0 / NORMAL).abs() < 1e-12 && !found[0].is_outlier);
        assert!((found[4].distance - 97.0 / NORMAL).abs() < 1e-12 && found[4].is_outlier);
        // A value that is not known better than that is none.
        let values = [(1.0, 0.0), (2.0, 0.0), (3.0, 0.0), (4.0, 0.0), (100.0, 40.0)];
        assert!(!deviations(&values).unwrap()[4].is_outlier);
        assert_eq!(median(&[1.0, f64::NAN, 3.0]), Some(2.0));
        assert_eq!((median(&[]), exact(&[1.0, 2.0, 9.0])), (None, None));
        assert_eq!(exact(&[1.0, 1.0, 1.0, 5.0]), None);
    }

    /// 4000 groups of each size: 5 % and four standard errors of the count, 1.4 %.
    #[test]
    fn one_group_of_normal_values_in_twenty_has_an_outlier() {
        let mut random = SplitMix::seeded(31);
        for count in [4, 5, 6, 8, 10, 12, 20] {
            let mut marked = 0;
            for _ in 0..4000 {
                let values: Vec<f64> = (0..count).map(|_| random.normal()).collect();
                let found = exact(&values).unwrap();
                marked += u32::from(found.iter().any(|one| one.is_outlier));
            }
            let share = f64::from(marked) / 4000.0;
            assert!((0.036..0.064).contains(&share), "{count}: {share}");
        }
    }
}
