//! The counter with which a board stamps what it sends, as a time that neither wraps nor goes back.

use palpate_model::Nanos;

/// An Arduino's resonator is right to half a percent; so much may its clock gain on the host's.
const FAST_MAX: f64 = 0.02;
/// Lines of an earlier moment may arrive in one go with that of now.
const AHEAD_MAX: Nanos = Nanos::from_millis(2_000);

#[derive(Clone, Copy, Debug)]
struct LastStamp {
    ticks: u32,
    /// Time without wraps and restarts.
    time: Nanos,
    at: Nanos,
    /// Board's time and host's when counting began.
    from: (Nanos, Nanos),
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

    pub fn take(&mut self, now: Nanos, ticks: u32) -> BoardTime {
        let Some(last) = self.last else {
            // The first count of the board is its time.
            let time = Nanos(u64::from(ticks) * self.nanos_per_tick);
            self.last = Some(LastStamp { ticks, time, at: now, from: (time, now) });
            return BoardTime::At(time);
        };
        let step = ticks.wrapping_sub(last.ticks);
        if step == 0 {
            return BoardTime::Repeated;
        }
        let time = Nanos(last.time.0 + u64::from(step) * self.nanos_per_tick);
        let run = time.since(last.from.0).0 as f64;
        let host = now.since(last.from.1).0 as f64;
        if run > host * (1.0 + FAST_MAX) + AHEAD_MAX.0 as f64 {
            return BoardTime::Restarted(self.restart(now, ticks));
        }
        self.last = Some(LastStamp { ticks, time, at: now, ..last });
        BoardTime::At(time)
    }

    /// The board counts from the beginning; its time goes on by the host's clock.
    pub fn restart(&mut self, now: Nanos, ticks: u32) -> Nanos {
        let Some(last) = &mut self.last else {
            return Nanos::ZERO;
        };
        let time = Nanos(last.time.0 + now.since(last.at).0.max(1));
        *last = LastStamp { ticks, time, at: now, from: (time, now) };
        time
    }
}
