//! Random numbers from a recorded seed.

/// SplitMix64 (Steele, Lea & Flood, OOPSLA 2014): the same numbers from the same seed on any machine.
#[derive(Clone, Debug)]
pub struct SplitMix(u64);

impl SplitMix {
    #[must_use]
    pub fn seeded(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in 0..1, 1 excluded.
    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform below `count`, which is far below 2^53.
    pub fn below(&mut self, count: usize) -> usize {
        ((self.share() * count as f64) as usize).min(count - 1)
    }

    /// Normal with mean 0 and standard deviation 1 (Box & Muller, Ann. Math. Stat. 29 (1958) 610-611).
    pub fn normal(&mut self) -> f64 {
        // 1 - share is never 0.
        let radius = (-2.0 * (1.0 - self.share()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.share()).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_are_normal() {
        let mut random = SplitMix::seeded(1);
        let count = 100_000;
        let (mut sum, mut square, mut beyond) = (0.0, 0.0, 0);
        for _ in 0..count {
            let value = random.normal();
            sum += value;
            square += value * value;
            beyond += i32::from(value.abs() > 1.959_964);
        }
        // Four standard errors each.
        let n = f64::from(count);
        assert!((sum / n).abs() < 4.0 / n.sqrt());
        assert!((square / n - 1.0).abs() < 4.0 * (2.0 / n).sqrt());
        assert!((f64::from(beyond) / n - 0.05).abs() < 4.0 * (0.05 * 0.95 / n).sqrt());
    }
}
