//! Move by a signed distance; allowed before homing.

use super::prelude::*;
use crate::engine::outside_travel;

/// Move by a signed distance; allowed before homing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Jog {
    /// Signed distance in mm, positive towards the tissue.
    pub distance_mm: f64,
    pub speed: MmPerS,
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Move by a signed distance. The axis need not be homed.",
    keys: &[
        Key::needed(
            "distance",
            QuantityKind::Length,
            "signed distance, positive towards the tissue",
        )
        .any(),
        Key::needed("speed", QuantityKind::Speed, "speed of the move"),
    ],
    build: Some(|args| {
        Ok(Jog { distance_mm: args.number("distance")?, speed: args.speed("speed")? }.into())
    }),
    needs: &[Need::Motor],
    ..StepFacts::of("jog", Phase::Jog, PauseBehaviour::RepeatFromStart)
};

impl StepKind for Jog {
    fn pass(&self, known: &mut Preconditions) {
        // From the surface a jog towards the tissue goes in.
        known.is_inside |= known.contact && self.may_touch();
    }

    fn may_touch(&self) -> bool {
        self.distance_mm > 0.0
    }

    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        let travel = walk.limits.travel_max.0;
        walk.check_sizes(&[self.distance_mm]);
        if self.distance_mm.abs() > travel {
            walk.refuse(format!(
                "a jog of {} mm is longer than the travel of {travel:.1} mm; give a shorter distance",
                self.distance_mm
            ));
        }
        walk.check_speed(self.speed);
        let pulse = walk.rig.mm_per_pulse;
        let moved = (self.distance_mm / pulse).round() * pulse;
        if self.may_touch() && walk.known.home {
            walk.check_travel("jog", moved);
        }
        let secs = walk.secs(walk.move_ticks(moved, self.speed));
        if walk.known.contact && !walk.is_refused() {
            walk.reach = walk.reach.moved_by(moved);
            let depth = Depth(walk.expected.depth() + moved);
            walk.expected.go(walk.phase, depth.0, secs);
        } else {
            walk.expected.stay(walk.phase, secs);
        }
        DurationEstimate(secs, secs, walk.is_answer_exact())
    }
}

impl Executable for Jog {
    type Run = MoveRun;

    fn begin(&self, cx: &mut Context<'_>) -> Result<MoveRun, String> {
        let to = cx.pulses() + cx.pulses_of(self.distance_mm);
        let end = Position(to as f64 * cx.rig().mm_per_pulse);
        let travel = cx.limits().travel_max;
        // Where home is unknown the switches are all there is; a jog that comes back is always allowed.
        if cx.is_homed() && self.may_touch() && end > travel {
            return Err(outside_travel("jog", end, travel));
        }
        cx.move_to_pulses(to, self.speed).map(|()| MoveRun)
    }
}
