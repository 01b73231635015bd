//! Touch the home switch again and say how many pulses were missed.

use super::home::{Home, Homing, KEYS, Purpose};
use super::{Executable, Facts, Need, Pausing, StepKind};
use crate::engine::Context;
use crate::preview::{CONTACT_EXPECTED_SHARE, Reach, Span, Walk};
use palpate_model::rig::Phase;
use palpate_model::units::MmPerS;
use serde::{Deserialize, Serialize};

/// Touch the home switch again and say how many pulses were missed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckHome {
    /// Speed of the search.
    pub speed: MmPerS,
    /// Speed of the second touch.
    pub touch_speed: MmPerS,
}

pub(super) const FACTS: Facts = Facts {
    about: "Touch the home switch again and tell how many pulses were missed.",
    keys: KEYS,
    build: Some(|args| {
        let Home { speed, touch_speed } = Home::read(args)?;
        Ok(CheckHome { speed, touch_speed }.into())
    }),
    needs: &[Need::Motor, Need::Home],
    gives: &[Need::Outside],
    may_touch: false,
    label: "home",
    ..Facts::of("check-home", Phase::CheckHome, Pausing::Repeat)
};

impl CheckHome {
    fn search(&self) -> Home {
        Home { speed: self.speed, touch_speed: self.touch_speed }
    }
}

impl StepKind for CheckHome {
    fn expect(&self, walk: &mut Walk<'_>) -> Span {
        let travel = walk.limits.travel_max.0;
        self.search().check_speeds(walk);
        // At home, which is somewhere in front of the tissue.
        walk.expected.place(-CONTACT_EXPECTED_SHARE * travel);
        walk.reach = Reach { low: -travel, high: 0.0 };
        self.search().expect_from(walk, CONTACT_EXPECTED_SHARE)
    }
}

impl Executable for CheckHome {
    type Run = Homing;

    fn begin(&self, cx: &mut Context<'_>) -> Result<Homing, String> {
        Homing::begin(cx, self.search(), Purpose::Check)
    }
}
