//! A slave that follows: find the tissue, go where it is led, leave.

use super::ramp_hold::{LEAVE_TISSUE, TARE, approach_steps};
use super::{FindContact, Follow, Plan, Step};
use palpate_model::rig::RigDescription;
use palpate_model::units::{Depth, MmPerS, Seconds};

/// How much faster than the hand its moves are: one from rest to rest goes at twice its mean speed on the way, and the
/// controller's answers take time as well.
const FASTER: f64 = 3.0;

impl Follow {
    /// A slave on a rig that keeps up with a hand, as far as the rig is fast enough.
    #[must_use]
    pub fn of_hand(
        rig: &RigDescription,
        hand: MmPerS,
        depth_max: Depth,
        duration: Seconds,
    ) -> Self {
        let quantum = rig.speed_quantum.0;
        let most = (rig.speed_max.0 / quantum + 1e-6).floor();
        let steps = (FASTER * hand.0 / quantum).round();
        Self { duration, speed: MmPerS(steps.clamp(1.0, most.max(1.0)) * quantum), depth_max }
    }

    #[must_use]
    pub fn plan(self) -> Plan {
        let mut steps = approach_steps(TARE, FindContact::default());
        steps.extend([Step::Follow(self), LEAVE_TISSUE]);
        Plan::of("slave", 1, steps)
    }
}
