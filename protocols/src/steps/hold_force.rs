//! Constant force: the probe follows the tissue in small steps while the force is kept.

use super::prelude::*;
use super::target::doubt_force;
use crate::preview::SETTLE_SECS;

/// Keep the force constant and let the depth creep.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HoldForce {
    /// Force above tare.
    pub force: Newtons,
    pub duration: Seconds,
    pub speed: MmPerS,
    pub depth_max: Depth,
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Keep the force constant while the depth creeps.",
    keys: &[
        Key::needed("force", QuantityKind::Force, "force above tare"),
        Key::needed("for", QuantityKind::Time, "duration").zero_allowed(),
        Key::usual("speed", QuantityKind::Speed, "0.75 mm/s", "speed of the corrections"),
        Key::needed("deepest", QuantityKind::Length, "depth at which the step fails"),
    ],
    build: Some(|args| {
        Ok(HoldForce {
            force: Newtons(args.number("force")?),
            duration: args.seconds("for")?,
            speed: args.speed("speed")?,
            depth_max: Depth(args.number("deepest")?),
        }
        .into())
    }),
    needs: &[Need::Motor, Need::Home, Need::Contact, Need::Inside],
    gives: &[Need::Inside],
    is_measuring: true,
    label: "creep",
    ..StepFacts::of("hold-force", Phase::Creep, PauseBehaviour::Control)
};

impl StepKind for HoldForce {
    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_speed(self.speed);
        walk.check_depth(self.depth_max);
        walk.check_force(self.force);
        walk.check_span(self.duration);
        let secs = walk.secs(walk.ticks(self.duration.0));
        walk.reach =
            Reach { low: walk.reach.low.min(0.0), high: walk.reach.high.max(self.depth_max.0) };
        walk.expected.keep(walk.phase, secs);
        DurationEstimate(secs, secs + SETTLE_SECS, false)
    }

    fn force_counts_from(&self) -> Option<f64> {
        Some(0.5 * self.duration.0)
    }

    fn judge(&self, done: &mut StepResult<'_>) {
        done.force(self.force, done.mean_force());
        done.duration(self.duration, 0.0);
    }

    fn doubt(&self, _done: &StepResult<'_>) -> Option<String> {
        doubt_force(self.force)
    }
}

/// Milliseconds averaged before a correction: two to three mains cycles.
const FILTER_MS: u32 = 50;

/// Share of the error that a correction takes away if the tissue is as stiff as it is taken to be. Half stays far
/// below the factor of two at which corrections would grow.
const GAIN: f64 = 0.5;

/// Stiffness at first, as a multiple of the secant's: soft tissue stiffens with depth and with speed. The thesis body's
/// answer to a fast step is up to ten times its secant; the corrections find out.
const STIFFNESS_FIRST: f64 = 10.0;

/// Bounds of what the corrections may find, as multiples of the secant's stiffness.
const STIFFNESS_RANGE: [f64; 2] = [1.0, 50.0];

/// Share of a new finding in the stiffness; corrections of fewer pulses tell more of noise than of tissue.
const LEARN: f64 = 0.3;
const LEARN_PULSES: f64 = 4.0;

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ForceHoldRun {
    plan: HoldForce,
    until_tick: u64,
    /// No correction before this tick: the mean must be of the new position only.
    quiet_until: u64,
    /// Samples in the mean.
    filtered: u32,
    filter: MovingMean,
    /// Stiffness as a multiple of the secant's.
    stiffness: f64,
    /// Force before the correction under way and its length in mm.
    corrected: Option<(f64, f64)>,
}

impl Executable for HoldForce {
    type Run = ForceHoldRun;

    fn begin(&self, cx: &mut Context<'_>) -> Result<ForceHoldRun, String> {
        cx.contact()?;
        let rig = cx.rig();
        // In ticks, and in samples.
        let filtered = FILTER_MS * rig.samples_per_ms();
        let samples = rig.means_in(FILTER_MS as usize) * rig.samples_per_ms() as usize;
        Ok(ForceHoldRun {
            plan: *self,
            until_tick: cx.tick_after(self.duration),
            quiet_until: cx.tick() + u64::from(filtered),
            filtered,
            filter: MovingMean::new(samples),
            stiffness: STIFFNESS_FIRST,
            corrected: None,
        })
    }
}

impl RunningStep for ForceHoldRun {
    fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Result<Progress, String> {
        let force = cx.derived().force.unwrap_or(Newtons(0.0));
        let depth = cx.derived().depth.unwrap_or(Depth(0.0));
        let mean = Newtons(self.filter.push(force.0));
        if depth > self.plan.depth_max {
            return Err(format!(
                "the probe reached a depth of {depth:.2}, beyond the limit of {:.2}; check the specimen or allow a greater depth",
                self.plan.depth_max
            ));
        }
        if !cx.at_rest()? {
            self.quiet_until = reading.tick + u64::from(self.filtered);
            return Ok(Progress::Continue);
        }
        // A hold that is paused goes on, and goes on being controlled.
        if reading.tick >= self.until_tick && !cx.is_extended() {
            return Ok(Progress::Done);
        }
        if reading.tick < self.quiet_until {
            return Ok(Progress::Continue);
        }
        let error = self.plan.force - mean;
        // Secant stiffness; a probe hardly in the tissue counts as a tenth of a millimetre in.
        let secant = self.plan.force.0 / depth.0.max(0.1);
        if let Some((before, length)) = self.corrected.take() {
            let found = (mean.0 - before) / length / secant;
            let [least, most] = STIFFNESS_RANGE;
            self.stiffness += LEARN * (found.clamp(least, most) - self.stiffness);
        }
        let correction_mm = GAIN * error.0 / (self.stiffness * secant);
        let rig = cx.rig();
        let pulses = (correction_mm / rig.mm_per_pulse).round();
        if pulses != 0.0 {
            let to = cx.pulses() + pulses as i64;
            let end = Position(to as f64 * rig.mm_per_pulse);
            let end = Position(end.0.clamp(0.0, cx.limits().travel_max.0));
            cx.move_to(end, self.plan.speed)?;
            let length = pulses * cx.rig().mm_per_pulse;
            self.corrected = (pulses.abs() >= LEARN_PULSES).then_some((mean.0, length));
        }
        Ok(Progress::Continue)
    }
}
