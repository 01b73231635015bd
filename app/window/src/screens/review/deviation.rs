//! How far a value is from those it belongs to, by statistics that one outlier does not move.

/// Makes the median absolute deviation of normal values their standard deviation.
const NORMAL: f64 = 1.4826;
/// Fewer values say nothing of how far apart values are.
const VALUES_MIN: usize = 4;
/// A value that is further is an outlier (Iglewicz & Hoaglin, How to Detect and Handle Outliers, ASQC 1993).
pub(super) const OUTLIER: f64 = 3.5;

/// The median; none without values.
pub(super) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|one| one.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    let high = *sorted.get(middle)?;
    Some(if sorted.len() % 2 == 1 { high } else { 0.5 * (sorted[middle - 1] + high) })
}

/// Distance of each value from the median in robust standard deviations; none where there are too few values, or where
/// most are equal.
pub(super) fn deviations(values: &[f64]) -> Option<Vec<f64>> {
    let middle = median(values).filter(|_| values.len() >= VALUES_MIN)?;
    let apart: Vec<f64> = values.iter().map(|value| (value - middle).abs()).collect();
    let unit = NORMAL * median(&apart)?;
    (unit > 0.0).then(|| values.iter().map(|value| (value - middle) / unit).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_outlier_does_not_move_the_scale() {
        let found = deviations(&[1.0, 2.0, 3.0, 4.0, 100.0]).unwrap();
        assert_eq!(found[2], 0.0);
        // The distances are 2, 1, 0, 1, 97, and their median is 1.
        assert!((found[0] + 2.0 / NORMAL).abs() < 1e-12);
        assert!((found[4] - 97.0 / NORMAL).abs() < 1e-12 && found[4] > OUTLIER);
        assert_eq!(median(&[1.0, f64::NAN, 3.0]), Some(2.0));
        assert_eq!((median(&[]), deviations(&[1.0, 2.0, 9.0])), (None, None));
        assert_eq!(deviations(&[1.0, 1.0, 1.0, 5.0]), None);
    }
}
