//! Several comparisons at a time.

/// Probabilities of several comparisons, each multiplied so that the probability of one or more wrong findings stays what it
/// is of one (Holm, Scandinavian Journal of Statistics 6 (1979) 65-70).
#[must_use]
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|a, b| p_values[*a].total_cmp(&p_values[*b]));
    let mut adjusted = vec![0.0; p_values.len()];
    let mut largest = 0.0f64;
    for (rank, place) in order.into_iter().enumerate() {
        largest = largest.max(((p_values.len() - rank) as f64 * p_values[place]).min(1.0));
        adjusted[place] = largest;
    }
    adjusted
}

#[cfg(test)]
mod tests {
    /// By hand: the smallest four times, the next three times, and none below the one before it.
    #[test]
    fn adjusted_probabilities_are_those_of_holm() {
        let adjusted = super::holm(&[0.01, 0.04, 0.03, 0.005]);
        for (found, expected) in adjusted.iter().zip([0.03, 0.06, 0.06, 0.02]) {
            assert!((found - expected).abs() < 1e-12, "{adjusted:?}");
        }
        assert_eq!(super::holm(&[0.9, 0.8]), [1.0, 1.0]);
    }
}
