//! Unload to the surface at constant speed, recorded as the loading is.

use super::prelude::*;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unload {
    pub speed: MmPerS,
    /// Distance from contact in mm, where the force is zero with certainty.
    pub clearance_mm: f64,
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Unload to the surface at constant speed. The unloading is recorded like the loading.",
    keys: &[
        Key::needed("speed", QuantityKind::Speed, "unloading speed"),
        Key::usual(
            "clearance",
            QuantityKind::Length,
            "0.5 mm",
            "distance from the surface at which the probe stops",
        )
        .zero_allowed(),
    ],
    build: Some(|args| {
        Ok(Unload { speed: args.speed("speed")?, clearance_mm: args.number("clearance")? }.into())
    }),
    needs: FROM_SURFACE,
    gives: &[Need::Outside],
    may_touch: false,
    is_measuring: true,
    ..StepFacts::of(
        "unload",
        Phase::Unload,
        PauseBehaviour::Measure("the tissue relaxes while an unloading is interrupted"),
    )
};

impl StepKind for Unload {
    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_sizes(&[self.clearance_mm]);
        walk.check_speed(self.speed);
        walk.leave(self.clearance_mm, self.speed)
    }

    fn is_cruising(&self, begun: f64, sample: &MeterSample, way: &dyn Fn(f64) -> f64) -> bool {
        sample.is_between(begun, -self.clearance_mm, way(self.speed.0))
    }

    fn judge(&self, done: &mut StepResult<'_>) {
        done.speed(self.speed);
        done.depth(Depth(-self.clearance_mm), self.speed);
    }
}

impl Executable for Unload {
    type Run = MoveRun;

    fn begin(&self, cx: &mut Context<'_>) -> Result<MoveRun, String> {
        cx.leave(self.clearance_mm, self.speed).map(|()| MoveRun)
    }
}
