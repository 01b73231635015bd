//! Indentation to a force: at constant speed, early by what stopping adds, or slower and slower.

use super::context::{Context, Progress};
use super::input::Record;
use crate::plans::LoadTo;
use palpate_model::signal::MovingMean;
use palpate_model::units::{Depth, MmPerS, Newtons, Position};

/// Milliseconds averaged before the force is compared: short beside any ramp, and at a sample each noise falls to a
/// third.
const FILTER_MS: usize = 10;

/// Milliseconds from a sample to the axis's first answer: report 1.0 to 1.5 ms, command 0.5 ms, the next tick of a
/// rig with one a millisecond.
const ANSWER_MS: usize = 3;

/// Shares of the speed in the stages of a braked approach, and of the brake force at which each ends.
const STAGES: [(f64, f64); 3] = [(1.0, 1.0), (0.1, 0.1), (0.01, 0.0)];

/// Data of an indentation to a force.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Loading {
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

impl Loading {
    pub fn begin(cx: &mut Context<'_>, plan: LoadTo) -> Result<Self, String> {
        let rig = &cx.state.config.rig;
        // Ten at most.
        let samples =
            [FILTER_MS, ANSWER_MS].map(|ms| rig.means_in(ms) as u32 * rig.samples_per_ms());
        let mut loading = Self {
            plan,
            // Without a brake there is only the last stage, at full speed.
            stage: if plan.brake.is_some() {
                0
            } else {
                STAGES.len() - 1
            },
            is_stopping: false,
            samples,
            filter: MovingMean::new(samples[0] as usize),
            before: None,
            slope: 0.0,
        };
        if let Some(depth) = cx.state.derived.depth {
            loading
                .plan
                .check_from(depth, cx.state.config.rig.mm_per_pulse)?;
        }
        loading.go(cx)?;
        Ok(loading)
    }

    fn speed(&self, cx: &Context<'_>) -> MmPerS {
        if self.plan.brake.is_none() {
            return self.plan.speed;
        }
        let quantum = cx.state.config.rig.speed_quantum.0;
        let wanted = self.plan.speed.0 * STAGES[self.stage].0;
        MmPerS((wanted / quantum).round().max(1.0) * quantum)
    }

    fn target(&self) -> Newtons {
        let brake = self.plan.brake.map_or(0.0, |brake| brake.0);
        Newtons(self.plan.force.0 - brake * STAGES[self.stage].1)
    }

    /// Sends the axis on at the speed of the stage.
    fn go(&mut self, cx: &mut Context<'_>) -> Result<(), String> {
        let contact = cx
            .state
            .contact
            .ok_or("contact is not known; find it first")?;
        let deepest = self.plan.depth_max.position_from(contact.position);
        let end = Position(deepest.0.min(cx.state.config.limits.travel_max.0));
        self.is_stopping = false;
        cx.move_to(end, self.speed(cx))
    }

    pub fn on_reading(&mut self, cx: &mut Context<'_>) -> Progress {
        match self.advance(cx) {
            Ok(progress) => progress,
            Err(reason) => Progress::Fail(format!("load: {reason}")),
        }
    }

    fn advance(&mut self, cx: &mut Context<'_>) -> Result<Progress, String> {
        let Some(force) = cx.state.derived.force else {
            return Err("the load cell is not tared; tare it first".into());
        };
        let rig = &cx.state.config.rig;
        // From sample to sample.
        let tick = rig.tick().0 * rig.ticks_per_sample.max(1.0);
        let [filtered, answer] = self.samples.map(f64::from);
        let mean = self.filter.push(force.0);
        if let Some(before) = self.before {
            // Smoothed over the filter's own length: the slope of a mean is as noisy as one sample.
            self.slope += ((mean - before) / tick - self.slope) / filtered;
        }
        self.before = Some(mean);
        let depth = cx.state.derived.depth.unwrap_or(Depth(0.0));
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
        let speed = cx.state.derived.velocity.0;
        let braking = speed / (2.0 * cx.state.config.rig.acceleration.0);
        // The mean lags by half its length; then come the answer and the way of the deceleration.
        let ahead = (0.5 * filtered + answer) * tick + braking;
        if mean + self.slope.max(0.0) * ahead >= self.target().0 {
            if !at_rest {
                cx.stop_move();
            }
            self.is_stopping = true;
        } else if at_rest {
            return Err(format!(
                "{:.3} was not reached before {depth:.2}; the force there is {:.3}; check the specimen or allow a greater depth",
                self.plan.force,
                Newtons(mean)
            ));
        }
        Ok(Progress::Continue)
    }
}
