//! The only place that reads a clock: pacing of virtual time against the wall.
#![expect(clippy::disallowed_methods, reason = "this file is the clock")]

use super::snapshot::Lateness;
use palpate_model::Nanos;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError};
use std::time::{Duration, Instant, SystemTime};

/// How fast simulated time runs against the wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeScale {
    /// This many session seconds per second.
    Factor(f64),
    Max,
}

impl FromStr for TimeScale {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "max" {
            return Ok(Self::Max);
        }
        match text.parse::<f64>() {
            // Below a thousandth nothing seems to happen; above a million use `max`.
            Ok(factor) if (1e-3..=1e6).contains(&factor) => Ok(Self::Factor(factor)),
            _ => Err(format!(
                "'{text}' is not a time scale; give a number from 0.001 to 1000000, or max"
            )),
        }
    }
}

impl fmt::Display for TimeScale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Factor(factor) => write!(f, "{factor}"),
            Self::Max => f.write_str("max"),
        }
    }
}

pub(super) enum Wake<T> {
    Time,
    /// A request came; session time has reached this.
    Request(T, Nanos),
    Disconnected,
}

/// Session time this far behind the wall is not caught up: after a computer was suspended, or a debugger had stopped it,
/// nothing should race.
const BEHIND_MAX: Duration = Duration::from_millis(250);

/// Maps session time to wall time and sleeps the difference.
pub(super) struct Pacer {
    scale: TimeScale,
    wall_anchor: Instant,
    time_anchor: Nanos,
    lateness: Lateness,
    behind: Duration,
}

impl Pacer {
    pub fn new(scale: TimeScale, now: Nanos) -> Self {
        Self {
            scale,
            wall_anchor: Instant::now(),
            time_anchor: now,
            lateness: Lateness::default(),
            behind: Duration::ZERO,
        }
    }

    /// Waits until session time `at`, or until a request arrives.
    pub fn wait<T>(&mut self, at: Nanos, requests: &Receiver<T>) -> Wake<T> {
        let TimeScale::Factor(factor) = self.scale else {
            return match requests.try_recv() {
                Ok(request) => Wake::Request(request, at),
                Err(TryRecvError::Empty) => Wake::Time,
                Err(TryRecvError::Disconnected) => Wake::Disconnected,
            };
        };
        let due = Duration::from_secs_f64(at.since(self.time_anchor).seconds().0 / factor);
        let remaining = due.saturating_sub(self.wall_anchor.elapsed());
        let wake = match requests.recv_timeout(remaining) {
            Ok(request) => Wake::Request(request, self.now().min(at)),
            Err(RecvTimeoutError::Timeout) => Wake::Time,
            Err(RecvTimeoutError::Disconnected) => Wake::Disconnected,
        };
        self.behind = self.wall_anchor.elapsed().saturating_sub(due);
        let behind_s = self.behind.as_secs_f64();
        self.lateness.worst.0 = self.lateness.worst.0.max(behind_s);
        if self.behind > BEHIND_MAX {
            self.lateness.given_up.0 += behind_s;
            (self.wall_anchor, self.time_anchor) = (Instant::now(), at);
        }
        wake
    }

    /// How much too late the last wait ended, earlier delays included; each delay counts once.
    pub fn behind(&self) -> Duration {
        self.behind
    }

    /// How far session time was behind the wall; `None` at full pace.
    pub fn lateness(&self) -> Option<Lateness> {
        (self.scale != TimeScale::Max).then_some(self.lateness)
    }

    fn now(&self) -> Nanos {
        let TimeScale::Factor(factor) = self.scale else {
            return self.time_anchor;
        };
        let passed = self.wall_anchor.elapsed().as_nanos() as f64 * factor;
        self.time_anchor + Nanos(passed as u64)
    }
}

/// Lets something happen at most once per interval of wall time.
pub(super) struct Throttle {
    interval: Duration,
    last: Option<Instant>,
}

impl Throttle {
    pub fn new(interval: Duration) -> Self {
        Self { interval, last: None }
    }

    pub fn is_due(&mut self) -> bool {
        let now = Instant::now();
        let is_due = self.last.is_none_or(|last| now - last >= self.interval);
        if is_due {
            self.last = Some(now);
        }
        is_due
    }
}

/// The computer's clocks at one moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct HostTimes {
    pub wall: SystemTime,
    /// Since some moment, without the time in which the computer was suspended; it cannot be set.
    pub awake: Duration,
    pub all: Duration,
}

/// Reads the computer's clocks.
pub(super) type HostClock = Arc<dyn Fn() -> HostTimes + Send + Sync>;

/// One clock, which counts suspended time on Windows: a suspension is only noticed by a loop that is late.
#[cfg(not(target_os = "linux"))]
pub(super) fn host_times() -> HostTimes {
    static START: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);
    let all = START.elapsed();
    HostTimes { wall: SystemTime::now(), awake: all, all }
}

/// The clocks of the system (clock_gettime(2)).
#[cfg(target_os = "linux")]
pub(super) fn host_times() -> HostTimes {
    use rustix::time::{ClockId, clock_gettime};
    let read = |id| {
        let time = clock_gettime(id);
        let secs = u64::try_from(time.tv_sec).unwrap_or(0);
        Duration::new(secs, u32::try_from(time.tv_nsec).unwrap_or(0))
    };
    let (awake, all) = (read(ClockId::Monotonic), read(ClockId::Boottime));
    HostTimes { wall: SystemTime::now(), awake, all }
}

/// The wall clock, to date what is recorded.
#[must_use]
pub fn wall_now() -> SystemTime {
    SystemTime::now()
}

/// The computer's monotonic clock, from now on, for drivers: they are handed one and never read a clock by themselves.
#[must_use]
pub fn driver_clock() -> palpate_drivers::wire::HostClock {
    let start = Instant::now();
    Arc::new(move || Nanos(start.elapsed().as_nanos() as u64))
}

/// Measures how long something took, and paces haptic loops.
#[derive(Debug)]
pub struct Stopwatch(Instant);

impl Stopwatch {
    #[must_use]
    pub fn start() -> Self {
        Self(Instant::now())
    }

    pub fn seconds(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }

    #[cfg(feature = "haptics")]
    pub(crate) fn nanos(&self) -> u64 {
        self.0.elapsed().as_nanos() as u64
    }

    /// Sleeps until so many nanoseconds since the start.
    #[cfg(feature = "haptics")]
    pub(crate) fn wait_until(&self, nanos: u64) {
        std::thread::sleep(Duration::from_nanos(nanos).saturating_sub(self.0.elapsed()));
    }
}
