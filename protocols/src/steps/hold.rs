//! Stay at depth while the force relaxes. A hold may end early: decided from the recorded answer of the live fit, or
//! from the slope of the force, and nothing else.

use super::prelude::*;
use crate::plans::{HoldRate, HoldUntil};
use palpate_model::estimate::LiveEstimate;
use std::collections::VecDeque;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hold {
    /// How long, at most.
    pub duration: Seconds,
    /// End it once a parameter is known well enough.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<HoldUntil>,
    /// End it once the force hardly changes any more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<HoldRate>,
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Keep the probe at its depth while the force relaxes.",
    keys: &[
        Key::needed("for", QuantityKind::Time, "longest duration").zero_allowed(),
        Key::optional(
            "until",
            QuantityKind::Text,
            "ends the hold once a parameter is known within this share of its value, such as `\"tau=1%\"`",
        ),
        Key::optional(
            "slope",
            QuantityKind::ForceRate,
            "ends the hold once the force changes more slowly than this",
        ),
        Key::optional(
            "over",
            QuantityKind::Time,
            "time over which the slope is measured; required with `slope`",
        ),
    ],
    build: Some(read),
    may_touch: false,
    ..StepFacts::of("hold", Phase::Hold, PauseBehaviour::Wait)
};

fn read(args: &Args) -> Result<Step, String> {
    let until = args.maybe_text("until").map(HoldUntil::parse).transpose()?;
    let rate = match (args.maybe("slope"), args.maybe("over")) {
        (Some(below_n_per_s), Some(over)) => Some(HoldRate { below_n_per_s, over: Seconds(over) }),
        (None, None) => None,
        _ => {
            let message =
                "'slope' and 'over' belong together; give both the slope and the time, or neither";
            return Err(message.into());
        }
    };
    rate.map_or(Ok(()), |rule| rule.check())?;
    let duration = args.seconds("for")?;
    Ok(Hold { duration, until, rate }.into())
}

impl Hold {
    #[must_use]
    pub const fn of(duration: Seconds) -> Self {
        Self { duration, until: None, rate: None }
    }

    fn check_rule(&self, rule: &HoldUntil, walk: &mut Walk<'_>) {
        match rule.check() {
            Err(reason) => walk.refuse(reason),
            Ok(()) if rule.at_least < self.duration => walk.notes.push(format!(
                "the hold ends as soon as {rule}, after {:.0} at the earliest",
                rule.at_least
            )),
            Ok(()) => walk.notes.push(format!(
                "the hold is too short to end early; an early end needs at least {:.0}",
                rule.at_least
            )),
        }
    }
}

impl StepKind for Hold {
    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_span(self.duration);
        if let Some(rule) = &self.until {
            self.check_rule(rule, walk);
        }
        if let Some(rule) = self.rate {
            walk.refusals.extend(rule.check().err());
            walk.notes.push(format!("the hold ends as soon as {rule}"));
        }
        let DurationEstimate(expected, longest, _) = walk.wait(self.duration);
        let is_exact = self.until.is_none() && self.rate.is_none();
        DurationEstimate(expected, longest, is_exact)
    }

    fn judge(&self, done: &mut StepResult<'_>) {
        done.duration(self.duration, 0.0);
    }
}

/// Points of a window over which a slope is fitted: enough for a line, few enough to fit on every point.
const SLOPE_POINTS: usize = 20;

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HoldRun {
    plan: Hold,
    begun_tick: u64,
    until_tick: u64,
    slope: Option<Slope>,
}

/// The force's slope over the newest window, from means of equal stretches of it.
#[derive(Clone, Debug, PartialEq)]
struct Slope {
    rule: HoldRate,
    /// Samples in one point.
    samples: u32,
    point: BlockMean<1>,
    points: VecDeque<f64>,
}

impl Slope {
    fn new(rule: HoldRate, window_ticks: u64) -> Self {
        // A window is an hour at most.
        let samples = (window_ticks / SLOPE_POINTS as u64).max(1) as u32;
        let points = VecDeque::with_capacity(SLOPE_POINTS);
        Self { rule, samples, point: BlockMean::new(samples), points }
    }

    /// The slope in N/s whenever a point is complete and the window full.
    fn push(&mut self, force: f64, tick: Seconds) -> Option<f64> {
        let [mean] = self.point.push([force])?;
        if self.points.len() == SLOPE_POINTS {
            self.points.pop_front();
        }
        self.points.push_back(mean);
        if self.points.len() < SLOPE_POINTS {
            return None;
        }
        // Least squares over equally spaced points: sum (i - mean) F_i / sum (i - mean)^2.
        let mean = (SLOPE_POINTS as f64 - 1.0) / 2.0;
        let points = self.points.iter().enumerate();
        let (top, bottom) = points.fold((0.0, 0.0), |(top, bottom), (i, force)| {
            let x = i as f64 - mean;
            (top + x * force, bottom + x * x)
        });
        Some(top / bottom / (f64::from(self.samples) * tick.0))
    }
}

impl Executable for Hold {
    type Run = HoldRun;

    fn begin(&self, cx: &mut Context<'_>) -> Result<HoldRun, String> {
        let slope = self.rate.map(|rule| Slope::new(rule, cx.ticks(rule.over)));
        Ok(HoldRun {
            plan: *self,
            begun_tick: cx.tick(),
            until_tick: cx.tick_after(self.duration),
            slope,
        })
    }
}

impl RunningStep for HoldRun {
    fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Result<Progress, String> {
        let tick = cx.rig().tick();
        if let (Some(slope), Some(force)) = (&mut self.slope, cx.derived().force)
            && reading.tick < self.until_tick
            && let Some(now) = slope.push(force.0, tick)
            && now.abs() < slope.rule.below_n_per_s
        {
            self.until_tick = reading.tick;
            let held = Seconds((reading.tick - self.begun_tick) as f64 * tick.0);
            cx.record(Record::HoldSteady { slope_n_per_s: now, held });
        }
        Ok(Progress::done_if(reading.tick >= self.until_tick))
    }

    /// Lets the hold end with the next sample if its rule is met by the newest answer of the live fit.
    fn on_event(&mut self, cx: &mut Context<'_>, event: &StepEvent) -> Option<Progress> {
        let (StepEvent::LiveFit, Some(rule)) = (event, self.plan.until) else {
            return None;
        };
        let relative = cx.live().and_then(|live| reached(live, &rule))?;
        let now_tick = cx.tick();
        let held_ticks = (now_tick + cx.ticks(self.plan.duration)).saturating_sub(self.until_tick);
        if now_tick >= self.until_tick || held_ticks < cx.ticks(rule.at_least) {
            return None;
        }
        self.until_tick = now_tick;
        cx.record(Record::HoldEndedEarly {
            parameter: rule.parameter,
            relative,
            wanted: rule.relative,
            held: Seconds(held_ticks as f64 * cx.rig().tick().0),
        });
        Some(Progress::Continue)
    }
}

/// Half of the parameter's 95 % interval as a share of its value, if that is narrow enough and the
/// parameter identified.
fn reached(live: &LiveEstimate, rule: &HoldUntil) -> Option<f64> {
    let parameter = live.identified_parameter(rule.parameter.name())?;
    let [low, high] = parameter.ci95?;
    let relative = 0.5 * (high - low) / parameter.value.abs();
    (relative <= rule.relative).then_some(relative)
}
