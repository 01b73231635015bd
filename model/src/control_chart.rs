//! Control limits of single readings over time (Shewhart's chart for individuals, ISO 7870-2), and what shows that the process
//! moves before a reading leaves them.

/// Readings from which limits are computed at least: with fewer, the mean moving range is uncertain by more than a
/// quarter.
pub const READINGS_MIN: usize = 10;

/// Three standard deviations over the mean moving range of two readings, which is 1.128 standard deviations: 3 / 1.128.
const LIMITS_PER_RANGE: f64 = 2.66;

/// Readings in a row on one side of the mean that show a shift (Western Electric, Statistical Quality Control Handbook, 1956); eight
/// given ones of a steady process do so once in 128 times.
const SHIFT: usize = 8;

/// Readings in a row that each rise, or fall, and show a trend (Nelson, J. Quality Technology 16 (1984) 237-239).
const TREND: usize = 6;

/// Mean and limits, in the unit of the readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlLimits {
    pub mean: f64,
    pub low: f64,
    pub high: f64,
}

/// What the last readings show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControlSignal {
    /// The last reading is beyond the limits of those before it.
    Beyond,
    /// Two of the last three are beyond two thirds of the way to one limit.
    NearLimit,
    /// So many in a row lie on one side of the mean.
    Shift(usize),
    /// So many in a row rise, or fall.
    Trend(usize),
}

impl ControlLimits {
    /// Limits of a steady process that gave these readings; `None` of fewer than [`READINGS_MIN`].
    #[must_use]
    pub fn of(readings: &[f64]) -> Option<Self> {
        if readings.len() < READINGS_MIN {
            return None;
        }
        let mean = readings.iter().sum::<f64>() / readings.len() as f64;
        let ranges = readings.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let half = LIMITS_PER_RANGE * ranges.sum::<f64>() / (readings.len() - 1) as f64;
        Some(Self { mean, low: mean - half, high: mean + half })
    }

    /// What the last of all readings show against these limits, the gravest first.
    pub fn signal(&self, readings: &[f64]) -> Option<ControlSignal> {
        let last = *readings.last()?;
        if !(self.low..=self.high).contains(&last) {
            return Some(ControlSignal::Beyond);
        }
        let share = |reading: &f64| (reading - self.mean) / (self.high - self.mean);
        let recent = &readings[readings.len().saturating_sub(3)..];
        let is_near = |side: f64| {
            recent.iter().filter(|reading| side * share(reading) > 2.0 / 3.0).count() >= 2
        };
        if is_near(1.0) || is_near(-1.0) {
            return Some(ControlSignal::NearLimit);
        }
        let trend = trend_of(readings);
        if trend >= TREND {
            return Some(ControlSignal::Trend(trend));
        }
        let is_above = last > self.mean;
        let backwards = readings.iter().rev();
        let run = backwards.take_while(|reading| (**reading > self.mean) == is_above).count();
        (run >= SHIFT).then_some(ControlSignal::Shift(run))
    }
}

/// How many readings at the end rise, or fall, one after the other.
fn trend_of(readings: &[f64]) -> usize {
    let steps = readings.windows(2).rev().map(|pair| pair[1].total_cmp(&pair[0]));
    let steps: Vec<std::cmp::Ordering> = steps.collect();
    match steps.first() {
        Some(first) if first.is_ne() => 1 + steps.iter().take_while(|step| *step == first).count(),
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_those_of_the_moving_range() {
        let readings = [10.0, 11.0, 10.0, 12.0, 10.0, 11.0, 10.0, 11.0, 10.0, 11.0];
        let limits = ControlLimits::of(&readings).unwrap();
        // Nine ranges: 1, 1, 2, 2, 1, 1, 1, 1, 1.
        let half = 2.66 * 11.0 / 9.0;
        assert!((limits.mean - 10.6).abs() < 1e-12);
        assert!((limits.high - limits.mean - half).abs() < 1e-12);
        assert!((limits.mean - limits.low - half).abs() < 1e-12);
        assert_eq!(ControlLimits::of(&readings[..9]), None);
    }

    #[test]
    fn every_signal_is_told_by_its_own_pattern() {
        let limits = ControlLimits { mean: 0.0, low: -3.0, high: 3.0 };
        let signal = |readings: &[f64]| limits.signal(readings);
        assert_eq!(signal(&[0.0, 1.0, 3.1]), Some(ControlSignal::Beyond));
        assert_eq!(signal(&[-2.1, 0.0, -2.2]), Some(ControlSignal::NearLimit));
        assert_eq!(signal(&[2.1, 0.0, -2.2]), None);
        let rising = [-1.9, -1.0, -0.5, 0.1, 0.2, 0.3];
        assert_eq!(signal(&rising), Some(ControlSignal::Trend(6)));
        assert_eq!(signal(&rising[1..]), None);
        let above = [-1.0, 0.5, 0.4, 0.6, 0.5, 0.7, 0.2, 0.3, 0.1];
        assert_eq!(signal(&above), Some(ControlSignal::Shift(8)));
        assert_eq!(signal(&above[..8]), None);
        assert_eq!(signal(&[]), None);
        // A reading that stands still shows nothing.
        assert_eq!(signal(&[0.0; 7]), None);
    }

    #[test]
    fn a_steady_process_leaves_its_limits_as_seldom_as_is_said() {
        let mut random = crate::random::SplitMix::seeded(7);
        let readings: Vec<f64> = (0..20_000).map(|_| random.normal()).collect();
        let limits = ControlLimits::of(&readings).unwrap();
        let is_beyond = |reading: &&f64| !(limits.low..=limits.high).contains(*reading);
        let beyond = readings.iter().filter(is_beyond).count();
        // 0.27 % of a normal distribution, 54 of them, give or take four standard deviations.
        assert!((25..=84).contains(&beyond), "{beyond}");
    }
}
