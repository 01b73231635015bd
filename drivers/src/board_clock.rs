//! The counter with which a board stamps what it sends, as a time that neither wraps nor goes back.

use palpate_model::Nanos;

/// An Arduino's resonator is right to half a percent; so much may its clock gain on the host's.
const FAST_MAX: f64 = 0.02;
/// Lines of an earlier moment may arrive in one go with that of now.
const AHEAD_MAX: Nanos = Nanos::from_millis(2_000);
/// The clocks are compared since the promptest stamp of the last span of this length, and since counting began: the one
/// finds a leap, for which a long time leaves room, the other a clock that is a little too fast.
const SPAN: Nanos = Nanos::from_millis(10_000);
/// Stamps that follow each other are less than half of the counter's range apart. A larger step is one back.
const STEP_MAX: u32 = u32::MAX / 2;

/// A board's time, with the host's at which it was known.
#[derive(Clone, Copy, Debug)]
struct ClockPair {
    time: Nanos,
    at: Nanos,
}

impl ClockPair {
    /// Whether another stamp is further ahead of the host's clock than both clocks allow.
    fn is_before(self, later: Self) -> bool {
        let run = later.time.since(self.time).0 as f64;
        let host = later.at.since(self.at).0 as f64;
        run > host * (1.0 + FAST_MAX) + AHEAD_MAX.0 as f64
    }

    /// Whether it was less late than another one.
    fn is_prompter(self, other: Self) -> bool {
        let lead = |pair: Self| i128::from(pair.time.0) - i128::from(pair.at.0);
        lead(self) > lead(other)
    }
}

#[derive(Clone, Copy, Debug)]
struct LastStamp {
    ticks: u32,
    /// Without wraps and restarts.
    pair: ClockPair,
    /// When counting began.
    first: ClockPair,
    /// The promptest of the span before, and of this one.
    prompt: ClockPair,
    promptest: ClockPair,
    span_began: Nanos,
}

impl LastStamp {
    const fn new(ticks: u32, pair: ClockPair) -> Self {
        let (first, prompt, promptest) = (pair, pair, pair);
        Self { ticks, pair, first, prompt, promptest, span_began: pair.at }
    }

    fn follow(&mut self, ticks: u32, pair: ClockPair) {
        (self.ticks, self.pair) = (ticks, pair);
        if pair.at.since(self.span_began) >= SPAN {
            self.prompt = self.promptest;
            (self.promptest, self.span_began) = (pair, pair.at);
        } else if pair.is_prompter(self.promptest) {
            self.promptest = pair;
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoardTime {
    /// A line that came twice.
    Repeated,
    /// The board's time.
    At(Nanos),
    /// The board's time, after a restart since the stamp before.
    Restarted(Nanos),
}

/// The clock of a board.
#[derive(Clone, Copy, Debug)]
pub struct BoardClock {
    nanos_per_tick: u64,
    last: Option<LastStamp>,
}

impl BoardClock {
    /// One of 32 bits.
    #[must_use]
    pub const fn new(nanos_per_tick: u64) -> Self {
        Self { nanos_per_tick, last: None }
    }

    /// Longest time between two stamps that does not count as a step back.
    #[must_use]
    pub const fn step_max(nanos_per_tick: u64) -> Nanos {
        Nanos(STEP_MAX as u64 * nanos_per_tick)
    }

    pub fn take(&mut self, now: Nanos, ticks: u32) -> BoardTime {
        let Some(last) = &mut self.last else {
            // The first count of the board is its time.
            let time = Nanos(u64::from(ticks) * self.nanos_per_tick);
            self.last = Some(LastStamp::new(ticks, ClockPair { time, at: now }));
            return BoardTime::At(time);
        };
        let step = ticks.wrapping_sub(last.ticks);
        if step == 0 {
            return BoardTime::Repeated;
        }
        let time = Nanos(last.pair.time.0 + u64::from(step) * self.nanos_per_tick);
        let pair = ClockPair { time, at: now };
        if step > STEP_MAX || last.first.is_before(pair) || last.prompt.is_before(pair) {
            return BoardTime::Restarted(self.restart(now, ticks));
        }
        last.follow(ticks, pair);
        BoardTime::At(time)
    }

    /// The board counts from the beginning; its time goes on by the host's clock.
    pub fn restart(&mut self, now: Nanos, ticks: u32) -> Nanos {
        let Some(last) = &mut self.last else {
            return Nanos::ZERO;
        };
        let time = Nanos(last.pair.time.0 + now.since(last.pair.at).0.max(1));
        *last = LastStamp::new(ticks, ClockPair { time, at: now });
        time
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::random::SplitMix;

    const MS: u64 = 1_000_000;

    /// A clock that has run for so long, with a stamp each 10 ms that takes up to 5 ms, and now and then 400 ms.
    fn run(nanos_per_tick: u64, seconds: u64, rate: f64) -> (BoardClock, Nanos, u32) {
        let mut clock = BoardClock::new(nanos_per_tick);
        let mut random = SplitMix::seeded(5);
        let (mut now, mut ticks) = (Nanos::ZERO, 0);
        for turn in 0..seconds * 100 {
            let taken = turn * 10 * MS;
            let late = random.below(5_000_000) as u64 + if turn % 500 == 7 { 400 * MS } else { 0 };
            now = now.max(Nanos(taken + late));
            ticks = ((taken as f64 * rate) as u64 / nanos_per_tick + 3) as u32;
            let found = clock.take(now, ticks);
            assert!(matches!(found, BoardTime::At(_)), "{turn}: {found:?}");
        }
        (clock, now, ticks)
    }

    fn is_restart(clock: &mut BoardClock, now: Nanos, ticks: u32) -> bool {
        matches!(clock.take(now, ticks), BoardTime::Restarted(_))
    }

    #[test]
    fn a_step_back_after_two_minutes_is_a_restart_whatever_its_ticks_are() {
        for nanos_per_tick in [1, 1_000] {
            let (mut clock, now, ticks) = run(nanos_per_tick, 130, 1.0);
            assert!(is_restart(&mut clock, Nanos(now.0 + 10 * MS), ticks.wrapping_sub(1_000)));
        }
    }

    #[test]
    fn a_leap_ahead_after_an_hour_is_a_restart() {
        let (mut clock, now, ticks) = run(1_000, 3_600, 1.0);
        let mut other = clock;
        // Since the promptest stamp of up to 20 s ago the clocks may be 2.4 s apart.
        assert!(is_restart(&mut clock, Nanos(now.0 + 10 * MS), ticks.wrapping_add(2_600_000)));
        assert!(!is_restart(&mut other, Nanos(now.0 + 10 * MS), ticks.wrapping_add(10_000)));
    }

    #[test]
    fn clocks_within_a_percent_are_followed_and_one_that_gains_three_is_noticed() {
        for rate in [0.99, 1.01] {
            run(1_000, 600, rate);
        }
        let mut clock = BoardClock::new(1_000);
        let noticed = (0..600_u32).find(|second| {
            let now = Nanos(u64::from(*second) * 1_000 * MS);
            is_restart(&mut clock, now, second * 1_030_000)
        });
        // A percent too much comes to 2 s within 200 s.
        assert!(noticed.is_some_and(|second| second <= 202), "{noticed:?}");
    }

    #[test]
    fn a_pause_of_the_link_longer_than_a_span_is_no_restart() {
        let (mut clock, now, ticks) = run(1_000, 60, 1.0);
        let late = Nanos(now.0 + 15_000 * MS);
        for stamp in 1..=1_500_u32 {
            assert!(!is_restart(&mut clock, late, ticks + stamp * 10_000), "{stamp}");
        }
        for stamp in 1_501..=4_000_u32 {
            let at = Nanos(now.0 + u64::from(stamp) * 10 * MS);
            assert!(!is_restart(&mut clock, at, ticks + stamp * 10_000), "{stamp}");
        }
    }
}
