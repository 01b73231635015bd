//! The live fit of a run, fed sample by sample. A panic in it switches it off and stops nothing else.

use palpate_model::estimate::LiveEstimate;
use palpate_model::panics::catch_panic;
use palpate_model::rig::{Phase, Reading};
use palpate_model::units::{Depth, Newtons, Seconds};
use palpate_protocols::engine::{EngineConfig, EngineState};
use palpate_rheology::fit::LiveFit;
use std::any::Any;

/// Milliseconds between two answers of the live fit.
const LIVE_FIT_MS: u64 = 500;

/// The live fit, or a test's stand-in.
pub(super) trait Estimator: Send {
    fn push(&mut self, t: Seconds, depth: Depth, force: Newtons, sigma: Newtons);
    fn estimate(&self) -> Option<LiveEstimate>;
}

impl Estimator for LiveFit {
    fn push(&mut self, t: Seconds, depth: Depth, force: Newtons, sigma: Newtons) {
        Self::push(self, t, depth, force, sigma);
    }

    fn estimate(&self) -> Option<LiveEstimate> {
        Self::estimate(self)
    }
}

pub(super) type MakeEstimator = fn(Depth) -> Box<dyn Estimator>;

/// Feeds ramp and hold to the live fit and says when it has a new answer.
pub(crate) struct LiveFeed {
    make: MakeEstimator,
    /// `None` after a failure.
    fit: Option<Box<dyn Estimator>>,
    /// The failure, until it is taken.
    failure: Option<String>,
    first_tick: Option<u64>,
    tick_secs: f64,
    samples: u64,
    every: u64,
    deepest: Depth,
    cycle: u32,
}

impl LiveFeed {
    pub fn new(config: &EngineConfig) -> Self {
        Self::with(config, |deepest| Box::new(LiveFit::new(deepest)))
    }

    pub(super) fn with(config: &EngineConfig, make: MakeEstimator) -> Self {
        Self {
            make,
            fit: Some(make(deepest(config))),
            failure: None,
            deepest: deepest(config),
            cycle: 1,
            first_tick: None,
            tick_secs: config.rig.tick().0,
            samples: 0,
            every: LIVE_FIT_MS * u64::from(config.rig.samples_per_ms()),
        }
    }

    /// Takes a sample after the engine did; every half second there is an answer.
    pub fn push(&mut self, reading: &Reading, state: &EngineState) -> Option<LiveEstimate> {
        let derived = state.derived();
        if !matches!(state.phase(), Phase::Ramp | Phase::Hold) {
            return None;
        }
        let (depth, force, sigma) = (derived.depth?, derived.force?, derived.force_sigma?);
        // Every repeat is fitted by itself: the tissue has rested, or it has changed.
        if state.cycle() != self.cycle {
            self.cycle = state.cycle();
            self.fit = self.fit.take().map(|_| (self.make)(self.deepest));
            self.first_tick = None;
            self.samples = 0;
        }
        let first_tick = *self.first_tick.get_or_insert(reading.tick);
        let t = Seconds((reading.tick - first_tick) as f64 * self.tick_secs);
        self.samples += 1;
        let is_due = self.samples.is_multiple_of(self.every);
        let fit = self.fit.as_mut()?;
        let fed = catch_panic(|| {
            fit.push(t, depth, force, sigma);
            is_due.then(|| fit.estimate()).flatten()
        });
        fed.unwrap_or_else(|panic| {
            // Its state may be inconsistent: it is not used again.
            self.fit = None;
            self.failure = Some(format!(
                "the live fit failed ({}) and is off for the rest of the run; the recording continues",
                words(panic.as_ref())
            ));
            None
        })
    }

    /// Why the fit is off, once.
    pub fn take_failure(&mut self) -> Option<String> {
        self.failure.take()
    }
}

fn words(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no reason given")
}

/// The deepest point of the plan: the scale of the fit's basis.
fn deepest(config: &EngineConfig) -> Depth {
    let depths = config.plan.steps.iter();
    let depths = depths.filter_map(|planned| planned.step.deepest());
    let deepest = depths.fold(0.0f64, |deepest, depth| deepest.max(depth.0));
    Depth(if deepest > 0.0 { deepest } else { 1.0 })
}
