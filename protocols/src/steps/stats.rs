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
        if self.count < 2 { 0.0 } else { (self.sum_squares / (self.count - 1) as f64).sqrt() }
    }
}

/// A straight line through a stream of points, in constant memory, by the same updates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RunningLine {
    count: u64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl RunningLine {
    pub fn push(&mut self, x: f64, y: f64) {
        self.count += 1;
        let share = 1.0 / self.count as f64;
        let (dx, dy) = (x - self.x, y - self.y);
        self.x += dx * share;
        self.y += dy * share;
        self.xx += dx * (x - self.x);
        self.xy += dx * (y - self.y);
        self.yy += dy * (y - self.y);
    }

    pub fn count(&self) -> u64 {
        self.count
    }

    /// Slope and its standard error under white noise; `None` below three points or without spread.
    pub fn slope(&self) -> Option<(f64, f64)> {
        if self.count < 3 || self.xx <= 0.0 {
            return None;
        }
        let slope = self.xy / self.xx;
        let residual = (self.yy - slope * self.xy).max(0.0);
        Some((slope, (residual / (self.count - 2) as f64 / self.xx).sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn running_deviation_agrees_with_the_two_pass_formula() {
        let values = [1.28, 1.281, 1.279, 1.2805, 1.2795];
        let mut stats = RunningStats::default();
        values.iter().for_each(|&value| stats.push(value));
        let mean = values.iter().sum::<f64>() / 5.0;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 4.0;
        assert!((stats.mean() - mean).abs() < 1e-15);
        // Squared deviations of 1e-3 on values of 1.28: cancellation leaves about ten digits.
        assert!((stats.std_dev() / variance.sqrt() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn running_line_agrees_with_the_textbook() {
        let mut line = RunningLine::default();
        let points = [(0.0, 1.1), (1.0, 2.9), (2.0, 5.2), (3.0, 6.8)];
        points.iter().for_each(|&(x, y)| line.push(1e6 + x, y));
        // By hand: Sxx = 5, Sxy = 9.7, Syy = 18.9; residuals (18.9 - 9.7^2 / 5) / 2 / 5.
        let (slope, error) = line.slope().unwrap();
        assert!((slope - 1.94).abs() < 1e-9, "{slope}");
        assert!((error - 0.0082f64.sqrt()).abs() < 1e-8, "{error}");
        assert_eq!(RunningLine::default().slope(), None);
    }
}
