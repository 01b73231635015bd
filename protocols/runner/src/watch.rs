//! How the computer keeps up with a run and what its clocks do, logged once a second. It leads to one decision only: a
//! computer that stood still ends the run.

use super::clock::{HostClock, HostTimes};
use palpate_model::Nanos;
use palpate_model::units::Seconds;
use palpate_sessions::health::{AnchorReason, HealthContent};
use palpate_sessions::{HealthMessage, MachineState};
use std::time::{Duration, SystemTime};

const EVERY: Duration = Duration::from_secs(1);
/// A larger step of the wall clock against the monotonic one means that it was set; a longer silence means that the computer
/// stood still. Far above the delays of a busy scheduler, far below what an operator would notice late.
const APART: Duration = Duration::from_millis(500);

pub(super) struct HostWatch {
    clock: HostClock,
    /// Whether the rig's time goes on while this computer stands still.
    is_wired: bool,
    anchor: HostTimes,
    /// The time that was spent suspended before.
    asleep: Duration,
    reported_at: Duration,
    lateness: Duration,
    missed: u64,
}

impl HostWatch {
    pub fn new(clock: HostClock, is_wired: bool) -> Self {
        let times = clock();
        Self {
            clock,
            is_wired,
            anchor: times,
            asleep: times.all.saturating_sub(times.awake),
            reported_at: times.awake,
            lateness: Duration::ZERO,
            missed: 0,
        }
    }

    pub fn begin(&self) -> HealthMessage {
        anchor(Nanos::ZERO, AnchorReason::Start, self.anchor.wall, 0.0)
    }

    /// One turn of the loop, late by `lateness`: a jump of the wall clock, and for how long the computer stood still.
    pub fn turn(
        &mut self,
        now: Nanos,
        lateness: Duration,
    ) -> (Option<HealthMessage>, Option<Seconds>) {
        self.lateness = self.lateness.max(lateness);
        let times = (self.clock)();
        let shift_s = self.shift_s(&times);
        let jump = (shift_s.abs() > APART.as_secs_f64()).then(|| {
            self.anchor = times;
            anchor(now, AnchorReason::Jump, times.wall, shift_s)
        });
        let asleep = times.all.saturating_sub(times.awake);
        let slept = asleep.saturating_sub(std::mem::replace(&mut self.asleep, asleep));
        // The time of a simulated rig waits for a late computer, but a suspension counts there too.
        let stood = match self.is_wired {
            true => slept + lateness,
            false => slept,
        };
        let stood = (stood > APART).then_some(Seconds(stood.as_secs_f64()));
        (jump, stood)
    }

    pub fn is_due(&self) -> bool {
        (self.clock)().awake.saturating_sub(self.reported_at) >= EVERY
    }

    /// The state since the last report; `missed` are the readings that are missing since the start.
    pub fn state(&mut self, now: Nanos, disk: MachineState, missed: u64) -> HealthMessage {
        self.reported_at = (self.clock)().awake;
        let before = std::mem::replace(&mut self.missed, missed);
        HealthMessage {
            now,
            content: HealthContent::State(MachineState {
                lateness_s: std::mem::take(&mut self.lateness).as_secs_f64(),
                missed_readings: missed.saturating_sub(before),
                ..disk
            }),
        }
    }

    pub fn end(&self, now: Nanos) -> HealthMessage {
        let times = (self.clock)();
        anchor(now, AnchorReason::End, times.wall, self.shift_s(&times))
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

fn anchor(now: Nanos, why: AnchorReason, wall: SystemTime, shift_s: f64) -> HealthMessage {
    let wall = wall.into();
    HealthMessage { now, content: HealthContent::Anchor { reason: why, wall, shift_s } }
}
