//! Leave the tissue.

use super::prelude::*;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Retract {
    pub speed: MmPerS,
    /// Distance from contact to stop at, in mm.
    pub clearance_mm: f64,
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Leave the tissue.",
    keys: &[
        Key::usual("speed", QuantityKind::Speed, "6 mm/s", "speed of the retract"),
        Key::usual(
            "clearance",
            QuantityKind::Length,
            "10 mm",
            "distance from the surface at which the probe stops",
        )
        .zero_allowed(),
    ],
    build: Some(|args| {
        Ok(Retract { speed: args.speed("speed")?, clearance_mm: args.number("clearance")? }.into())
    }),
    needs: FROM_SURFACE,
    gives: &[Need::Outside],
    may_touch: false,
    ..StepFacts::of("retract", Phase::Retract, PauseBehaviour::Repeat)
};

impl StepKind for Retract {
    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_sizes(&[self.clearance_mm]);
        walk.check_speed(self.speed);
        walk.leave(self.clearance_mm, self.speed)
    }
}

impl Executable for Retract {
    type Run = MoveRun;

    fn begin(&self, cx: &mut Context<'_>) -> Result<MoveRun, String> {
        cx.leave(self.clearance_mm, self.speed).map(|()| MoveRun)
    }
}
