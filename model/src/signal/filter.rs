//! Boxcar mean of the newest samples.

/// Mean of the newest `n` values; of all of them while there are fewer.
#[derive(Clone, Debug, PartialEq)]
pub struct MovingMean {
    ring: Vec<f64>,
    length: usize,
    next: usize,
    sum: f64,
}

impl MovingMean {
    /// A mean over `length` values, at least one.
    #[must_use]
    pub fn new(length: usize) -> Self {
        let length = length.max(1);
        Self { ring: Vec::with_capacity(length), length, next: 0, sum: 0.0 }
    }

    /// Whether the mean is over all the values it is meant for: before, it hides less noise.
    pub fn is_full(&self) -> bool {
        self.ring.len() == self.length
    }

    /// Takes a value and returns the mean with it.
    pub fn push(&mut self, value: f64) -> f64 {
        if self.ring.len() < self.length {
            self.ring.push(value);
            self.sum += value;
        } else {
            self.sum += value - self.ring[self.next];
            self.ring[self.next] = value;
        }
        self.next += 1;
        if self.next == self.length {
            self.next = 0;
            // Once a round the sum is formed from the values, so rounding does not add up over hours.
            self.sum = self.ring.iter().sum();
        }
        self.sum / self.ring.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_the_mean_of_the_newest_even_after_hours() {
        let mut mean = MovingMean::new(50);
        let value = |i: u64| 1.28 + 1e9 * f64::from(u8::from(i == 1000)) + (i % 7) as f64 * 1e-3;
        let mut last = 0.0;
        for i in 0..1_000_000 {
            last = mean.push(value(i));
        }
        let exact = (999_950..1_000_000).map(value).sum::<f64>() / 50.0;
        // Without the refresh the 1e9 spike would leave 1e-7 behind for ever.
        assert!((last - exact).abs() < 1e-14);
    }

    #[test]
    fn starts_with_what_there_is() {
        let mut mean = MovingMean::new(3);
        assert_eq!(
            [mean.push(1.0), mean.push(2.0), mean.push(3.0), mean.push(4.0)],
            [1.0, 1.5, 2.0, 3.0]
        );
        assert!(mean.is_full() && !MovingMean::new(2).is_full());
    }
}
