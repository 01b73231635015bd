//! When things happen: controller ticks on one side of the link, arrivals on the other.

use super::random::{Random, RandomStream};
use palpate_model::Nanos;

/// Time a command needs to reach the controller: some tens of characters on a fast link.
pub const COMMAND_LATENCY: Nanos = Nanos(500_000);

/// Shortest time a report needs to reach the host.
pub const REPORT_LATENCY: Nanos = Nanos(1_000_000);

/// A report needs up to this much longer than [`REPORT_LATENCY`].
pub const REPORT_JITTER: Nanos = Nanos(500_000);

/// The controller's sample clock: one tick after the other, at true times.
#[derive(Clone, Debug)]
pub struct TickClock {
    count: u64,
    at: Nanos,
    tick: Nanos,
}

impl TickClock {
    /// A clock whose first tick is at time zero and carries the number `count`.
    pub fn new(count: u64, tick_nanos: u64) -> Self {
        Self { count, at: Nanos::ZERO, tick: Nanos(tick_nanos) }
    }

    /// True time of the next tick.
    pub fn next_at(&self) -> Nanos {
        self.at
    }

    /// Takes the next tick and returns its number and true time.
    pub fn advance(&mut self) -> (u64, Nanos) {
        let now = (self.count, self.at);
        self.count += 1;
        self.at = self.at + self.tick;
        now
    }
}

/// The way from the controller to the host: a delay that varies, and never swaps two reports.
#[derive(Clone, Debug)]
pub struct ReportLink {
    random: Random,
    newest: Option<Nanos>,
}

impl ReportLink {
    pub fn new(seed: u64, repeat: u64) -> Self {
        Self { random: Random::of_repeat(seed, repeat, RandomStream::Link), newest: None }
    }

    /// Arrival at the host of a report sent at `sent`, later than every arrival before it.
    pub fn arrival(&mut self, sent: Nanos) -> Nanos {
        let jitter = Nanos((self.random.unit() * REPORT_JITTER.0 as f64) as u64);
        let arrival = sent + REPORT_LATENCY + jitter;
        let arrival = match self.newest {
            Some(newest) if arrival <= newest => newest + Nanos(1),
            _ => arrival,
        };
        self.newest = Some(arrival);
        arrival
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrivals_keep_their_order_and_bounds() {
        let mut link = ReportLink::new(3, 0);
        let mut before = Nanos::ZERO;
        let mut longest = 0;
        for i in 0..10_000 {
            // Two reports at every instant, as an acknowledgement and a sample are.
            let sent = Nanos(i / 2 * 976_000);
            let arrival = link.arrival(sent);
            assert!(arrival > before);
            let delay = arrival.since(sent).0;
            assert!((REPORT_LATENCY.0..=REPORT_LATENCY.0 + REPORT_JITTER.0 + 1).contains(&delay));
            longest = longest.max(delay);
            before = arrival;
        }
        // The jitter is really used.
        assert!(longest > REPORT_LATENCY.0 + REPORT_JITTER.0 / 10 * 9);
    }

    #[test]
    fn ticks_have_equal_distances() {
        let mut clock = TickClock::new(40, 976_000);
        assert_eq!(clock.advance(), (40, Nanos(0)));
        assert_eq!(clock.advance(), (41, Nanos(976_000)));
        assert_eq!(clock.next_at(), Nanos(1_952_000));
    }
}
