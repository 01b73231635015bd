//! Whether a signal has come to rest under a weight: a slope that its own noise explains.
//!
//! The last samples are kept as [`BLOCKS`] block means. The slope is that of the straight line through the
//! means, the noise is the scatter within the blocks, which a slow slope hardly touches. For white noise the
//! slope of a line through `n` samples over a time `T` has the standard deviation
//! `noise / (T sqrt(n / 12))`.

use crate::units::{Seconds, Volts};
use std::collections::VecDeque;
use std::fmt;

/// Blocks in a window: enough for a line, few enough that an answer comes soon after rest.
pub const BLOCKS: usize = 8;
/// A slope of so many of its standard deviations is no noise: one window in 400 of a steady signal.
const SLOPE_SIGMAS: f64 = 3.0;

/// Fewer samples in a block show no scatter.
const BLOCK_SAMPLES_MIN: u64 = 2;

/// When a signal counts as settled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettleRule {
    /// Length of a tick of the clock that counts them. A sample comes every tick, or every so many.
    pub interval: Seconds,
    /// Length of the window that must be steady.
    pub window: Seconds,
    /// Longest time to wait.
    pub timeout: Seconds,
    /// A change over one window that does not matter, such as one count of the converter.
    pub change_min: Volts,
    /// More scatter than this is no rest: a weight that swings.
    pub noise_max: Volts,
}

impl SettleRule {
    /// A rule for a rig with such a noise of one sample and such a smallest step of the signal.
    ///
    /// Two seconds outlast the swing of a laboratory weight on a guided platform and hold whole cycles
    /// of 50 and 60 Hz; thirty seconds are ten times what a load cell needs after a step. Five times
    /// the expected noise still counts as rest, so that a mains hum is not taken for a swing.
    #[must_use]
    pub fn for_noise(interval: Seconds, noise: Volts, resolution: Volts) -> Self {
        Self {
            interval,
            window: Seconds(2.0),
            timeout: Seconds(30.0),
            change_min: resolution,
            noise_max: Volts(5.0 * noise.0.max(resolution.0)),
        }
    }

    /// Ticks of one block of the window.
    fn block_ticks(&self) -> u64 {
        let ticks = self.window.0 / (self.interval.0 * BLOCKS as f64);
        // A float-to-integer cast saturates; NaN becomes 0.
        (ticks.round() as u64).max(BLOCK_SAMPLES_MIN)
    }
}

/// Mean, noise and slope of a signal over one window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadySignal {
    /// Mean of the window.
    pub mean: Volts,
    /// Standard deviation of one sample.
    pub noise: Volts,
    /// Slope in V/s.
    pub slope_v_per_s: f64,
    /// Samples in the window.
    pub samples: u64,
    /// Time from the first sample pushed to the end of the window.
    pub waited: Seconds,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SettleState {
    /// Not yet at rest.
    Waiting,
    /// At rest. It stays so whatever follows.
    Settled(SteadySignal),
    /// Never at rest within the time allowed. It stays so whatever follows.
    TimedOut(SettleProgress),
}

/// How far a signal has come to rest. Prints as a sentence that says why it is not yet at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettleProgress {
    /// Time waited so far.
    pub waited: Seconds,
    /// Longest time to wait.
    pub timeout: Seconds,
    /// Share of the window that is filled, 0 to 1.
    pub filled: f64,
    /// The last window, once one was full.
    pub last: Option<SteadySignal>,
    /// The slope in V/s that counts as rest; 0 before a window was full.
    pub slope_max_v_per_s: f64,
    /// The scatter that counts as rest.
    pub noise_max: Volts,
}

impl fmt::Display for SettleProgress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let waited = self.waited.0;
        match self.last {
            None => write!(
                f,
                "no gap-free window of the signal has arrived within {waited:.0} s; check the load cell and its wiring"
            ),
            Some(last) if last.noise.0 > self.noise_max.0 => write!(
                f,
                "after {waited:.0} s the signal still scatters by {:.2} mV, more than {:.2} mV; wait until the weight hangs still, or look for interference",
                last.noise.0 * 1e3,
                self.noise_max.0 * 1e3
            ),
            Some(last) => write!(
                f,
                "after {waited:.0} s the signal still moves by {:.3} mV/s, more than the {:.3} mV/s that noise explains; let the load cell warm up, or check that the weight hangs or stands freely",
                last.slope_v_per_s * 1e3,
                self.slope_max_v_per_s * 1e3
            ),
        }
    }
}

/// Mean and squared scatter of a block under construction (Welford 1962).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Block {
    ticks: u64,
    samples: u64,
    mean: f64,
    scatter: f64,
}

impl Block {
    fn push(&mut self, volts: f64) {
        self.samples += 1;
        let before = volts - self.mean;
        self.mean += before / self.samples as f64;
        self.scatter += before * (volts - self.mean);
    }
}

/// Watches a signal sample by sample; memory does not grow.
#[derive(Clone, Debug, PartialEq)]
pub struct SettleDetector {
    rule: SettleRule,
    ticks: u64,
    block: Block,
    blocks: VecDeque<Block>,
    last: Option<(SteadySignal, f64)>,
    verdict: SettleState,
}

impl SettleDetector {
    /// Begins to watch.
    #[must_use]
    pub fn new(rule: SettleRule) -> Self {
        Self {
            rule,
            ticks: 0,
            block: Block::default(),
            blocks: VecDeque::with_capacity(BLOCKS),
            last: None,
            verdict: SettleState::Waiting,
        }
    }

    /// Takes the next sample, so many ticks after the one before. A signal that is not a number restarts the window.
    pub fn push(&mut self, ticks: u64, signal: Volts) -> SettleState {
        if self.verdict != SettleState::Waiting {
            return self.verdict;
        }
        self.ticks += ticks;
        if signal.is_finite() {
            self.block.ticks += ticks;
            self.block.push(signal.0);
        } else {
            self.block = Block::default();
            self.blocks.clear();
        }
        let is_full = self.block.ticks >= self.rule.block_ticks();
        if is_full && self.block.samples >= BLOCK_SAMPLES_MIN {
            if self.blocks.len() == BLOCKS {
                self.blocks.pop_front();
            }
            self.blocks.push_back(std::mem::take(&mut self.block));
            if self.blocks.len() == BLOCKS {
                self.judge();
            }
        }
        if self.verdict == SettleState::Waiting && self.waited().0 >= self.rule.timeout.0 {
            self.verdict = SettleState::TimedOut(self.now());
        }
        self.verdict
    }

    pub fn now(&self) -> SettleProgress {
        SettleProgress {
            waited: self.waited(),
            timeout: self.rule.timeout,
            filled: self.blocks.len() as f64 / BLOCKS as f64,
            last: self.last.map(|(steady, _)| steady),
            slope_max_v_per_s: self.last.map_or(0.0, |(_, slope_max)| slope_max),
            noise_max: self.rule.noise_max,
        }
    }

    fn waited(&self) -> Seconds {
        Seconds(self.ticks as f64 * self.rule.interval.0)
    }

    fn judge(&mut self) {
        let count = BLOCKS as f64;
        let samples: u64 = self.blocks.iter().map(|block| block.samples).sum();
        let ticks: u64 = self.blocks.iter().map(|block| block.ticks).sum();
        let (per_block, block_ticks) = (samples as f64 / count, ticks as f64 / count);
        let mean = self.blocks.iter().map(|block| block.mean).sum::<f64>() / count;
        let places = (0..BLOCKS).map(|i| i as f64 - 0.5 * (count - 1.0));
        let along: f64 =
            places.zip(&self.blocks).map(|(place, block)| place * (block.mean - mean)).sum();
        // Sum of the squared places of `count` blocks a block apart.
        let square = count * (count * count - 1.0) / 12.0;
        let block_time = block_ticks * self.rule.interval.0;
        let slope = along / square / block_time;
        let scatter: f64 = self.blocks.iter().map(|block| block.scatter).sum();
        let noise = (scatter / (count * (per_block - 1.0))).sqrt();
        let length = count * block_time;
        let slope_sigma = noise / (length * (count * per_block / 12.0).sqrt());
        let slope_max = (SLOPE_SIGMAS * slope_sigma).max(self.rule.change_min.0 / length);
        let steady = SteadySignal {
            mean: Volts(mean),
            noise: Volts(noise),
            slope_v_per_s: slope,
            samples,
            waited: self.waited(),
        };
        self.last = Some((steady, slope_max));
        if slope.abs() <= slope_max && noise <= self.rule.noise_max.0 {
            self.verdict = SettleState::Settled(steady);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix;

    const RULE: SettleRule = SettleRule {
        interval: Seconds(0.001),
        window: Seconds(2.0),
        timeout: Seconds(30.0),
        change_min: Volts(20.0 / 65_536.0),
        noise_max: Volts(0.005),
    };

    /// The verdict on a signal over time with white noise of 1 mV.
    fn watch(seed: u64, signal: impl Fn(f64) -> f64) -> SettleState {
        let mut random = SplitMix::seeded(seed);
        let mut settling = SettleDetector::new(RULE);
        for i in 0..40_000 {
            let t = f64::from(i) * 1e-3;
            let verdict = settling.push(1, Volts(signal(t) + 1e-3 * random.normal()));
            if verdict != SettleState::Waiting {
                return verdict;
            }
        }
        SettleState::Waiting
    }

    #[test]
    fn a_step_that_creeps_is_waited_for() {
        for seed in 0..20 {
            let creep = |t: f64| 1.6 - 0.02 * (-t / 1.5).exp();
            let SettleState::Settled(steady) = watch(seed, creep) else {
                panic!("seed {seed} never settles");
            };
            // What is left of the creep is within what one count or the noise of the mean hides.
            let miss = (steady.mean.0 - 1.6).abs();
            assert!(miss < 1.2 * RULE.change_min.0, "seed {seed}: {miss}");
            assert!((steady.noise.0 - 1e-3).abs() < 1e-4, "{steady:?}");
            assert!((3.0..15.0).contains(&steady.waited.0), "{steady:?}");
            assert_eq!(steady.samples, 2000);
        }
    }

    #[test]
    fn a_steady_signal_settles_with_the_first_window_or_soon_after() {
        let first = (0..200).filter(|&seed| {
            matches!(watch(seed, |_| 1.28), SettleState::Settled(steady) if steady.waited.0 <= 2.0 + 1e-9)
        });
        // 3 sigma, or one count if that is more: hardly one in 400 waits longer.
        assert!(first.count() >= 196);
    }

    #[test]
    fn a_drift_and_a_swing_time_out_and_say_so() {
        let SettleState::TimedOut(drift) = watch(3, |t| 1.28 + 0.002 * t) else {
            panic!("a drift of 2 mV/s settled");
        };
        assert!((drift.waited.0 - 30.0).abs() < 0.01);
        let slope = drift.last.unwrap().slope_v_per_s;
        assert!((slope - 0.002).abs() < 2e-4, "{slope}");
        assert!(drift.to_string().contains("still moves"), "{drift}");
        let swing = |t: f64| 1.28 + 0.02 * (std::f64::consts::TAU * 2.0 * t).sin();
        let SettleState::TimedOut(swing) = watch(3, swing) else {
            panic!("a swing of 20 mV settled");
        };
        assert!(swing.to_string().contains("still scatters"), "{swing}");
    }

    #[test]
    fn a_slow_cell_is_waited_for_as_long_as_a_fast_one() {
        // Eighty samples a second on a clock of milliseconds: 12 or 13 ticks apart.
        for seed in 0..20 {
            let mut random = SplitMix::seeded(seed);
            let mut settling = SettleDetector::new(RULE);
            let mut verdict = SettleState::Waiting;
            let mut sample = 0_u64;
            while verdict == SettleState::Waiting {
                sample += 1;
                let ticks = 12 + sample % 2;
                let t = sample as f64 * 0.0125;
                let volts = 1.6 - 0.02 * (-t / 0.3).exp() + 2e-4 * random.normal();
                verdict = settling.push(ticks, Volts(volts));
            }
            let SettleState::Settled(steady) = verdict else {
                panic!("seed {seed}: {verdict:?}");
            };
            assert!((steady.mean.0 - 1.6).abs() < 5e-4, "{steady:?}");
            assert!((2.0..8.0).contains(&steady.waited.0), "{steady:?}");
            assert!((155..=170).contains(&steady.samples), "{steady:?}");
            assert!((steady.noise.0 - 2e-4).abs() < 6e-5, "{steady:?}");
        }
    }

    #[test]
    fn a_gap_restarts_the_window_and_the_verdict_stays() {
        let mut settling = SettleDetector::new(RULE);
        for i in 0..1999 {
            let volts = if i == 1500 { f64::NAN } else { 1.28 };
            assert_eq!(settling.push(1, Volts(volts)), SettleState::Waiting);
        }
        let mut verdict = SettleState::Waiting;
        for _ in 0..2000 {
            verdict = settling.push(1, Volts(1.28));
        }
        let SettleState::Settled(steady) = verdict else {
            panic!("{verdict:?}");
        };
        assert_eq!((steady.noise, steady.slope_v_per_s), (Volts(0.0), 0.0));
        assert!((steady.waited.0 - 3.501).abs() < 1e-9, "{steady:?}");
        assert_eq!(settling.push(1, Volts(9.0)), verdict);
        let mut blind = SettleDetector::new(RULE);
        let verdict = (0..30_000).map(|_| blind.push(1, Volts(f64::NAN))).last();
        let Some(SettleState::TimedOut(blind)) = verdict else {
            panic!("{verdict:?}");
        };
        assert!(blind.to_string().contains("gap-free"), "{blind}");
    }
}
