//! The sample clock: `TM` and `TIME`.

use palpate_model::{Nanos, Seconds};

/// True length in ns of what `TM` calls a microsecond. `TM 1000` "will actually set an update rate of 976
/// microseconds" (DMC-18x2 command reference, `TIME`): 1024 samples a second, for then the resolutions of speed and
/// acceleration, 2 counts/s and 1024 counts/s^2, are whole binary fractions of a count per sample.
const NANOS_PER_TM: f64 = 1e9 / 1024.0 / 1000.0;

/// When samples are taken, and how many there have been.
#[derive(Clone, Debug)]
pub struct SampleClock {
    tm: f64,
    /// True ns per nominal ns, for a crystal that is off.
    stretch: f64,
    /// Time at which the period was set, and samples since.
    base: Nanos,
    since_base: u64,
    count: u64,
}

impl SampleClock {
    /// A clock that starts now, its crystal fast by so many parts in a million.
    pub fn new(now: Nanos, ppm: f64) -> Self {
        Self { tm: 1000.0, stretch: 1.0 / (1.0 + 1e-6 * ppm), base: now, since_base: 0, count: 0 }
    }

    /// `TM`.
    pub fn tm(&self) -> f64 {
        self.tm
    }

    /// `TIME`: samples since the reset.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Sets `TM`; not positive stops the samples.
    pub fn set_tm(&mut self, now: Nanos, tm: f64) {
        self.tm = tm.max(0.0);
        self.base = now;
        self.since_base = 0;
    }

    /// True length of a sample.
    pub fn period(&self) -> Seconds {
        Seconds(self.tm * NANOS_PER_TM * 1e-9 * self.stretch)
    }

    /// The length of a sample in the controller's own seconds, in which speeds are set.
    pub fn nominal_period(&self) -> f64 {
        self.tm * NANOS_PER_TM * 1e-9
    }

    /// Time of the next sample; `None` while there are none.
    pub fn next_at(&self) -> Option<Nanos> {
        (self.tm > 0.0).then(|| {
            // Below 2^53 ns, 104 days, the product is exact to a ns.
            let since = (self.since_base + 1) as f64 * self.tm * NANOS_PER_TM * self.stretch;
            self.base + Nanos(since.round() as u64)
        })
    }

    pub fn advance(&mut self) {
        self.since_base += 1;
        self.count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thousand_is_976_microseconds() {
        let mut clock = SampleClock::new(Nanos(5), 0.0);
        for _ in 0..1024 {
            clock.advance();
        }
        assert_eq!(clock.next_at(), Some(Nanos(1_000_976_568)));
        assert_eq!((clock.period().0 * 1e6).trunc(), 976.0);
        clock.set_tm(Nanos(7), 500.0);
        assert_eq!(clock.next_at(), Some(Nanos(488_288)));
        assert_eq!(clock.count(), 1024);
        clock.set_tm(Nanos(7), 0.0);
        assert_eq!(clock.next_at(), None);
    }

    #[test]
    fn a_fast_crystal_gains() {
        let mut clock = SampleClock::new(Nanos(0), 100.0);
        while clock.next_at().unwrap() <= Nanos(100_000_000_000) {
            clock.advance();
        }
        // 102400 samples in 100 s, and ten more.
        assert_eq!(clock.count(), 102_410);
    }
}
