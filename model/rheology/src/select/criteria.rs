//! Information criteria on the effective number of samples.
//!
//! With the variance of the noise unknown, `-2 ln L = n ln(S / n)` up to a constant, for `n`
//! independent samples and the weighted sum of squares `S`. Autocorrelated residuals carry the information of fewer
//! samples than there are; the count, one for all families or they could not be compared, is that of
//! the family with the smallest sum, whose residuals come closest to the noise.
//!
//! AICc: Hurvich & Tsai, Biometrika 76 (1989) 297-307. BIC: Schwarz, Ann. Statist. 6 (1978) 461-464.

/// `(AICc, BIC)` for a mean square of residuals, so many independent samples and parameters, the variance of the noise
/// not counted. AICc is `None` where there are too few samples for its correction.
pub fn criteria(mean_square: f64, effective: f64, free: usize) -> (Option<f64>, f64) {
    let k = (free + 1) as f64;
    let deviance = effective * mean_square.max(f64::MIN_POSITIVE).ln();
    let spare = effective - k - 1.0;
    let corrected = (spare > 0.0).then(|| deviance + 2.0 * k + 2.0 * k * (k + 1.0) / spare);
    (corrected, deviance + k * effective.ln())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn penalties_are_those_of_the_papers() {
        let (aicc, bic) = criteria(1.0, 100.0, 4);
        // k = 5: 2 k + 2 k (k + 1) / (n - k - 1) and k ln n.
        assert!((aicc.unwrap() - (10.0 + 60.0 / 94.0)).abs() < 1e-12);
        assert!((bic - 5.0 * 100f64.ln()).abs() < 1e-12);
        let (_, halved) = criteria(0.5, 100.0, 4);
        assert!((bic - halved - 100.0 * 2f64.ln()).abs() < 1e-12);
        assert_eq!(criteria(1.0, 5.0, 4).0, None);
    }
}
