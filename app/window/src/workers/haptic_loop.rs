//! The haptic loop of the window: a thread that ticks, and its past for the plots.

use super::trail::{TIMING_S, forget_old};
use palpate_haptics::Flags;
use palpate_haptics::simulation::{SimulationSettings, SimulationTick};
use palpate_model::units::MmPerS;
use palpate_runner::haptics::device_recording::{GuidedDeviceRecorder, RecordedGuidedDevice};
use palpate_runner::haptics::timing::LoopTiming;
use palpate_runner::haptics::{GuidedDevice, HandTarget, RealTimeLoop, TrailPoint};
use std::collections::VecDeque;

/// Time in s for which a cause of less force stays on the screen.
const CAUSE_S: f64 = 0.3;

/// A loop that runs or ran last.
pub struct HapticLoop {
    beat: Option<RealTimeLoop<RecordedGuidedDevice>>,
    lead: HandTarget,
    points_read: u64,
    trail: VecDeque<TrailPoint>,
    last: SimulationTick,
    timing: LoopTiming,
    timing_read_at: f64,
    /// Ticks missed between the last two readings of the timing.
    missed: u64,
    rate_hz: f64,
    priority: String,
}

impl HapticLoop {
    /// Starts the loop; the hand moves at `speed` where it is led.
    pub fn start(
        settings: &SimulationSettings,
        speed: MmPerS,
        recorder: Option<GuidedDeviceRecorder>,
    ) -> Result<Self, String> {
        let device = GuidedDevice::new(settings, speed).map_err(|err| err.to_string())?;
        let (lead, first) = (device.hand_target(), device.view().clone());
        let last = first.last;
        let period = settings.system.law.period;
        let device = RecordedGuidedDevice { device, recorder };
        let beat = RealTimeLoop::start(device, period, first)
            .map_err(|err| format!("the loop's thread cannot be started: {err}"))?;
        Ok(Self {
            lead,
            points_read: 0,
            trail: VecDeque::new(),
            last,
            timing: beat.timing(),
            timing_read_at: 0.0,
            missed: 0,
            rate_hz: period.hz(),
            priority: beat.granted_priority().to_string(),
            beat: Some(beat),
        })
    }

    /// Reads new points. An error: the loop has ended by itself.
    pub fn poll(&mut self) -> Result<(), String> {
        let Some(beat) = &mut self.beat else {
            return Ok(());
        };
        let live = beat.view();
        self.trail.extend(live.since(self.points_read).copied());
        self.points_read = live.count();
        self.last = live.last;
        let now = self.last.t.0;
        forget_old(&mut self.trail, now, |point| point.t);
        if now - self.timing_read_at >= TIMING_S {
            let timing = beat.timing();
            self.missed = timing.missed - self.timing.missed;
            self.timing = timing;
            self.timing_read_at = now;
        }
        if beat.is_alive() {
            return Ok(());
        }
        self.beat = None;
        Err("the loop ended unexpectedly; start it again, and report it if it happens twice".into())
    }

    pub fn is_running(&self) -> bool {
        self.beat.is_some()
    }

    /// Takes the thread out to be ended, as its recording waits for the disk.
    pub fn stop(&mut self) -> Option<RealTimeLoop<RecordedGuidedDevice>> {
        let beat = self.beat.take()?;
        self.timing = beat.timing();
        Some(beat)
    }

    /// Leads the hand to a place in mm.
    pub fn lead(&self, place_mm: f64) {
        self.lead.set(place_mm);
    }

    /// The target of the hand in mm.
    pub fn place(&self) -> f64 {
        self.lead.position()
    }

    /// 250 points a second.
    pub fn trail(&self) -> impl Iterator<Item = &TrailPoint> + Clone {
        self.trail.iter()
    }

    pub fn last(&self) -> &SimulationTick {
        &self.last
    }

    pub fn kept(&self) -> &LoopTiming {
        &self.timing
    }

    /// Ticks missed in the last half second or so.
    pub fn missed(&self) -> u64 {
        self.missed
    }

    /// Target rate.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// As granted by the system.
    pub fn priority(&self) -> &str {
        &self.priority
    }

    /// Flags of the last moment.
    pub fn flags(&self) -> Flags {
        let late = self.trail.iter().rev();
        late.take_while(|point| point.t > self.last.t.0 - CAUSE_S)
            .fold(self.last.output.flags, |all, point| all | point.flags)
    }
}
