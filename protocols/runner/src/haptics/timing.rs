//! Durations that one thread counts and others read, without a lock.

use palpate_model::units::Seconds;
use serde::Serialize;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bits of a duration within its octave: 128 steps, so a bin is at most 0.8 % wide.
const STEP_BITS: u32 = 7;
const STEPS: u64 = 1 << STEP_BITS;
/// Bins for every duration that 64 bits of nanoseconds hold.
const BINS: usize = ((64 - STEP_BITS) as usize + 1) * STEPS as usize;

/// One thread counts; readers may miss the newest counts.
#[derive(Debug)]
pub struct DurationHistogram {
    bins: Box<[AtomicU64]>,
    longest: AtomicU64,
}

impl Default for DurationHistogram {
    fn default() -> Self {
        Self { bins: (0..BINS).map(|_| AtomicU64::new(0)).collect(), longest: AtomicU64::new(0) }
    }
}

fn bin(nanos: u64) -> usize {
    let octave = u64::from(nanos.max(1).ilog2());
    if octave < u64::from(STEP_BITS) {
        return nanos as usize;
    }
    let shift = octave - u64::from(STEP_BITS);
    (shift * STEPS + (nanos >> shift)) as usize
}

/// The longest duration of a bin.
fn end(bin: usize) -> u64 {
    let bin = bin as u64;
    if bin < 2 * STEPS {
        return bin;
    }
    let shift = bin / STEPS - 1;
    let step = bin - shift * STEPS;
    (step << shift) | ((1 << shift) - 1)
}

impl DurationHistogram {
    /// Counts one. Neither allocates nor waits.
    pub fn count(&self, nanos: u64) {
        self.bins[bin(nanos)].fetch_add(1, Ordering::Relaxed);
        self.longest.fetch_max(nanos, Ordering::Relaxed);
    }

    pub fn spread(&self) -> DurationPercentiles {
        let counts: Vec<u64> = self.bins.iter().map(|one| one.load(Ordering::Relaxed)).collect();
        let count: u64 = counts.iter().sum();
        let longest = self.longest.load(Ordering::Relaxed);
        let at = |share: f64| {
            // The first duration that is not exceeded by more than the rest.
            let wanted = (share * count as f64).ceil().max(1.0) as u64;
            let mut below = 0;
            for (bin, count) in counts.iter().enumerate() {
                below += count;
                if below >= wanted {
                    return seconds(end(bin).min(longest));
                }
            }
            seconds(longest)
        };
        DurationPercentiles {
            count,
            p50: at(0.5),
            p99: at(0.99),
            p99_9: at(0.999),
            max: seconds(longest),
        }
    }
}

fn seconds(nanos: u64) -> Seconds {
    Seconds(nanos as f64 * 1e-9)
}

/// Percentiles of durations: the longest exactly, the others rounded up by at most 0.8 %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DurationPercentiles {
    pub count: u64,
    #[serde(rename = "p50_s")]
    pub p50: Seconds,
    #[serde(rename = "p99_s")]
    pub p99: Seconds,
    #[serde(rename = "p99_9_s")]
    pub p99_9: Seconds,
    /// None is longer.
    #[serde(rename = "max_s")]
    pub max: Seconds,
}

#[derive(Debug, Default)]
pub struct LoopCounters {
    /// From one tick's begin to the next one's.
    pub period: DurationHistogram,
    /// From when a tick was due to its begin.
    pub late: DurationHistogram,
    /// From a tick's begin to its end.
    pub work: DurationHistogram,
    pub overruns: AtomicU64,
    pub missed: AtomicU64,
}

/// [`LoopCounters`] as it was at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LoopTiming {
    /// From one tick's begin to the next one's.
    pub period: DurationPercentiles,
    /// From when a tick was due to its begin.
    pub late: DurationPercentiles,
    /// From a tick's begin to its end.
    pub work: DurationPercentiles,
    pub overruns: u64,
    pub missed: u64,
}

impl LoopCounters {
    pub fn snapshot(&self) -> LoopTiming {
        LoopTiming {
            period: self.period.spread(),
            late: self.late.spread(),
            work: self.work.spread(),
            overruns: self.overruns.load(Ordering::Relaxed),
            missed: self.missed.load(Ordering::Relaxed),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{BINS, DurationHistogram, bin, end};

    #[test]
    fn every_duration_has_a_bin_whose_end_is_no_more_than_a_hundredth_above() {
        let mut of = vec![0, 1, 31, 32, 33, 63, 64, 65, u64::MAX - 1, u64::MAX];
        of.extend((0..64).flat_map(|bit| [1_u64 << bit, (1_u64 << bit) - 1, 3_u64 << (bit / 2)]));
        for nanos in of {
            let bin = bin(nanos);
            assert!(bin < BINS, "{nanos}");
            let end = end(bin);
            assert!(end >= nanos, "{nanos} {end}");
            assert!(end - nanos <= nanos / 128, "{nanos} {end}");
        }
        for one in 1..BINS {
            assert_eq!(bin(end(one)), one);
            assert_eq!(bin(end(one - 1) + 1), one);
        }
    }

    #[test]
    fn percentiles_are_those_of_the_sorted_durations() {
        let durations = DurationHistogram::default();
        assert_eq!(durations.spread().max.0, 0.0);
        let all: Vec<u64> = (1..=100_000).map(|i| i * i % 999_983).collect();
        all.iter().for_each(|&nanos| durations.count(nanos));
        let mut sorted = all;
        sorted.sort_unstable();
        let spread = durations.spread();
        assert_eq!(spread.count, 100_000);
        for (share, found) in [(0.5, spread.p50), (0.99, spread.p99), (0.999, spread.p99_9)] {
            let right = sorted[(share * 1e5) as usize - 1] as f64 * 1e-9;
            assert!(found.0 >= right && found.0 <= right * 1.01, "{share} {found:?} {right}");
        }
        assert_eq!(spread.max.0, sorted[99_999] as f64 * 1e-9);
    }
}
