//! Stay where the probe is and let the tissue recover.

use super::hold::{Hold, HoldRun};
use super::prelude::*;

/// Stay where the probe is and let the tissue recover.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rest {
    pub duration: Seconds,
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Keep the probe where it is while the tissue recovers.",
    keys: &[Key::needed("for", QuantityKind::Time, "duration").zero_allowed()],
    build: Some(|args| Ok(Rest { duration: args.seconds("for")? }.into())),
    may_touch: false,
    ..StepFacts::of("rest", Phase::Rest, PauseBehaviour::Wait)
};

impl StepKind for Rest {
    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_span(self.duration);
        walk.wait(self.duration)
    }

    fn judge(&self, done: &mut StepResult<'_>) {
        done.duration(self.duration, 0.0);
    }
}

impl Executable for Rest {
    type Run = HoldRun;

    fn begin(&self, cx: &mut Context<'_>) -> Result<HoldRun, String> {
        Hold::of(self.duration).begin(cx)
    }
}
