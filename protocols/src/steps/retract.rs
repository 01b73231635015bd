//! Leave the tissue.

use super::known::FROM_SURFACE;
use super::{Executable, Facts, Moving, Need, Pausing, StepKind};
use crate::engine::Context;
use crate::file::{Key, Kind};
use crate::preview::{Span, Walk};
use palpate_model::rig::Phase;
use palpate_model::units::MmPerS;
use serde::{Deserialize, Serialize};

/// Leave the tissue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Retract {
    /// Speed of the way out.
    pub speed: MmPerS,
    /// Distance from contact to stop at, in mm.
    pub clearance_mm: f64,
}

pub(super) const FACTS: Facts = Facts {
    about: "Leave the tissue.",
    keys: &[
        Key::usual("speed", Kind::Speed, "6 mm/s", "of the way out"),
        Key::usual("clearance", Kind::Length, "10 mm", "distance from the surface to stop at")
            .zero_allowed(),
    ],
    build: Some(|args| {
        Ok(Retract { speed: args.speed("speed")?, clearance_mm: args.number("clearance")? }.into())
    }),
    needs: FROM_SURFACE,
    gives: &[Need::Outside],
    may_touch: false,
    ..Facts::of("retract", Phase::Retract, Pausing::Repeat)
};

impl StepKind for Retract {
    fn expect(&self, walk: &mut Walk<'_>) -> Span {
        walk.check_sizes(&[self.clearance_mm]);
        walk.check_speed(self.speed);
        walk.leave(self.clearance_mm, self.speed)
    }
}

impl Executable for Retract {
    type Run = Moving;

    fn begin(&self, cx: &mut Context<'_>) -> Result<Moving, String> {
        cx.leave(self.clearance_mm, self.speed)?;
        Ok(Moving)
    }
}
