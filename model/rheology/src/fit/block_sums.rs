//! Sums of a record's columns over blocks of samples, from which the autocorrelation of its residuals is estimated.

use super::design::{LANES, Lane};
use super::sample::FitSample;
use palpate_model::autocorrelation::BLOCKS_MAX;

/// Sums over one block of samples of all columns of a record's triangle, times their weights.
#[derive(Clone, Debug)]
pub(super) struct NoiseBlock {
    pub sums: Vec<f64>,
    /// Samples whose force counts.
    pub count: usize,
    /// Position among all blocks of the record, those with too few such samples included.
    pub place: usize,
}

/// Block sums of the columns, in blocks of a power of two or of whole lanes.
pub(super) struct NoiseSums {
    blocks: Vec<NoiseBlock>,
    length: usize,
    sums: Vec<f64>,
    /// Samples in the present block, and those of them whose force counts.
    taken: usize,
    count: usize,
    place: usize,
}

impl NoiseSums {
    pub fn new(samples: usize, width: usize) -> Self {
        let wanted = samples.div_ceil(BLOCKS_MAX);
        let length = if wanted <= LANES {
            wanted.next_power_of_two()
        } else {
            wanted.div_ceil(LANES) * LANES
        };
        Self {
            blocks: Vec::with_capacity(samples / length + 1),
            length,
            sums: vec![0.0; width],
            taken: 0,
            count: 0,
            place: 0,
        }
    }

    #[inline(always)]
    pub fn add(&mut self, columns: &[Lane], samples: &[FitSample]) {
        let count = samples.len();
        // The walk visits the first sample alone; it joins the first block.
        let part = if count == 1 { 1 } else { self.length.min(LANES) };
        let mut start = 0;
        while start < count {
            let end = (start + part).min(count);
            for (sum, column) in self.sums.iter_mut().zip(columns) {
                *sum += column[start..end].iter().sum::<f64>();
            }
            let part = &samples[start..end];
            self.count += part.iter().filter(|sample| sample.is_measured()).count();
            self.taken += end - start;
            start = end;
            if self.taken >= self.length {
                self.close();
            }
        }
    }

    /// Ends a block; one with forces for less than half its length is left out.
    fn close(&mut self) {
        if 2 * self.count >= self.length {
            self.blocks.push(NoiseBlock {
                sums: self.sums.clone(),
                count: self.count,
                place: self.place,
            });
        }
        self.place += 1;
        self.sums.fill(0.0);
        (self.taken, self.count) = (0, 0);
    }

    pub fn finish(mut self) -> Vec<NoiseBlock> {
        self.close();
        self.blocks
    }
}
