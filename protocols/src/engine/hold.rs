//! A hold that may end early: decided from the recorded answer of the live fit, or from the slope of the
//! force, and nothing else.

use super::context::{Context, Progress};
use super::input::Record;
use super::state::{Active, Activity};
use crate::plans::{HoldRate, HoldUntil, Step};
use palpate_model::fit::LiveEstimate;
use palpate_model::rig::Reading;
use palpate_model::units::Seconds;
use std::collections::VecDeque;

/// Points of a window over which a slope is fitted: enough for a line, few enough to fit on every point.
const SLOPE_POINTS: usize = 20;

/// Data of a hold in progress.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Holding {
    begun_tick: u64,
    until_tick: u64,
    slope: Option<Slope>,
}

/// The force's slope over the newest window, from means of equal stretches of it.
#[derive(Clone, Debug, PartialEq)]
struct Slope {
    rule: HoldRate,
    samples_per_point: u64,
    /// Sum and count of the point that is being averaged.
    sum: f64,
    count: u64,
    points: VecDeque<f64>,
}

impl Slope {
    fn new(rule: HoldRate, window_ticks: u64) -> Self {
        Self {
            rule,
            samples_per_point: (window_ticks / SLOPE_POINTS as u64).max(1),
            sum: 0.0,
            count: 0,
            points: VecDeque::with_capacity(SLOPE_POINTS),
        }
    }

    /// Takes a force; the slope in N/s whenever a point is complete and the window full.
    fn push(&mut self, force: f64, tick: Seconds) -> Option<f64> {
        self.sum += force;
        self.count += 1;
        if self.count < self.samples_per_point {
            return None;
        }
        if self.points.len() == SLOPE_POINTS {
            self.points.pop_front();
        }
        self.points.push_back(self.sum / self.count as f64);
        (self.sum, self.count) = (0.0, 0);
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
        Some(top / bottom / (self.samples_per_point as f64 * tick.0))
    }
}

impl Holding {
    pub fn begin(cx: &Context<'_>, duration: Seconds, rate: Option<HoldRate>) -> Self {
        let slope = rate.map(|rule| Slope::new(rule, cx.state.ticks(rule.over)));
        Self {
            begun_tick: cx.state.tick,
            until_tick: cx.state.tick + cx.state.ticks(duration),
            slope,
        }
    }

    pub fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Progress {
        let tick = cx.state.config.rig.tick();
        if let (Some(slope), Some(force)) = (&mut self.slope, cx.state.derived.force)
            && reading.tick < self.until_tick
            && let Some(now) = slope.push(force.0, tick)
            && now.abs() < slope.rule.below_n_per_s
        {
            self.until_tick = reading.tick;
            let held = Seconds((reading.tick - self.begun_tick) as f64 * tick.0);
            cx.record(Record::HoldSteady {
                slope_n_per_s: now,
                held,
            });
        }
        if reading.tick >= self.until_tick {
            Progress::Done
        } else {
            Progress::Continue
        }
    }
}

/// Lets the hold end with the next sample if its rule is met by the newest answer.
pub(super) fn on_live_fit(cx: &mut Context<'_>) {
    let Some(Step::Hold {
        duration,
        until: Some(rule),
        ..
    }) = cx.state.current_step()
    else {
        return;
    };
    let (duration, rule) = (*duration, *rule);
    let Some(reached) = cx.state.live.as_ref().and_then(|live| reached(live, &rule)) else {
        return;
    };
    let (now_tick, span) = (cx.state.tick, cx.state.ticks(duration));
    let at_least = cx.state.ticks(rule.at_least);
    let Activity::Step(Active::Hold(hold)) = &mut cx.state.activity else {
        return;
    };
    let held_ticks = (now_tick + span).saturating_sub(hold.until_tick);
    if now_tick >= hold.until_tick || held_ticks < at_least {
        return;
    }
    hold.until_tick = now_tick;
    cx.record(Record::HoldEndedEarly {
        parameter: rule.parameter,
        relative: reached,
        wanted: rule.relative,
        held: Seconds(held_ticks as f64 * cx.state.config.rig.tick().0),
    });
}

/// Half of the parameter's 95 % interval as a share of its value, if that is narrow enough and the
/// parameter identified.
fn reached(live: &LiveEstimate, rule: &HoldUntil) -> Option<f64> {
    let parameter = live.identified(rule.parameter.name())?;
    let [low, high] = parameter.ci95?;
    let relative = 0.5 * (high - low) / parameter.value.abs();
    (relative <= rule.relative).then_some(relative)
}
