//! How much a sidecar may send: a flood would keep the thread busy that writes stops, and fill what waits for the owner.

use super::protocol::LINE_MAX;
use palpate_model::Nanos;

/// So many times the promised samples are a flood.
const FLOOD: f64 = 2.0;
/// The slowest sidecar may say so many lines a second: faults, and answers to lines that noise has cut.
const LINES_MIN: f64 = 10.0;
/// So much may come at once after a link has kept it back: half a second of samples, and some.
const FLOOD_SECONDS: f64 = 0.5;
const FLOOD_MORE: f64 = 50.0;
/// A pause up to here is within that; what a longer one has held back is allowed for, to a bound: no buffer of an
/// operating system has more than some seconds of samples.
const PAUSE_MIN: Nanos = Nanos::from_millis(250);
const PAUSE_MAX_S: f64 = 10.0;
/// Faults that are reported within a second; further ones stop the axis, but are not listed.
const FAULTS_MAX: u32 = 10;
const FAULTS_SPAN: Nanos = Nanos::from_millis(1_000);

/// A bucket that empties by itself. It is full where too much has come for too long.
#[derive(Clone, Copy, Debug)]
struct Bucket {
    /// What is in it; below zero after a pause.
    excess: f64,
    most: f64,
    per_second: f64,
    at: Nanos,
}

impl Bucket {
    const fn new(per_second: f64, most: f64, now: Nanos) -> Self {
        Self { excess: 0.0, most, per_second, at: now }
    }

    fn take(&mut self, now: Nanos, amount: f64) {
        let drained = self.per_second * now.since(self.at).seconds().0;
        self.at = now;
        // What is below zero is kept for what a pause has held back.
        self.excess = (self.excess - drained).max(self.excess.min(0.0)) + amount;
    }

    fn is_full(&self) -> bool {
        self.excess > self.most
    }
}

/// Lines, frames and bytes of one link.
#[derive(Clone, Copy, Debug)]
pub struct LinkBudget {
    rate: f64,
    items: Bucket,
    bytes: Bucket,
}

impl LinkBudget {
    /// Of a sidecar with so many samples a second.
    #[must_use]
    pub fn new(rate: f64, now: Nanos) -> Self {
        let per_second = (FLOOD * rate).max(LINES_MIN);
        let most = FLOOD_SECONDS * rate + FLOOD_MORE;
        let longest = LINE_MAX as f64;
        Self {
            rate,
            items: Bucket::new(per_second, most, now),
            bytes: Bucket::new(per_second * longest, most * longest, now),
        }
    }

    /// A line of the host is answered by one of the sidecar.
    pub fn note_written(&mut self) {
        self.items.excess = (self.items.excess - 1.0).max(self.items.excess.min(0.0));
    }

    /// Bytes that came at once, before their lines.
    pub fn take_bytes(&mut self, now: Nanos, count: usize) {
        if count > 0 {
            self.allow_pause(now.since(self.bytes.at));
            self.bytes.take(now, count as f64);
        }
    }

    /// A line or a frame, also a garbled one.
    pub fn take_item(&mut self, now: Nanos) {
        self.items.take(now, 1.0);
    }

    /// Nothing came for so long, such as while this computer stood still: what was sent meanwhile comes at once.
    fn allow_pause(&mut self, pause: Nanos) {
        if pause > PAUSE_MIN {
            let held_back = self.rate * pause.seconds().0;
            let longest = LINE_MAX as f64;
            for (bucket, unit) in [(&mut self.items, 1.0), (&mut self.bytes, longest)] {
                let least = -PAUSE_MAX_S * self.rate * unit;
                bucket.excess = (bucket.excess - held_back * unit).max(least);
            }
        }
    }

    pub fn is_exceeded(&self) -> bool {
        self.items.is_full() || self.bytes.is_full()
    }
}

/// How many faults are reported to the rig's owner.
#[derive(Clone, Copy, Debug, Default)]
pub struct FaultLimit {
    since: Nanos,
    count: u32,
}

impl FaultLimit {
    /// Whether one more may be reported now.
    pub fn allows(&mut self, now: Nanos) -> bool {
        if self.count == 0 || now.since(self.since) >= FAULTS_SPAN {
            *self = Self { since: now, count: 0 };
        }
        self.count += 1;
        self.count <= FAULTS_MAX
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> Nanos {
        Nanos::from_millis(ms)
    }

    /// When so many lines of so many bytes each millisecond are too many, within ten seconds.
    fn ends_at(rate: f64, lines: usize, bytes: usize) -> Option<u64> {
        let mut budget = LinkBudget::new(rate, ms(0));
        (1..10_000).find(|at| {
            budget.take_bytes(ms(*at), lines.max(1) * bytes);
            (0..lines).for_each(|_| budget.take_item(ms(*at)));
            budget.is_exceeded()
        })
    }

    #[test]
    fn what_was_promised_is_allowed_for_good_and_three_times_that_is_not() {
        assert_eq!(ends_at(1_000.0, 1, 1_500), None);
        // 2000 too many a second fill the room of 550 lines.
        assert_eq!(ends_at(1_000.0, 4, 80).map(|at| at / 25), Some(11));
        assert!(ends_at(10.0, 10, 80).is_some_and(|at| at < 20));
        // Bytes without an end of a line.
        assert!(ends_at(10.0, 0, 10_000).is_some_and(|at| at < 20));
    }

    #[test]
    fn a_pause_lets_come_what_it_has_held_back_and_no_more() {
        let mut budget = LinkBudget::new(1_000.0, ms(0));
        budget.take_bytes(ms(3_000), 4_096);
        (0..3_000).for_each(|_| budget.take_item(ms(3_000)));
        assert!(!budget.is_exceeded());
        (0..1_000).for_each(|_| budget.take_item(ms(3_001)));
        assert!(budget.is_exceeded());
        // Short pauses without end save up nothing, and long ones no more than ten seconds.
        for pause in [20, 3_600_000] {
            let mut budget = LinkBudget::new(100.0, ms(0));
            (1..1_000).for_each(|turn| budget.take_bytes(ms(turn * pause), 1));
            (0..1_200).for_each(|_| budget.take_item(ms(1_000 * pause)));
            assert!(budget.is_exceeded(), "{pause}");
        }
    }

    #[test]
    fn ten_faults_are_reported_within_a_second() {
        let mut limit = FaultLimit::default();
        let count = (0..3_000).filter(|at| limit.allows(ms(*at))).count();
        assert_eq!(count, 30);
    }
}
