//! The source of leads for a slave: it gets every sample, and its newest lead goes to the engine at the runner's pace.

use palpate_model::Nanos;
use palpate_model::rig::{Phase, Reading};
use palpate_model::units::{Depth, Newtons};
use palpate_protocols::engine::EngineState;
use std::fmt::Debug;
use std::sync::{Arc, Mutex, PoisonError};

/// Time between two leads that go to the engine: short beside a move, which the axis ends before it takes another.
const LEAD_EVERY: Nanos = Nanos::from_millis(5);

/// What the rig measured with one sample of a slave that follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlaveSample {
    /// When it was taken, by the controller's clock, from any start.
    pub at: Nanos,
    pub depth: Depth,
    /// Force on its cell above tare.
    pub force: Newtons,
    /// Standard uncertainty of that force.
    pub sigma: Newtons,
}

/// Called on the runner's thread with every sample of a step that follows.
pub trait LeadSource: Debug + Send {
    /// Takes a sample; where the slave is to be now, in mm from contact, or `None` where there is nothing
    /// new of what leads. Must not wait.
    fn lead(&mut self, sample: &SlaveSample) -> Option<f64>;
}

/// Shared, so that its results can be read after the run.
pub type SharedLeadSource = Arc<Mutex<dyn LeadSource>>;

#[derive(Debug)]
pub(super) struct LeadFeed {
    leader: Option<SharedLeadSource>,
    last: Option<Nanos>,
}

impl LeadFeed {
    pub fn new(leader: Option<SharedLeadSource>) -> Self {
        Self { leader, last: None }
    }

    /// Takes a sample after the engine; a lead for the engine if one is due, empty where it is not finite.
    pub fn push(
        &mut self,
        now: Nanos,
        reading: &Reading,
        state: &EngineState,
    ) -> Option<Option<Depth>> {
        let leader = self.leader.as_ref()?;
        let derived = state.derived();
        if state.phase() != Phase::Follow {
            return None;
        }
        let sample = SlaveSample {
            at: Nanos(reading.tick.saturating_mul(state.config().rig.tick_nanos)),
            depth: derived.depth?,
            force: derived.force?,
            sigma: derived.force_sigma?,
        };
        let mut leader = leader.lock().unwrap_or_else(PoisonError::into_inner);
        let place = leader.lead(&sample)?;
        let is_due = self.last.is_none_or(|last| now.since(last) >= LEAD_EVERY);
        is_due.then(|| {
            self.last = Some(now);
            Some(Depth(place)).filter(|depth| depth.0.is_finite())
        })
    }
}
