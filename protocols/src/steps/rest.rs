//! Stay where the probe is and let the tissue recover.

use super::{Done, Executable, Facts, InProgress, Pausing, Progress, StepKind};
use crate::engine::Context;
use crate::file::{Key, Kind};
use crate::preview::{Span, Walk};
use palpate_model::rig::{Phase, Reading};
use palpate_model::units::Seconds;
use serde::{Deserialize, Serialize};

/// Stay where the probe is and let the tissue recover.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rest {
    /// How long.
    pub duration: Seconds,
}

pub(super) const FACTS: Facts = Facts {
    about: "Stay where the probe is and let the tissue recover.",
    keys: &[Key::needed("for", Kind::Time, "how long").zero_allowed()],
    build: Some(|args| {
        let duration = args.seconds("for")?;
        Ok(Rest { duration }.into())
    }),
    may_touch: false,
    ..Facts::of("rest", Phase::Rest, Pausing::Wait)
};

impl StepKind for Rest {
    fn expect(&self, walk: &mut Walk<'_>) -> Span {
        walk.check_span(self.duration);
        walk.wait(self.duration)
    }

    fn judge(&self, done: &mut Done<'_>) {
        done.duration(self.duration, 0.0);
    }
}

impl Executable for Rest {
    type Run = Resting;

    fn begin(&self, cx: &mut Context<'_>) -> Result<Resting, String> {
        let until_tick = cx.tick_after(self.duration);
        Ok(Resting { until_tick })
    }
}

/// A rest in progress: stay until this controller tick.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Resting {
    until_tick: u64,
}

impl InProgress for Resting {
    fn on_reading(&mut self, _cx: &mut Context<'_>, reading: &Reading) -> Result<Progress, String> {
        Ok(match reading.tick >= self.until_tick {
            true => Progress::Done,
            false => Progress::Continue,
        })
    }
}
