//! What one step is held to, measured sample by sample.

use super::Achieved;
use crate::plans::{HoldForce, LoadTo, PlannedStep, Step};
use palpate_model::rig::{AxisStatus, RigDescription};
use palpate_model::signal::MovingMean;
use palpate_model::units::Newtons;
use palpate_sessions::record::Row;

/// Speeds and frequencies may be off by this share: a stepper keeps them to its crystal, so a hundredth is a fault.
const RATE_SHARE: f64 = 0.01;
/// A force may be off by this share of the target,
const FORCE_SHARE: f64 = 0.05;
/// and by this much in N in any case: what the mean of ten samples of a noisy cell hides.
pub(crate) const FORCE_FLOOR: f64 = 0.05;
/// The lowest force of a sine is the lowest mean over this share of a period: short beside it, and long beside noise.
const SINE_SHARE: f64 = 0.02;
/// and over so many samples at most, which hide any noise.
const SINE_SAMPLES_MAX: f64 = 1000.0;
/// A duration may be off by so many seconds beside a sample at each end: the answer of the axis.
const ANSWER_SECS: f64 = 0.003;
/// Fewer milliseconds of cruise tell no speed: the pulses are too coarse.
const CRUISE_MS_MIN: u64 = 20;
/// Until this share of its force target an indentation surely goes at full speed.
const LOAD_CRUISE_SHARE: f64 = 0.5;

/// Least-squares slope, sums taken from the first point so that long times lose no digits.
#[derive(Clone, Copy, Debug, Default)]
struct Slope {
    first: Option<(f64, f64)>,
    n: u64,
    t: f64,
    x: f64,
    tt: f64,
    tx: f64,
}

impl Slope {
    fn push(&mut self, t: f64, x: f64) {
        let (t0, x0) = *self.first.get_or_insert((t, x));
        let (t, x) = (t - t0, x - x0);
        self.n += 1;
        self.t += t;
        self.x += x;
        self.tt += t * t;
        self.tx += t * x;
    }

    /// The slope, once there are so many points.
    fn slope(&self, least: u64) -> Option<f64> {
        let n = self.n as f64;
        let below = n * self.tt - self.t * self.t;
        (self.n >= least && below > 0.0).then(|| (n * self.tx - self.t * self.x) / below)
    }
}

/// A step in progress.
#[derive(Clone, Debug)]
pub(super) struct Measuring {
    pub step_index: usize,
    planned: PlannedStep,
    mm_per_pulse: f64,
    tick_secs: f64,
    /// From sample to sample, in s.
    sample_secs: f64,
    per_ms: u32,
    acceleration: f64,
    first: Option<Row>,
    by_path: Slope,
    by_pulses: Slope,
    depth: [f64; 2],
    moving: Option<[u64; 2]>,
    force_reached: Option<Newtons>,
    force_sum: (f64, u64),
    has_duration: bool,
    /// The mean of a short while of a sine, and the lowest there was.
    sine: Option<(MovingMean, f64)>,
}

impl Measuring {
    pub fn new(step_index: usize, planned: &PlannedStep, rig: &RigDescription) -> Self {
        let sine = match planned.step {
            Step::Sine(sine) => {
                let samples = SINE_SHARE / (sine.frequency_hz * rig.tick().0);
                let samples = samples.min(SINE_SAMPLES_MAX) as usize;
                Some((MovingMean::new(samples), f64::INFINITY))
            }
            _ => None,
        };
        Self {
            sine,
            step_index,
            planned: planned.clone(),
            mm_per_pulse: rig.mm_per_pulse,
            tick_secs: rig.tick().0,
            sample_secs: rig.tick().0 * rig.ticks_per_sample.max(1.0),
            per_ms: rig.samples_per_ms(),
            acceleration: rig.acceleration.0,
            first: None,
            by_path: Slope::default(),
            by_pulses: Slope::default(),
            depth: [f64::INFINITY, f64::NEG_INFINITY],
            moving: None,
            force_reached: None,
            force_sum: (0.0, 0),
            has_duration: true,
        }
    }

    pub fn force_reached(&mut self, force: Newtons) {
        self.force_reached = Some(force);
    }

    pub fn has_no_duration(&mut self) {
        self.has_duration = false;
    }

    pub fn row(&mut self, row: &Row) {
        let first = *self.first.get_or_insert(*row);
        let t = self.since(&first, row);
        if AxisStatus(row.status).has(AxisStatus::MOVING) {
            let begun = self.moving.map_or(row.tick, |[begun, _]| begun);
            self.moving = Some([begun, row.tick]);
        }
        if let Some(depth) = row.depth {
            self.depth = [self.depth[0].min(depth), self.depth[1].max(depth)];
            if self.is_cruising(&first, row, depth) {
                self.by_path.push(t, depth);
                if let Some(pulses) = row.pulses {
                    self.by_pulses.push(t, pulses as f64 * self.mm_per_pulse);
                }
            }
        }
        if let (Some((mean, lowest)), Some(force)) = (&mut self.sine, row.force) {
            let now = mean.push(force);
            // The mean of a few samples is lower than any by its noise.
            if mean.is_full() {
                *lowest = lowest.min(now);
            }
        }
        if let (Step::HoldForce(hold), Some(force)) = (&self.planned.step, row.force)
            && t >= 0.5 * hold.duration.0
        {
            self.force_sum = (self.force_sum.0 + force, self.force_sum.1 + 1);
        }
    }

    fn since(&self, first: &Row, row: &Row) -> f64 {
        row.tick.saturating_sub(first.tick) as f64 * self.tick_secs
    }

    /// Whether the axis surely goes at its full speed here.
    fn is_cruising(&self, first: &Row, row: &Row, depth: f64) -> bool {
        let Some(begun) = first.depth else {
            return false;
        };
        // The way of the acceleration, and a pulse of margin.
        let way = |speed: f64| 0.5 * speed * speed / self.acceleration + self.mm_per_pulse;
        let between = |speed: f64, end: f64| {
            (depth - begun).abs() > way(speed) && (end - depth).abs() > way(speed)
        };
        match self.planned.step {
            Step::Ramp { speed, depth: end } => between(speed.0, end.0),
            Step::Unload {
                speed,
                clearance_mm,
            } => between(speed.0, -clearance_mm),
            Step::LoadTo(load) => {
                let full = load.force.0 - load.brake.map_or(0.0, |brake| brake.0);
                let is_far = row
                    .force
                    .is_some_and(|force| force < LOAD_CRUISE_SHARE * full);
                is_far && depth - begun > way(load.speed.0)
            }
            _ => false,
        }
    }

    /// What speaks against the step although every target may be met, as a sentence.
    fn remark(&self) -> Option<String> {
        let doubt = match self.planned.step {
            Step::LoadTo(LoadTo { force, .. }) | Step::HoldForce(HoldForce { force, .. })
                if force.0 <= FORCE_FLOOR =>
            {
                format!(
                    "a force of {:.4} N is no more than a force may be off, {FORCE_FLOOR} N, so nothing tells whether it was met",
                    force.0
                )
            }
            Step::Sine(_) => {
                let (_, lowest) = self.sine.as_ref()?;
                if *lowest > FORCE_FLOOR {
                    return None;
                }
                format!(
                    "the force came back to {lowest:.3} N, where nothing tells contact from none (below {FORCE_FLOOR} N): the probe may have lost the tissue; go deeper or swing less"
                )
            }
            _ => return None,
        };
        let (step, phase) = (self.step_index + 1, self.planned.step.phase());
        Some(format!("step {step} ({phase}): {doubt}"))
    }

    /// The step is done; `last` is the last sample before the next one began.
    pub fn finish(self, last: &Row, targets: &mut Vec<Achieved>) -> Option<String> {
        let first = self.first?;
        let remark = self.remark();
        let took = self.since(&first, last) + self.sample_secs;
        let mut add = |quantity, unit, target: f64, achieved: Option<f64>, allowed: f64| {
            let Some(achieved) = achieved else { return };
            let error = achieved - target;
            targets.push(Achieved {
                step_index: self.step_index,
                step: self.planned.step.phase().name(),
                cycle: self.planned.cycle,
                quantity,
                unit,
                target,
                achieved,
                error_percent: (target != 0.0).then(|| 100.0 * error / target.abs()),
                allowed,
                is_within: error.abs() <= allowed,
            });
        };
        let cruise = CRUISE_MS_MIN * u64::from(self.per_ms);
        let mut speed = |target: f64| {
            for (name, slope) in [
                ("speed", &self.by_path),
                ("speed by pulses", &self.by_pulses),
            ] {
                let achieved = slope.slope(cruise).map(f64::abs);
                add(name, "mm/s", target, achieved, RATE_SHARE * target);
            }
        };
        let of_force = |target: f64| (FORCE_SHARE * target.abs()).max(FORCE_FLOOR);
        let of_duration = ANSWER_SECS + 2.0 * self.sample_secs.max(0.001);
        // The last sample of a move may be one before its end.
        let of_depth = |speed: f64| self.mm_per_pulse + speed * self.sample_secs;
        let duration = self.has_duration.then_some(took);
        match self.planned.step {
            Step::Ramp { speed: v, depth } => {
                speed(v.0);
                add("depth", "mm", depth.0, last.depth, of_depth(v.0));
            }
            Step::Unload {
                speed: v,
                clearance_mm,
            } => {
                speed(v.0);
                add("depth", "mm", -clearance_mm, last.depth, of_depth(v.0));
            }
            Step::LoadTo(load) => {
                speed(load.speed.0);
                let force = self.force_reached.map(|force| force.0);
                add("force", "N", load.force.0, force, of_force(load.force.0));
            }
            Step::HoldForce(hold) => {
                let (sum, count) = self.force_sum;
                let mean = (count > 0).then(|| sum / count as f64);
                add("force", "N", hold.force.0, mean, of_force(hold.force.0));
                add("duration", "s", hold.duration.0, duration, of_duration);
            }
            Step::Sine(sine) => {
                let [low, high] = self.depth;
                let amplitude = (high >= low).then_some(0.5 * (high - low));
                add(
                    "amplitude",
                    "mm",
                    sine.amplitude_mm,
                    amplitude,
                    self.mm_per_pulse,
                );
                let frequency = self.moving.map(|[begun, ended]| {
                    let ticks = ended.saturating_sub(begun) + 1;
                    f64::from(sine.cycles) / (ticks as f64 * self.tick_secs)
                });
                let allowed = RATE_SHARE * sine.frequency_hz;
                add("frequency", "Hz", sine.frequency_hz, frequency, allowed);
            }
            Step::Hold {
                duration: wanted, ..
            }
            | Step::Rest { duration: wanted } => {
                add("duration", "s", wanted.0, duration, of_duration);
            }
            Step::Follow(follow) => {
                // The move under way is braked first.
                let allowed = of_duration + follow.speed.0 / self.acceleration;
                add("duration", "s", follow.duration.0, duration, allowed);
            }
            _ => {}
        }
        remark
    }
}
