//! The time of the caller that asks a rig for events, mapped to the host's clock.

use super::HostClock;
use palpate_model::Nanos;

/// The caller's time may fall behind the host's clock by so much before it counts as given up: the runner does not
/// catch up a quarter of a second.
const BEHIND_MAX: Nanos = Nanos::from_millis(250);

/// The caller's zero on the host's clock, and the newest time that was reported.
pub struct CallerTime {
    clock: HostClock,
    /// `None` before the first call.
    origin: Option<Nanos>,
    newest: Nanos,
}

impl CallerTime {
    #[must_use]
    pub const fn new(clock: HostClock) -> Self {
        Self { clock, origin: None, newest: Nanos::ZERO }
    }

    /// The caller asks for what comes until a time of its own: the host's time now, and of that end.
    pub fn window(&mut self, until: Nanos) -> (Nanos, Nanos) {
        let now = (self.clock)();
        let begun = Nanos(now.0.saturating_sub(until.0));
        // A caller whose time stood still, as while the computer slept, gets a new origin.
        let origin = match self.origin {
            Some(origin) if now.since(origin).since(until) <= BEHIND_MAX => origin,
            _ => begun,
        };
        self.origin = Some(origin);
        (now, origin + until)
    }

    /// The caller's time of an event on the host's clock; never before an earlier event.
    pub fn event_time(&mut self, at: Nanos, until: Nanos) -> Nanos {
        let origin = self.origin.unwrap_or(at);
        self.newest = at.since(origin).max(self.newest).min(until);
        self.newest
    }

    /// The caller's time of bytes that were exchanged, in any order.
    pub fn caller_time(&self, at: Nanos) -> Nanos {
        at.since(self.origin.unwrap_or(Nanos::ZERO))
    }
}
