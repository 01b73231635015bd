//! Come back to the surface at constant speed, as carefully recorded as the way in.

use super::known::FROM_SURFACE;
use super::{Done, Executable, Facts, MeterSample, Moving, Need, Pausing, StepKind};
use crate::engine::Context;
use crate::file::{Key, Kind};
use crate::preview::{Span, Walk};
use palpate_model::rig::Phase;
use palpate_model::units::{Depth, MmPerS};
use serde::{Deserialize, Serialize};

/// Come back to the surface at constant speed, as carefully recorded as the way in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unload {
    /// Speed of the way back.
    pub speed: MmPerS,
    /// Distance from contact to stop at, in mm: where the force is surely gone.
    pub clearance_mm: f64,
}

pub(super) const FACTS: Facts = Facts {
    about: "Come back to the surface at constant speed, recorded like the way in.",
    keys: &[
        Key::needed("speed", Kind::Speed, "of the way back"),
        Key::usual("clearance", Kind::Length, "0.5 mm", "distance from the surface to stop at")
            .zero_allowed(),
    ],
    build: Some(|args| {
        Ok(Unload { speed: args.speed("speed")?, clearance_mm: args.number("clearance")? }.into())
    }),
    needs: FROM_SURFACE,
    gives: &[Need::Outside],
    may_touch: false,
    is_measuring: true,
    ..Facts::of(
        "unload",
        Phase::Unload,
        Pausing::Measure("an interrupted unloading is another experiment"),
    )
};

impl StepKind for Unload {
    fn expect(&self, walk: &mut Walk<'_>) -> Span {
        walk.check_sizes(&[self.clearance_mm]);
        walk.check_speed(self.speed);
        walk.leave(self.clearance_mm, self.speed)
    }

    fn is_cruising(&self, begun: f64, sample: &MeterSample, way: &dyn Fn(f64) -> f64) -> bool {
        sample.is_between(begun, -self.clearance_mm, way(self.speed.0))
    }

    fn judge(&self, done: &mut Done<'_>) {
        done.speed(self.speed);
        done.depth(Depth(-self.clearance_mm), self.speed);
    }
}

impl Executable for Unload {
    type Run = Moving;

    fn begin(&self, cx: &mut Context<'_>) -> Result<Moving, String> {
        cx.leave(self.clearance_mm, self.speed)?;
        Ok(Moving)
    }
}
