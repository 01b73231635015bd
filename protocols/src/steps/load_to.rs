//! Indentation to a force: at constant speed, early by what stopping adds, or slower and slower.

use super::prelude::*;
use super::ramp::INTERRUPTED;
use super::target::doubt_force;

/// Indent at constant speed until a force is reached.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoadTo {
    pub speed: MmPerS,
    /// Force above tare at which the probe stops.
    pub force: Newtons,
    /// Depth beyond which the step fails: the specimen is not what was expected.
    pub depth_max: Depth,
    /// From so much force before the target the probe goes at a tenth of the speed, and from a tenth of that
    /// at a hundredth; without it the probe stops from full speed, early by what stopping adds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub brake: Option<Newtons>,
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Indent at constant speed until a force is reached.",
    keys: &[
        Key::needed("to", QuantityKind::Force, "force above tare"),
        Key::needed("speed", QuantityKind::Speed, "indentation speed"),
        Key::needed("deepest", QuantityKind::Length, "depth at which the step fails"),
        Key::optional(
            "brake",
            QuantityKind::Force,
            "difference to the target force at which the probe slows to 10 % of its speed; within 10 % of this difference it slows to 1 %",
        ),
    ],
    build: Some(|args| {
        Ok(LoadTo {
            speed: args.speed("speed")?,
            force: Newtons(args.number("to")?),
            depth_max: Depth(args.number("deepest")?),
            brake: args.maybe("brake").map(Newtons),
        }
        .into())
    }),
    needs: FROM_SURFACE,
    gives: &[Need::Inside],
    is_measuring: true,
    label: "load",
    ..StepFacts::of("load", Phase::Ramp, PauseBehaviour::Measure(INTERRUPTED))
};

impl LoadTo {
    /// Refuses to begin deeper than it may go, which would lead out of the tissue. A pulse of `pulse_mm` is
    /// forgiven: depths end on whole ones.
    fn check_from(&self, depth: Depth, pulse_mm: f64) -> Result<(), String> {
        if depth.0 <= self.depth_max.0 + pulse_mm {
            return Ok(());
        }
        Err(format!(
            "the depth limit of the load is {:.2}, but the probe is already at {depth:.2}; allow a greater depth, or unload first",
            self.depth_max
        ))
    }
}

impl StepKind for LoadTo {
    fn deepest(&self) -> Option<Depth> {
        Some(self.depth_max)
    }

    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_speed(self.speed);
        walk.check_depth(self.depth_max);
        walk.check_force(self.force);
        if let Some(brake) = self.brake
            && !(brake.0 > 0.0 && brake < self.force)
        {
            walk.refuse(format!(
                "a brake of {brake} before a target of {:.2} is not possible; give more than 0 N and less than the target",
                self.force
            ));
        }
        let from = Depth(walk.reach.low);
        let refusal = self.check_from(from, walk.rig.mm_per_pulse).err();
        walk.refusals.extend(refusal);
        if walk.is_refused() {
            return DurationEstimate(0.0, 0.0, false);
        }
        let longest = walk.move_secs(self.depth_max.0 - from.0, self.speed);
        walk.reach.high = walk.reach.high.max(self.depth_max.0);
        let expected = walk.expected.load(walk.phase, self);
        // The braked stages are a tenth and a hundredth as fast over what is left.
        let braked = self.brake.map_or(1.0, |_| 100.0);
        DurationEstimate(expected, braked * longest, false)
    }

    fn is_cruising(&self, begun: f64, sample: &MeterSample, way: &dyn Fn(f64) -> f64) -> bool {
        let full = self.force.0 - self.brake.map_or(0.0, |brake| brake.0);
        let is_far = |force: f64| force < CRUISE_SHARE * full;
        let is_under_way = |depth: f64| depth - begun > way(self.speed.0);
        sample.force.is_some_and(is_far) && sample.depth.is_some_and(is_under_way)
    }

    fn judge(&self, done: &mut StepResult<'_>) {
        done.speed(self.speed);
        done.force(self.force, done.force_reached());
    }

    fn doubt(&self, _done: &StepResult<'_>) -> Option<String> {
        doubt_force(self.force)
    }
}

/// Until this share of its force target an indentation surely goes at full speed.
const CRUISE_SHARE: f64 = 0.5;

/// Milliseconds averaged before the force is compared: short beside any ramp, and at a sample each noise falls to a
/// third.
const FILTER_MS: usize = 10;

/// Milliseconds from a sample to the axis's first answer: report 1.0 to 1.5 ms, command 0.5 ms, the next tick of a
/// rig with one a millisecond.
const ANSWER_MS: usize = 3;

/// Shares of the speed in the stages of a braked approach, and of the brake force at which each ends.
const STAGES: [(f64, f64); 3] = [(1.0, 1.0), (0.1, 0.1), (0.01, 0.0)];

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LoadRun {
    plan: LoadTo,
    stage: usize,
    is_stopping: bool,
    /// Samples in the filter and until the answer.
    samples: [u32; 2],
    filter: MovingMean,
    /// The filtered force of the sample before, and the smoothed slope in N/s.
    before: Option<f64>,
    slope: f64,
}

impl Executable for LoadTo {
    type Run = LoadRun;

    fn begin(&self, cx: &mut Context<'_>) -> Result<LoadRun, String> {
        let rig = cx.rig();
        // Ten at most.
        let samples =
            [FILTER_MS, ANSWER_MS].map(|ms| rig.means_in(ms) as u32 * rig.samples_per_ms());
        if let Some(depth) = cx.derived().depth {
            self.check_from(depth, rig.mm_per_pulse)?;
        }
        let mut loading = LoadRun {
            plan: *self,
            // Without a brake there is only the last stage, at full speed.
            stage: self.brake.map_or(STAGES.len() - 1, |_| 0),
            is_stopping: false,
            samples,
            filter: MovingMean::new(samples[0] as usize),
            before: None,
            slope: 0.0,
        };
        loading.go(cx)?;
        Ok(loading)
    }
}

impl LoadRun {
    fn speed(&self, cx: &Context<'_>) -> MmPerS {
        if self.plan.brake.is_none() {
            return self.plan.speed;
        }
        let quantum = cx.rig().speed_quantum.0;
        let wanted = self.plan.speed.0 * STAGES[self.stage].0;
        MmPerS((wanted / quantum).round().max(1.0) * quantum)
    }

    fn target(&self) -> Newtons {
        let brake = self.plan.brake.map_or(0.0, |brake| brake.0);
        Newtons(self.plan.force.0 - brake * STAGES[self.stage].1)
    }

    fn go(&mut self, cx: &mut Context<'_>) -> Result<(), String> {
        let contact = cx.contact()?;
        let deepest = self.plan.depth_max.position_from(contact.position);
        let end = Position(deepest.0.min(cx.limits().travel_max.0));
        self.is_stopping = false;
        cx.move_to(end, self.speed(cx))
    }
}

impl RunningStep for LoadRun {
    fn on_reading(&mut self, cx: &mut Context<'_>, _reading: &Reading) -> Result<Progress, String> {
        let Some(force) = cx.derived().force else {
            return Err("the load cell is not tared; tare it first".into());
        };
        let rig = cx.rig();
        // From sample to sample.
        let tick = rig.tick().0 * rig.ticks_per_sample.max(1.0);
        let [filtered, answer] = self.samples.map(f64::from);
        let mean = self.filter.push(force.0);
        if let Some(before) = self.before {
            // Smoothed over the filter's own length: the slope of a mean is as noisy as one sample.
            self.slope += ((mean - before) / tick - self.slope) / filtered;
        }
        self.before = Some(mean);
        let depth = cx.derived().depth.unwrap_or(Depth(0.0));
        let at_rest = cx.at_rest()?;
        if self.is_stopping {
            if !at_rest {
                return Ok(Progress::Continue);
            }
            if self.stage + 1 < STAGES.len() {
                self.stage += 1;
                self.go(cx)?;
                return Ok(Progress::Continue);
            }
            cx.record(Record::ForceReached {
                target: self.plan.force,
                force: Newtons(mean),
                depth,
            });
            return Ok(Progress::Done);
        }
        let speed = cx.derived().velocity.0;
        let braking = speed / (2.0 * cx.rig().acceleration.0);
        // The mean lags by half its length; then come the answer and the way of the deceleration.
        let ahead = (0.5 * filtered + answer) * tick + braking;
        if mean + self.slope.max(0.0) * ahead >= self.target().0 {
            if !at_rest {
                cx.stop_move();
            }
            self.is_stopping = true;
        } else if at_rest {
            return Err(format!(
                "the force is only {:.3} at a depth of {depth:.2}, below the target of {:.3}; check the specimen or allow a greater depth",
                Newtons(mean),
                self.plan.force
            ));
        }
        Ok(Progress::Continue)
    }
}
