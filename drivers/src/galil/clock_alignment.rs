//! The time at which the controller took a sample, on the host's clock.
//!
//! A question that was written at one time and answered at another was evaluated in between. The narrowest of these
//! spans shows best how the controller's clock lies to the host's; the two may drift apart meanwhile.

use palpate_model::Nanos;

/// Quartz of a controller and of a computer: a hundred parts in a million each at most. Not confirmed for any board.
const DRIFT: f64 = 2e-4;

/// The offset of the controller's clock from the host's.
#[derive(Clone, Copy, Debug, Default)]
pub struct ClockAlignment {
    best: Option<Span>,
    /// Largest distance of the middle of a question from the time by the controller's clock.
    pub deviation_max: Nanos,
}

#[derive(Clone, Copy, Debug)]
struct Span {
    tick: u64,
    sent: Nanos,
    answered: Nanos,
}

impl Span {
    fn middle(&self) -> f64 {
        0.5 * (self.sent.0 as f64 + self.answered.0 as f64)
    }

    /// Half its length, and what the clocks may have drifted until a time.
    fn uncertainty(&self, at: Nanos) -> f64 {
        let half = 0.5 * (self.answered.0 as f64 - self.sent.0 as f64);
        half + DRIFT * at.since(self.answered).0 as f64
    }
}

impl ClockAlignment {
    /// Takes a question's times and the tick of its answer, for ticks of a length.
    pub fn push(&mut self, tick: u64, length: Nanos, sent: Nanos, answered: Nanos) {
        let span = Span { tick, sent, answered };
        if let Some(at) = self.host_time(tick, length) {
            let off = (span.middle() - at.0 as f64).abs();
            self.deviation_max = self.deviation_max.max(Nanos(off.round() as u64));
        }
        let is_better = |best: Span| span.uncertainty(answered) <= best.uncertainty(answered);
        if self.best.is_none_or(is_better) {
            self.best = Some(span);
        }
    }

    /// Time of a tick on the host's clock, for a tick of this length.
    pub fn host_time(&self, tick: u64, length: Nanos) -> Option<Nanos> {
        let best = self.best?;
        let since = tick as f64 - best.tick as f64;
        let at = best.middle() + since * length.0 as f64;
        Some(Nanos(at.max(0.0).round() as u64))
    }

    /// Largest error of [`ClockAlignment::host_time`] at a time: a question's half round trip, drift, and the sample
    /// itself, in which the controller answers.
    pub fn uncertainty(&self, at: Nanos, length: Nanos) -> Option<Nanos> {
        let best = self.best?;
        Some(Nanos((best.uncertainty(at) + length.0 as f64).round() as u64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_narrowest_span_counts_until_drift_has_made_it_wider() {
        let tick = Nanos(1_000_000);
        let mut timing = ClockAlignment::default();
        timing.push(10, tick, Nanos(10_000_000), Nanos(10_400_000));
        timing.push(20, tick, Nanos(19_000_000), Nanos(22_000_000));
        assert_eq!(timing.host_time(20, tick), Some(Nanos(20_200_000)));
        assert_eq!(timing.uncertainty(Nanos(10_400_000), tick), Some(Nanos(1_200_000)));
        // The middle of the second one is 0.3 ms late.
        assert_eq!(timing.deviation_max, Nanos(300_000));
        // 5 s later the first one is uncertain by 0.2 and 1 ms.
        timing.push(5_010, tick, Nanos(5_010_000_000), Nanos(5_012_000_000));
        assert_eq!(timing.host_time(5_010, tick), Some(Nanos(5_011_000_000)));
    }
}
