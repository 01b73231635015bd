//! Interlocks: judged on every sample before the plan sees it. No plan can switch them off.

use super::block_mean::BlockMean;
use super::state::{EngineState, Power};
use crate::steps::Step;
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Limits, Phase, Reading, RigDescription};
use palpate_model::units::{MmPerS, Newtons, Position, Seconds, Volts};
use serde::{Deserialize, Serialize};

palpate_model::named! {
    /// What tripped. The order of the variants is the order of judgement: the first that trips is
    /// the reason given.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Interlock {
        /// The signal is not a number: nothing below can be judged.
        Signal = "signal",
        /// A limit switch closed, or the position left the travel.
        Travel = "travel",
        /// Force above tare out of bounds.
        Force = "force",
        /// Raw signal too high, whatever the calibration says.
        Volts = "raw signal",
        ForceRate = "force rate",
        SampleAge = "sample age",
        Motor = "motor",
        Path = "path",
        Link = "link",
    }
}

/// An interlock that tripped, with what was seen.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Trip {
    pub interlock: Interlock,
    pub reason: String,
}

/// Milliseconds in each of the two means whose difference is the force rate.
const RATE_MS: usize = 10;

/// A signal that stays constant for so many milliseconds is that of a dead cell: with noise of a few counts each sample
/// repeats the last one with a probability of at most one half.
const STUCK_MS: u32 = 100;

/// While the operator retracts after an over-force the limits that stopped the run are already
/// exceeded; the ceiling becomes the force at the start of the retract plus this.
const RETRACT_HEADROOM: Newtons = Newtons(0.5);
const RETRACT_HEADROOM_VOLTS: Volts = Volts(0.05);

/// A shorter pause of the computer is not a silence of the rig: it is over when it is noticed, and no stop could have been
/// sent in it. A longer one counts as silence: so long may a rig be silent at rest.
const PAUSE_MAX: Nanos = Nanos::from_millis(250);

/// What the interlocks remember between samples.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct InterlockWatch {
    last_at: Option<Nanos>,
    last_tick: Option<u64>,
    millisecond: BlockMean<1>,
    /// The newest forces, one a millisecond, oldest first once full.
    recent: [f64; 2 * RATE_MS],
    /// The ticks of their last samples.
    recent_ticks: [u64; 2 * RATE_MS],
    recent_count: usize,
    retract_ceiling: Option<(Newtons, Volts)>,
    newest: (Newtons, Volts),
    /// Consecutive samples with exactly the newest signal, and how many are a dead cell.
    same_count: u32,
    stuck: u32,
}

impl InterlockWatch {
    pub fn new(rig: &RigDescription) -> Self {
        Self {
            last_at: None,
            last_tick: None,
            millisecond: BlockMean::of_millisecond(rig),
            recent: [0.0; 2 * RATE_MS],
            recent_ticks: [0; 2 * RATE_MS],
            recent_count: 0,
            retract_ceiling: None,
            newest: (Newtons(0.0), Volts(0.0)),
            same_count: 0,
            stuck: if rig.shows_noise() { STUCK_MS * rig.samples_per_ms() } else { u32::MAX },
        }
    }

    pub fn start(&mut self, now: Nanos) {
        self.last_at.get_or_insert(now);
    }

    pub fn excuse(&mut self, late: Nanos) {
        if late <= PAUSE_MAX
            && let Some(last) = &mut self.last_at
        {
            *last = *last + late;
        }
    }

    /// The operator retracts: the present force may stay, but not grow.
    pub fn allow_retract(&mut self) {
        let (force, volts) = self.newest;
        self.retract_ceiling = Some((force + RETRACT_HEADROOM, volts + RETRACT_HEADROOM_VOLTS));
    }

    /// The zero of the signal has moved (tare): forces before and after are not comparable.
    pub fn forget_rate(&mut self) {
        self.recent_count = 0;
        self.millisecond.clear();
    }

    /// Whether the signal stands still; takes the newest.
    fn is_stuck(&mut self, volts: Volts) -> bool {
        self.same_count = if volts == self.newest.1 { self.same_count + 1 } else { 0 };
        self.same_count >= self.stuck
    }

    /// Change of force between the two newest means, in N/s, each time a millisecond is complete and there are enough.
    fn push_rate(&mut self, tick: u64, force: f64, rig: &RigDescription) -> Option<f64> {
        let [force] = self.millisecond.push([force])?;
        self.recent.rotate_left(1);
        self.recent[2 * RATE_MS - 1] = force;
        self.recent_ticks.rotate_left(1);
        self.recent_ticks[2 * RATE_MS - 1] = tick;
        self.recent_count = (self.recent_count + 1).min(2 * RATE_MS);
        if self.recent_count < 2 * RATE_MS {
            return None;
        }
        let (older, newer) = self.recent.split_at(RATE_MS);
        let difference = newer.iter().sum::<f64>() - older.iter().sum::<f64>();
        let (older, newer) = self.recent_ticks.split_at(RATE_MS);
        let sum = |ticks: &[u64]| ticks.iter().fold(0, |sum: u64, tick| sum.saturating_add(*tick));
        // Another interlock handles a clock that went back.
        let ticks = sum(newer).saturating_sub(sum(older));
        if ticks == 0 {
            return None;
        }
        let apart = ticks as f64 / RATE_MS as f64 * rig.tick().0;
        Some(difference / RATE_MS as f64 / apart)
    }
}

/// Judges one sample. `state.derived` already belongs to it; `path_error` is the tracker's error.
pub(super) fn judge(
    state: &mut EngineState,
    now: Nanos,
    reading: &Reading,
    path_error: Option<String>,
) -> Option<Trip> {
    let limits = state.config.limits;
    let age = age_trip(state, now);
    // The age of a sample counts, but not the delay of the cell's filter, which every sample has.
    let late = reading.age.map_or(Nanos::ZERO, |age| age.by);
    let late = late.since(Nanos((state.config.rig.cell_delay.0 * 1e9) as u64));
    state.watch.last_at = Some(Nanos(now.0.saturating_sub(late.0)));
    if !reading.volts.is_finite() {
        let reason = "the load cell's signal is not a number; check its wiring";
        return trip(Interlock::Signal, reason);
    }
    if state.watch.is_stuck(reading.volts) {
        let count = state.watch.stuck;
        let reason = format!("the signal has not changed for {count} samples; check the load cell");
        return trip(Interlock::Signal, reason);
    }
    let derived = state.derived.force;
    let force = derived.unwrap_or_else(|| state.force_from_volts(reading.volts));
    state.watch.newest = (force, reading.volts);
    let rate = state.watch.push_rate(reading.tick, force.0, &state.config.rig);
    let (force_max, volts_max) = match state.watch.retract_ceiling {
        Some((force, volts)) => {
            (Newtons(limits.force_max.0.max(force.0)), Volts(limits.volts_max.0.max(volts.0)))
        }
        None => (limits.force_max, limits.volts_max),
    };
    if state.is_unpowered() {
        // The motor was never energised and no command can move it: a weight on the cell does no harm, and there is
        // no motion to stop. Signal and sample age are checked all the same.
        return age;
    }
    travel_trip(state, reading, &limits)
        .or_else(|| force_trip(force, limits.force_min, force_max))
        .or_else(|| {
            (reading.volts > volts_max).then(|| Trip {
                interlock: Interlock::Volts,
                reason: format!(
                    "the raw signal is {:.3}, above the limit of {volts_max:.2}",
                    reading.volts
                ),
            })
        })
        .or_else(|| rate_trip(rate, limits.force_rate_max, state.current_step()))
        .or(age)
        .or_else(|| motor_trip(state, reading))
        .or_else(|| {
            let reason = path_error?;
            // The position is good enough to leave the tissue; the next run must home.
            state.is_path_lost = true;
            trip(Interlock::Path, reason)
        })
}

fn trip(interlock: Interlock, reason: impl Into<String>) -> Option<Trip> {
    Some(Trip { interlock, reason: reason.into() })
}

/// A closed limit switch trips unless the axis leaves it, or only stands there before it homes or
/// retracts: otherwise a probe on a switch could never leave it.
fn travel_trip(state: &EngineState, reading: &Reading, limits: &Limits) -> Option<Trip> {
    let position = state.derived.position;
    let is_parked = state.in_flight.is_none()
        && (state.phase == Phase::SelfTest && !state.is_homed || state.phase == Phase::Retract);
    for (bit, which, is_forward) in
        [(AxisStatus::FORWARD_LIMIT, "far", true), (AxisStatus::REVERSE_LIMIT, "rear", false)]
    {
        let is_leaving = state.in_flight.is_some_and(|flight| flight.is_forward != is_forward);
        if reading.status.has(bit) && !is_leaving && !is_parked {
            return trip(Interlock::Travel, format!("the {which} limit switch is closed"));
        }
    }
    let is_returning = state.in_flight.is_some_and(|flight| !flight.is_forward);
    if state.is_homed && position > limits.travel_max && !is_returning {
        let Position(end) = limits.travel_max;
        return trip(
            Interlock::Travel,
            format!("the probe is at {:.3} mm, beyond the travel of {end:.1} mm", position.0),
        );
    }
    None
}

/// A motor that was energised for motion and no longer is: the position is not held.
fn motor_trip(state: &mut EngineState, reading: &Reading) -> Option<Trip> {
    if state.power != Power::Enabled || reading.status.has(AxisStatus::MOTOR_ON) {
        return None;
    }
    state.is_homed = false;
    trip(Interlock::Motor, "the motor has lost its current; check its supply, then home the axis")
}

fn force_trip(force: Newtons, force_min: Newtons, force_max: Newtons) -> Option<Trip> {
    if force > force_max {
        return trip(
            Interlock::Force,
            format!("the force is {force:.2}, above the limit of {force_max:.2}"),
        );
    }
    if force < force_min {
        let reason = format!("the load cell reads {force:.2} in tension; check its wiring");
        return trip(Interlock::Force, reason);
    }
    None
}

fn rate_trip(rate: Option<f64>, rate_max: f64, step: Option<&Step>) -> Option<Trip> {
    let rate = rate.filter(|rate| rate.abs() > rate_max)?;
    let advice = step.map_or("", |step| step.kind().rate_advice());
    trip(
        Interlock::ForceRate,
        format!(
            "the force changes by {rate:.0} N/s, faster than the limit of {rate_max:.0} N/s{advice}"
        ),
    )
}

pub(super) fn age_trip(state: &EngineState, now: Nanos) -> Option<Trip> {
    let last_at = state.watch.last_at?;
    let age = now.since(last_at).seconds();
    // A move just begun counts at its full speed: the newest sample cannot know it yet.
    let commanded = state.in_flight.map_or(0.0, |flight| flight.speed.0);
    let speed = state.derived.velocity.0.abs().max(commanded);
    let rig = &state.config.rig;
    let apart = Seconds((rig.ticks_per_sample - 1.0) * rig.tick().0);
    let age_max = Limits::sample_age_max(MmPerS(speed), rig.unseen_max, apart);
    if age <= age_max {
        return None;
    }
    trip(
        Interlock::SampleAge,
        format!(
            "no sample has arrived for {:.0} ms, but at most {:.0} ms are allowed at this speed",
            age.0 * 1e3,
            age_max.0 * 1e3
        ),
    )
}

impl InterlockWatch {
    /// Whether the controller clock went backward: the controller restarted.
    pub fn is_clock_restarted(&mut self, tick: u64) -> bool {
        let is_restarted = self.last_tick.is_some_and(|last| tick <= last);
        self.last_tick = Some(tick);
        is_restarted
    }
}
