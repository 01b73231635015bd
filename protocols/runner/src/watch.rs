//! How the computer keeps up with a run and what its clocks do, told in the log once a second. No decision is
//! made of it but one: when the computer stood still, the run ends.

use super::clock::{HostClock, HostTimes};
use palpate_model::Nanos;
use palpate_model::units::Seconds;
use palpate_sessions::health::{Told, Why};
use palpate_sessions::{Health, MachineState};
use std::time::{Duration, SystemTime};

/// The state is told this often.
const EVERY: Duration = Duration::from_secs(1);
/// A wall clock that went further apart from the monotonic one than that was set, and a computer that answered
/// nothing for longer stood still: far above what a busy scheduler does, far below what a person notices late.
const APART: Duration = Duration::from_millis(500);

pub(super) struct HostWatch {
    clock: HostClock,
    /// Whether nobody but this computer watches the rig, whose time goes on without it.
    is_wired: bool,
    anchor: HostTimes,
    /// The time that was spent suspended before.
    asleep: Duration,
    told: Duration,
    lateness: Duration,
    missed: u64,
}

impl HostWatch {
    /// Watches from now on.
    pub fn new(clock: HostClock, is_wired: bool) -> Self {
        let times = clock();
        Self {
            clock,
            is_wired,
            anchor: times,
            asleep: times.all.saturating_sub(times.awake),
            told: times.awake,
            lateness: Duration::ZERO,
            missed: 0,
        }
    }

    /// The anchor that a session begins with.
    pub fn begin(&self) -> Health {
        anchor(Nanos::ZERO, Why::Start, self.anchor.wall, 0.0)
    }

    /// One turn of the loop, that much later than it should have been: what is to be told of the clocks, and for
    /// how long the computer stood still, if it did.
    pub fn turn(&mut self, now: Nanos, lateness: Duration) -> (Option<Health>, Option<Seconds>) {
        self.lateness = self.lateness.max(lateness);
        let times = (self.clock)();
        let shift_s = self.shift_s(&times);
        let jump = (shift_s.abs() > APART.as_secs_f64()).then(|| {
            self.anchor = times;
            anchor(now, Why::Jump, times.wall, shift_s)
        });
        let asleep = times.all.saturating_sub(times.awake);
        let slept = asleep.saturating_sub(std::mem::replace(&mut self.asleep, asleep));
        // The time of a simulated rig waits for a computer that is late, but not even that sleeps unseen.
        let stood = match self.is_wired {
            true => slept + lateness,
            false => slept,
        };
        let stood = (stood > APART).then_some(Seconds(stood.as_secs_f64()));
        (jump, stood)
    }

    /// Whether the state is to be told again.
    pub fn is_due(&self) -> bool {
        (self.clock)().awake.saturating_sub(self.told) >= EVERY
    }

    /// The state since it was last told: the log's part of it, and the readings that are missing by now.
    pub fn state(&mut self, now: Nanos, disk: MachineState, missed: u64) -> Health {
        self.told = (self.clock)().awake;
        let before = std::mem::replace(&mut self.missed, missed);
        Health {
            now,
            told: Told::State(MachineState {
                lateness_s: std::mem::take(&mut self.lateness).as_secs_f64(),
                missed_readings: missed.saturating_sub(before),
                ..disk
            }),
        }
    }

    /// The anchor that a session ends with.
    pub fn end(&self, now: Nanos) -> Health {
        let times = (self.clock)();
        anchor(now, Why::End, times.wall, self.shift_s(&times))
    }

    /// By how much the wall clock went ahead of the monotonic one since the last anchor.
    fn shift_s(&self, times: &HostTimes) -> f64 {
        let passed = match times.wall.duration_since(self.anchor.wall) {
            Ok(ahead) => ahead.as_secs_f64(),
            Err(behind) => -behind.duration().as_secs_f64(),
        };
        passed - times.awake.saturating_sub(self.anchor.awake).as_secs_f64()
    }
}

fn anchor(now: Nanos, why: Why, wall: SystemTime, shift_s: f64) -> Health {
    let wall = wall.into();
    Health { now, told: Told::Anchor { why, wall, shift_s } }
}
