//! Mean and standard deviation of a stream (Welford 1962), in constant memory.

/// Running mean and variance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RunningStats {
    count: u64,
    mean: f64,
    sum_squares: f64,
}

impl RunningStats {
    pub fn push(&mut self, value: f64) {
        self.count += 1;
        let delta = value - self.mean;
        self.mean += delta / self.count as f64;
        self.sum_squares += delta * (value - self.mean);
    }

    pub fn count(&self) -> u64 {
        self.count
    }

    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Sample standard deviation; zero below two values.
    pub fn std_dev(&self) -> f64 {
        if self.count < 2 {
            0.0
        } else {
            (self.sum_squares / (self.count - 1) as f64).sqrt()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_two_pass_formula() {
        let values = [1.28, 1.281, 1.279, 1.2805, 1.2795];
        let mut stats = RunningStats::default();
        values.iter().for_each(|&value| stats.push(value));
        let mean = values.iter().sum::<f64>() / 5.0;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 4.0;
        assert!((stats.mean() - mean).abs() < 1e-15);
        // Squared deviations of 1e-3 on values of 1.28: cancellation leaves about ten digits.
        assert!((stats.std_dev() / variance.sqrt() - 1.0).abs() < 1e-9);
    }
}
