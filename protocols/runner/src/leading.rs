//! What leads a slave from outside, and what it is told: the newest of each, at the runner's own pace.

use palpate_model::Nanos;
use palpate_model::rig::{Phase, Reading};
use palpate_model::units::{Depth, Newtons};
use palpate_protocols::engine::State;
use std::fmt::Debug;
use std::sync::{Arc, Mutex, PoisonError};

/// Time between two leads that go to the engine: short beside a move, which the axis ends before it takes another.
const LEAD_EVERY: Nanos = Nanos::from_millis(5);

/// What the rig measured with one sample of a slave that follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Felt {
    /// When it was taken, by the controller's clock, from any start.
    pub at: Nanos,
    /// Depth of the slave.
    pub depth: Depth,
    /// Force on its cell above tare.
    pub force: Newtons,
    /// Standard uncertainty of that force.
    pub sigma: Newtons,
}

/// What leads a slave. It is asked on the runner's thread, with every sample of a step that follows.
pub trait Leading: Debug + Send {
    /// Takes what was felt and tells where the slave is to be now, in mm from contact; none where there is nothing
    /// new of what leads. Must not wait.
    fn lead(&mut self, felt: &Felt) -> Option<f64>;
}

/// What leads, shared with whoever asks it for results after the run.
pub type Leader = Arc<Mutex<dyn Leading>>;

/// Asks what leads a run.
#[derive(Debug)]
pub(super) struct LeadFeed {
    leader: Option<Leader>,
    last: Option<Nanos>,
}

impl LeadFeed {
    pub fn new(leader: Option<Leader>) -> Self {
        Self { leader, last: None }
    }

    /// Takes a sample after the engine did; a lead for the engine, if one is due. What is no number is none.
    pub fn push(&mut self, now: Nanos, reading: &Reading, state: &State) -> Option<Option<Depth>> {
        let leader = self.leader.as_ref()?;
        let derived = state.derived();
        if state.phase() != Phase::Follow {
            return None;
        }
        let felt = Felt {
            at: Nanos(reading.tick.saturating_mul(state.config().rig.tick_nanos)),
            depth: derived.depth?,
            force: derived.force?,
            sigma: derived.force_sigma?,
        };
        let mut leader = leader.lock().unwrap_or_else(PoisonError::into_inner);
        let place = leader.lead(&felt)?;
        let is_due = self.last.is_none_or(|last| now.since(last) >= LEAD_EVERY);
        is_due.then(|| {
            self.last = Some(now);
            Some(Depth(place)).filter(|depth| depth.0.is_finite())
        })
    }
}
