//! Means of blocks of samples.
//!
//! Search criteria, noise and force rates are stated for one sample a millisecond. A rig that samples faster is averaged
//! over each millisecond; with at most one sample a millisecond each sample is its own mean, to the bit.

use palpate_model::rig::RigDescription;

/// Averages `N` quantities over blocks of samples.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BlockMean<const N: usize> {
    samples: u32,
    count: u32,
    sums: [f64; N],
}

impl<const N: usize> BlockMean<N> {
    pub fn new(samples: u32) -> Self {
        Self { samples, count: 0, sums: [0.0; N] }
    }

    pub fn of_millisecond(rig: &RigDescription) -> Self {
        Self::new(rig.samples_per_ms())
    }

    /// The means, once a block is complete.
    pub fn push(&mut self, values: [f64; N]) -> Option<[f64; N]> {
        self.count += 1;
        self.sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        if self.count < self.samples {
            return None;
        }
        let means = self.sums.map(|sum| sum / f64::from(self.count));
        self.clear();
        Some(means)
    }

    pub fn clear(&mut self) {
        (self.count, self.sums) = (0, [0.0; N]);
    }
}
