//! Targets of a finished step, measured sample by sample.

use super::Step;
use super::stats::RunningLine;
use palpate_model::rig::{AxisStatus, RigDescription};
use palpate_model::signal::MovingMean;
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};

/// Speeds and frequencies may be off by this share: a stepper keeps them to its crystal, so a hundredth is a fault.
const RATE_SHARE: f64 = 0.01;
/// Relative tolerance of a force,
const FORCE_SHARE: f64 = 0.05;
/// and its least tolerance in N: the noise of a mean of ten samples of a noisy cell.
pub(crate) const FORCE_FLOOR: f64 = 0.05;
/// A duration may be off by so many seconds beside a sample at each end: the answer of the axis.
const ANSWER_SECS: f64 = 0.003;
/// Fewer milliseconds of cruise tell no speed: the pulses are too coarse.
const CRUISE_MS_MIN: u64 = 20;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeterSample {
    pub tick: u64,
    pub status: AxisStatus,
    pub pulses: Option<i64>,
    /// Depth in mm and force in N, where they were known.
    pub depth: Option<f64>,
    pub force: Option<f64>,
}

impl MeterSample {
    /// Whether its depth is further than `way` from both ends of a move.
    pub fn is_between(&self, begun: f64, end: f64, way: f64) -> bool {
        let is_inside = |depth: f64| (depth - begun).abs() > way && (end - depth).abs() > way;
        self.depth.is_some_and(is_inside)
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepTarget {
    pub quantity: &'static str,
    pub unit: &'static str,
    pub target: f64,
    pub achieved: f64,
    /// Tolerance, in the unit.
    pub allowed: f64,
}

#[derive(Clone, Debug)]
pub struct StepMeter {
    step: Step,
    rig: RigDescription,
    first: Option<MeterSample>,
    by_path: RunningLine,
    by_pulses: RunningLine,
    depth: [f64; 2],
    moving: Option<[u64; 2]>,
    force_reached: Option<Newtons>,
    force_sum: (f64, u64),
    has_duration: bool,
    /// The mean of a short while of the force, and the lowest there was.
    lowest: Option<(MovingMean, f64)>,
}

impl StepMeter {
    pub fn new(step: &Step, rig: &RigDescription) -> Self {
        let samples = step.kind().force_mean_samples(rig);
        Self {
            lowest: samples.map(|samples| (MovingMean::new(samples), f64::INFINITY)),
            step: step.clone(),
            rig: rig.clone(),
            first: None,
            by_path: RunningLine::default(),
            by_pulses: RunningLine::default(),
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

    pub fn ignore_duration(&mut self) {
        self.has_duration = false;
    }

    pub fn push(&mut self, sample: &MeterSample) {
        let first = *self.first.get_or_insert(*sample);
        let t = self.since(&first, sample);
        if sample.status.has(AxisStatus::MOVING) {
            let begun = self.moving.map_or(sample.tick, |[begun, _]| begun);
            self.moving = Some([begun, sample.tick]);
        }
        if let Some(depth) = sample.depth {
            self.depth = [self.depth[0].min(depth), self.depth[1].max(depth)];
            if self.is_cruising(&first, sample) {
                self.by_path.push(t, depth);
                if let Some(pulses) = sample.pulses {
                    self.by_pulses.push(t, pulses as f64 * self.rig.mm_per_pulse);
                }
            }
        }
        let Some(force) = sample.force else { return };
        if let Some((mean, lowest)) = &mut self.lowest {
            let now = mean.push(force);
            // The mean of a few samples is lower than any by its noise.
            if mean.is_full() {
                *lowest = lowest.min(now);
            }
        }
        let counts_from = self.step.kind().force_counts_from();
        if counts_from.is_some_and(|from| t >= from) {
            self.force_sum = (self.force_sum.0 + force, self.force_sum.1 + 1);
        }
    }

    fn since(&self, first: &MeterSample, sample: &MeterSample) -> f64 {
        sample.tick.saturating_sub(first.tick) as f64 * self.rig.tick().0
    }

    /// Whether the axis surely goes at its full speed here.
    fn is_cruising(&self, first: &MeterSample, sample: &MeterSample) -> bool {
        // The way of the acceleration, and a pulse of margin.
        let way =
            |speed: f64| 0.5 * speed * speed / self.rig.acceleration.0 + self.rig.mm_per_pulse;
        let kind = self.step.kind();
        first.depth.is_some_and(|begun| kind.is_cruising(begun, sample, &way))
    }

    /// The step is done; `last` is the last sample before the next one began. Its targets, and what speaks against it
    /// although every one may be met.
    pub fn finish(&self, last: &MeterSample) -> Option<(Vec<StepTarget>, Option<String>)> {
        let first = self.first?;
        let sample_secs = self.rig.tick().0 * self.rig.ticks_per_sample.max(1.0);
        let mut done = StepResult {
            rig: &self.rig,
            meter: self,
            sample_secs,
            took: self.since(&first, last) + sample_secs,
            end_depth: last.depth,
            targets: Vec::new(),
        };
        self.step.kind().judge(&mut done);
        let doubt = self.step.kind().doubt(&done);
        Some((done.targets, doubt))
    }
}

/// What was done in a step, to hold it against its targets.
pub(crate) struct StepResult<'a> {
    pub rig: &'a RigDescription,
    meter: &'a StepMeter,
    /// From sample to sample, in s.
    sample_secs: f64,
    took: f64,
    end_depth: Option<f64>,
    targets: Vec<StepTarget>,
}

impl StepResult<'_> {
    fn add(
        &mut self,
        (quantity, unit): (&'static str, &'static str),
        target: f64,
        achieved: Option<f64>,
        allowed: f64,
    ) {
        self.targets.extend(achieved.map(|achieved| StepTarget {
            quantity,
            unit,
            target,
            achieved,
            allowed,
        }));
    }

    pub fn speed(&mut self, MmPerS(target): MmPerS) {
        let cruise = CRUISE_MS_MIN * u64::from(self.rig.samples_per_ms());
        let meter = self.meter;
        for (name, line) in [("speed", &meter.by_path), ("speed by pulses", &meter.by_pulses)] {
            let slope = line.slope().filter(|_| line.count() >= cruise);
            let achieved = slope.map(|(slope, _)| slope.abs());
            self.add((name, "mm/s"), target, achieved, RATE_SHARE * target);
        }
    }

    /// Where a move at a speed ended. The last sample of a move may be one before its end.
    pub fn depth(&mut self, Depth(target): Depth, MmPerS(speed): MmPerS) {
        let allowed = self.rig.mm_per_pulse + speed * self.sample_secs;
        self.add(("depth", "mm"), target, self.end_depth, allowed);
    }

    pub fn force(&mut self, Newtons(target): Newtons, achieved: Option<Newtons>) {
        let allowed = (FORCE_SHARE * target.abs()).max(FORCE_FLOOR);
        let achieved = achieved.map(|force| force.0);
        self.add(("force", "N"), target, achieved, allowed);
    }

    /// How long it took; `braking_secs` are what the end may wait for.
    pub fn duration(&mut self, Seconds(target): Seconds, braking_secs: f64) {
        let allowed = ANSWER_SECS + 2.0 * self.sample_secs.max(0.001) + braking_secs;
        let took = self.meter.has_duration.then_some(self.took);
        self.add(("duration", "s"), target, took, allowed);
    }

    pub fn amplitude(&mut self, target: f64) {
        let [low, high] = self.meter.depth;
        let achieved = (high >= low).then_some(0.5 * (high - low));
        let allowed = self.rig.mm_per_pulse;
        self.add(("amplitude", "mm"), target, achieved, allowed);
    }

    pub fn frequency(&mut self, target: f64, cycles: u32) {
        let achieved = self.meter.moving.map(|[begun, ended]| {
            let ticks = ended.saturating_sub(begun) + 1;
            f64::from(cycles) / (ticks as f64 * self.rig.tick().0)
        });
        self.add(("frequency", "Hz"), target, achieved, RATE_SHARE * target);
    }

    pub fn force_reached(&self) -> Option<Newtons> {
        self.meter.force_reached
    }

    /// The mean of the force that counts.
    pub fn mean_force(&self) -> Option<Newtons> {
        let (sum, count) = self.meter.force_sum;
        (count > 0).then(|| Newtons(sum / count as f64))
    }

    /// The lowest short mean of the force in N.
    pub fn lowest_force(&self) -> Option<f64> {
        self.meter.lowest.as_ref().map(|(_, lowest)| *lowest)
    }
}

/// What speaks against a target that no force could miss.
pub(super) fn doubt_force(force: Newtons) -> Option<String> {
    (force.0 <= FORCE_FLOOR).then(|| {
        format!(
            "a force of {:.4} N is not above the tolerance of {FORCE_FLOOR} N, so the record cannot show whether it was reached",
            force.0
        )
    })
}
