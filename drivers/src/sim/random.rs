//! Random numbers: one recorded seed, one independent generator per cause.
//!
//! Separate generators keep causes apart: a longer run draws more noise but meets the same
//! tissue, and a change to one cause leaves the recorded numbers of the others as they were.

use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_pcg::Pcg64;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RandomStream {
    /// Where the slider stands at power-on, and the controller's count.
    Machine = 1,
    Tissue = 2,
    Noise = 3,
    Drift = 4,
    Link = 5,
    Fault = 6,
    Cell = 7,
    /// A specimen of a population.
    Member = 8,
}

#[derive(Clone, Debug)]
pub struct Random(Pcg64);

impl Random {
    /// The generator of `cause` under `seed`.
    pub fn new(seed: u64, cause: RandomStream) -> Self {
        let cause = cause as u64;
        let high = scramble(seed ^ scramble(cause));
        let low = scramble(high);
        Self(Pcg64::new((u128::from(high) << 64) | u128::from(low), u128::from(cause)))
    }

    /// The generator of a cause that differs from run to run on one rig and specimen; repeat 0 is the first run.
    pub fn of_repeat(seed: u64, repeat: u64, cause: RandomStream) -> Self {
        match repeat {
            0 => Self::new(seed, cause),
            _ => Self::new(seed ^ scramble(repeat), cause),
        }
    }

    /// The generator that draws the specimen with a number; number 0 is the rig's own.
    pub fn of_specimen(seed: u64, specimen: u64) -> Self {
        match specimen {
            0 => Self::new(seed, RandomStream::Tissue),
            _ => Self::new(seed ^ scramble(specimen), RandomStream::Tissue),
        }
    }

    /// Uniform in 0..1, 1 excluded.
    pub fn unit(&mut self) -> f64 {
        StandardUniform.sample(&mut self.0)
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Normal with mean 0 and standard deviation 1.
    #[inline]
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// 1 plus a normal spread, cut off at three standard deviations so that a rare seed does not
    /// make an impossible specimen.
    pub fn around_one(&mut self, spread: f64) -> f64 {
        1.0 + spread * self.normal().clamp(-3.0, 3.0)
    }
}

/// The finaliser of SplitMix64 (Steele, Lea & Flood, OOPSLA 2014): neighbouring seeds become
/// unrelated states.
fn scramble(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scrambler_is_splitmix64() {
        // First two outputs of SplitMix64 from state 0 (the reference program's test values).
        assert_eq!(scramble(0), 0xe220_a839_7b1d_cdaf);
        assert_eq!(scramble(0x9e37_79b9_7f4a_7c15), 0x6e78_9e6a_a1b9_65f4);
    }

    #[test]
    fn causes_and_seeds_are_unrelated() {
        let draw = |seed, cause| -> Vec<f64> {
            let mut random = Random::new(seed, cause);
            (0..4000).map(|_| random.normal()).collect()
        };
        let base = draw(7, RandomStream::Noise);
        assert_eq!(base, draw(7, RandomStream::Noise));
        for other in [
            draw(8, RandomStream::Noise),
            draw(7, RandomStream::Drift),
            draw(7, RandomStream::Link),
        ] {
            let correlation: f64 =
                base.iter().zip(&other).map(|(a, b)| a * b).sum::<f64>() / base.len() as f64;
            // Five standard errors of 1 / sqrt(4000).
            assert!(correlation.abs() < 0.08, "{correlation}");
        }
    }
}
