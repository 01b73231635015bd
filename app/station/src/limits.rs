//! Bounds on what the network may ask for: a bucket of tokens for every address, with a bounded number of addresses.

use std::collections::HashMap;
use std::hash::Hash;
use std::time::Duration;

/// Addresses that are remembered; a full table forgets whoever has been silent longest.
const KEYS_MAX: usize = 1024;

/// So many requests at once, and so many a second after that.
#[derive(Clone, Copy, Debug)]
pub struct Rate {
    pub burst: f64,
    pub per_second: f64,
}

#[derive(Clone, Copy, Debug)]
struct Bucket {
    left: f64,
    /// Time of the last request, since the table was made.
    at: Duration,
}

/// A limit of requests for each key.
#[derive(Debug)]
pub struct RateLimit<K> {
    rate: Rate,
    buckets: HashMap<K, Bucket>,
}

impl<K: Copy + Eq + Hash> RateLimit<K> {
    #[must_use]
    pub fn new(rate: Rate) -> Self {
        Self { rate, buckets: HashMap::new() }
    }

    /// Whether a request at this time is allowed.
    pub fn take(&mut self, key: K, now: Duration) -> bool {
        if self.buckets.len() >= KEYS_MAX && !self.buckets.contains_key(&key) {
            self.forget_oldest();
        }
        let full = Bucket { left: self.rate.burst, at: now };
        let bucket = self.buckets.entry(key).or_insert(full);
        let passed = now.saturating_sub(bucket.at).as_secs_f64();
        bucket.left = (bucket.left + passed * self.rate.per_second).min(self.rate.burst);
        bucket.at = now;
        let is_allowed = bucket.left >= 1.0;
        if is_allowed {
            bucket.left -= 1.0;
        }
        is_allowed
    }

    fn forget_oldest(&mut self) {
        let oldest = self.buckets.iter().min_by_key(|(_, bucket)| bucket.at);
        if let Some(key) = oldest.map(|(key, _)| *key) {
            self.buckets.remove(&key);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_passes_and_then_the_rate() {
        let mut limit = RateLimit::new(Rate { burst: 5.0, per_second: 2.0 });
        let at = Duration::from_millis;
        let taken = |limit: &mut RateLimit<u32>, key, from: u64, to: u64| {
            (from..to).filter(|ms| limit.take(key, at(*ms))).count()
        };
        // 10 s of a request every millisecond: the burst, and two a second.
        assert_eq!(taken(&mut limit, 1, 0, 10_000), 5 + 19);
        assert_eq!(taken(&mut limit, 2, 10_000, 10_003), 3, "another address has its own");
        // A clock that stands still gives nothing, and one that runs back is no error.
        assert!(!limit.take(1, at(0)));
    }

    #[test]
    fn addresses_are_bounded() {
        let mut limit = RateLimit::new(Rate { burst: 1.0, per_second: 1.0 });
        for key in 0..10 * KEYS_MAX as u64 {
            assert!(limit.take(key, Duration::from_millis(key)));
        }
        assert_eq!(limit.buckets.len(), KEYS_MAX);
    }
}
