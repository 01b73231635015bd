//! The haptic loop as the window runs it: a thread of its own that ticks, and what was seen of it so far.

use super::trail::{LOOK_S, forget_old};
use palpate_haptics::Flags;
use palpate_haptics::simulation::{SimulationSettings, SimulationTick};
use palpate_model::units::MmPerS;
use palpate_runner::haptics::taped::{LedRecorder, TapedLed};
use palpate_runner::haptics::timing::Kept;
use palpate_runner::haptics::{Beat, Lead, Led, TrailPoint};
use std::collections::VecDeque;

/// For how long a cause of less force stays on the screen, in s.
const CAUSE_S: f64 = 0.3;

/// A loop that runs or ran, and what was seen of it.
pub struct HapticLoop {
    beat: Option<Beat<TapedLed>>,
    lead: Lead,
    known: u64,
    trail: VecDeque<TrailPoint>,
    last: SimulationTick,
    kept: Kept,
    looked: f64,
    /// Ticks missed between the last two looks.
    missed: u64,
    rate_hz: f64,
    priority: String,
}

impl HapticLoop {
    /// Starts the loop; the hand moves at `speed` where it is led.
    pub fn start(
        settings: &SimulationSettings,
        speed: MmPerS,
        recorder: Option<LedRecorder>,
    ) -> Result<Self, String> {
        let device = Led::new(settings, speed).map_err(|err| err.to_string())?;
        let (lead, first) = (device.lead(), device.live().clone());
        let last = first.last;
        let period = settings.system.law.period;
        let device = TapedLed { led: device, recorder };
        let beat = Beat::start(device, period, first)
            .map_err(|err| format!("the loop's thread cannot be started: {err}"))?;
        Ok(Self {
            lead,
            known: 0,
            trail: VecDeque::new(),
            last,
            kept: beat.kept(),
            looked: 0.0,
            missed: 0,
            rate_hz: period.hz(),
            priority: beat.granted().to_string(),
            beat: Some(beat),
        })
    }

    /// Takes over what is new. An error: the loop has ended by itself.
    pub fn poll(&mut self) -> Result<(), String> {
        let Some(beat) = &mut self.beat else {
            return Ok(());
        };
        let live = beat.seen();
        self.trail.extend(live.since(self.known).copied());
        self.known = live.count();
        self.last = live.last;
        let now = self.last.t.0;
        forget_old(&mut self.trail, now, |point| point.t);
        if now - self.looked >= LOOK_S {
            let kept = beat.kept();
            self.missed = kept.missed - self.kept.missed;
            self.kept = kept;
            self.looked = now;
        }
        if beat.is_alive() {
            return Ok(());
        }
        self.beat = None;
        Err("the loop ended unexpectedly; start it again, and report it if it happens twice".into())
    }

    /// Whether it ticks.
    pub fn is_running(&self) -> bool {
        self.beat.is_some()
    }

    /// What is still to be ended, whose recording waits for the disk; what was seen stays.
    pub fn stop(&mut self) -> Option<Beat<TapedLed>> {
        let beat = self.beat.take()?;
        self.kept = beat.kept();
        Some(beat)
    }

    /// Leads the hand to a place in mm.
    pub fn lead(&self, place_mm: f64) {
        self.lead.to(place_mm);
    }

    /// Where it is led, in mm.
    pub fn place(&self) -> f64 {
        self.lead.place()
    }

    /// The past, 250 points a second.
    pub fn trail(&self) -> impl Iterator<Item = &TrailPoint> + Clone {
        self.trail.iter()
    }

    /// The newest tick.
    pub fn last(&self) -> &SimulationTick {
        &self.last
    }

    /// How the loop kept its time.
    pub fn kept(&self) -> &Kept {
        &self.kept
    }

    /// Ticks missed in the last half second or so.
    pub fn missed(&self) -> u64 {
        self.missed
    }

    /// Ticks a second that are wanted.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// The priority that the system gave.
    pub fn priority(&self) -> &str {
        &self.priority
    }

    /// What was special a moment ago and is still worth saying.
    pub fn flags(&self) -> Flags {
        let late = self.trail.iter().rev();
        late.take_while(|point| point.t > self.last.t.0 - CAUSE_S)
            .fold(self.last.output.flags, |all, point| all | point.flags)
    }
}
