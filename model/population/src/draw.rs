//! New members of a population.

/// How the parameters of one session of a new animal, specimen and site are distributed, all in logarithms.
///
/// The means and standard deviations count as exact: how well they are known is not in it.
#[derive(Clone, Debug, PartialEq)]
pub struct MemberDistribution {
    /// Of each parameter.
    pub means: Vec<f64>,
    /// Of each level, and there of each parameter.
    pub standard_deviations: Vec<Vec<f64>>,
}

impl MemberDistribution {
    /// Parameters in their units: the exponential of mean and shifts, one independent normal shift of each level. `normal` gives
    /// values of the standard normal distribution; they are taken level by level, and there parameter by parameter.
    pub fn draw(&self, mut normal: impl FnMut() -> f64) -> Vec<f64> {
        let mut logarithms = self.means.clone();
        for level in &self.standard_deviations {
            for (logarithm, deviation) in logarithms.iter_mut().zip(level) {
                *logarithm += deviation * normal();
            }
        }
        logarithms.into_iter().map(f64::exp).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_member_has_the_mean_and_one_shift_of_each_level() {
        let distribution = MemberDistribution {
            means: vec![2f64.ln(), 3f64.ln()],
            standard_deviations: vec![vec![0.1, 0.2], vec![0.3, 0.0]],
        };
        let mut values = [1.0, -1.0, 2.0, 5.0].into_iter();
        let drawn = distribution.draw(|| values.next().unwrap());
        let wanted = [2.0 * 0.7f64.exp(), 3.0 * (-0.2f64).exp()];
        assert_eq!(values.next(), None);
        // A few roundings of a double.
        assert!(drawn.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-14), "{drawn:?}");
    }
}
