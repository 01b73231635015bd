//! A thinned history of the run: sums up to the ends of equally long blocks of samples.
//!
//! Differences of neighbouring marks are exact block sums of force and of every column at every
//! node, whatever path the probe took. When there are too many blocks every second mark goes,
//! which doubles the block and loses nothing else: memory stays bounded however long the run.

use super::bank::{Bank, FILTERED};

pub(super) const BLOCKS_MAX: usize = 512;
/// Samples of a block at first: a batch of the bank, so that marks cost no extra work.
const BLOCK_FIRST: u64 = super::bank::BATCH as u64;

/// Everything summed up to the end of one block.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mark {
    /// Time of its last sample in s.
    pub t: f64,
    /// Sums of weight and of weight times force.
    pub shared: [f64; 2],
    /// Weighted sums of the filtered columns at every node.
    pub sums: Vec<[f64; FILTERED]>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Blocks {
    /// The state before the first sample, then the end of each block.
    pub marks: Vec<Mark>,
    pub length: u64,
    since: u64,
}

impl Blocks {
    /// No block yet of a bank with so many nodes.
    pub fn new(nodes: usize) -> Self {
        let start = Mark { t: 0.0, shared: [0.0; 2], sums: vec![[0.0; FILTERED]; nodes] };
        Self { marks: vec![start], length: BLOCK_FIRST, since: 0 }
    }

    /// Counts a sample the bank has taken, and marks the end of its block.
    pub fn count(&mut self, t: f64, bank: &mut Bank) {
        self.since += 1;
        if self.since < self.length {
            return;
        }
        self.since = 0;
        bank.flush();
        let [weight, force, _] = bank.shared();
        self.marks.push(Mark { t, shared: [weight, force], sums: bank.sums() });
        if self.marks.len() > BLOCKS_MAX {
            let mut index = 0;
            self.marks.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.length *= 2;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::bank::Grid;
    use super::*;

    #[test]
    fn memory_is_bounded_and_blocks_stay_equal() {
        let grid = Grid::of(16).unwrap();
        let mut bank = Bank::new(grid);
        let mut blocks = Blocks::new(grid.nodes);
        for i in 0..200_000u32 {
            let t = f64::from(i);
            if i > 0 {
                bank.advance(0.5, 0.5, 1.0);
            }
            bank.weigh(2.0, 1.0);
            blocks.count(t, &mut bank);
            assert!(blocks.marks.len() <= BLOCKS_MAX);
        }
        assert!(blocks.marks.len() > BLOCKS_MAX / 2);
        for pair in blocks.marks.windows(2) {
            // Every weight is one, so sums of weights count samples; sums of ones are exact.
            assert_eq!(pair[1].shared[0] - pair[0].shared[0], blocks.length as f64);
            assert_eq!(pair[1].shared[1] - pair[0].shared[1], 2.0 * blocks.length as f64);
        }
    }
}
