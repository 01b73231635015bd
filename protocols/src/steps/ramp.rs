//! Indent to a depth at constant speed.

use super::prelude::*;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ramp {
    pub speed: MmPerS,
    /// Depth from contact.
    pub depth: Depth,
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Indent to a depth at constant speed.",
    keys: &[
        Key::needed("speed", QuantityKind::Speed, "indentation speed"),
        Key::needed("depth", QuantityKind::Length, "depth from contact"),
    ],
    build: Some(|args| {
        Ok(Ramp { speed: args.speed("speed")?, depth: Depth(args.number("depth")?) }.into())
    }),
    needs: FROM_SURFACE,
    gives: &[Need::Inside],
    is_measuring: true,
    ..StepFacts::of("ramp", Phase::Ramp, PauseBehaviour::Measure(INTERRUPTED))
};

/// Why an indentation does not go on after a pause.
pub(super) const INTERRUPTED: &str = "the tissue relaxes while an indentation is interrupted";

impl StepKind for Ramp {
    fn deepest(&self) -> Option<Depth> {
        Some(self.depth)
    }

    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_speed(self.speed);
        walk.check_depth(self.depth);
        walk.go(self.depth, self.speed)
    }

    fn is_cruising(&self, begun: f64, sample: &MeterSample, way: &dyn Fn(f64) -> f64) -> bool {
        sample.is_between(begun, self.depth.0, way(self.speed.0))
    }

    fn judge(&self, done: &mut StepResult<'_>) {
        done.speed(self.speed);
        done.depth(self.depth, self.speed);
    }
}

impl Executable for Ramp {
    type Run = MoveRun;

    fn begin(&self, cx: &mut Context<'_>) -> Result<MoveRun, String> {
        let target = cx.position_of(self.depth)?;
        cx.move_to(target, self.speed).map(|()| MoveRun)
    }
}
