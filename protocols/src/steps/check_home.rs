//! Touch the home switch again and say how many pulses were missed.

use super::home::{Home, HomingPurpose, HomingRun, KEYS};
use super::prelude::*;
use crate::preview::CONTACT_EXPECTED_SHARE;

/// Touch the home switch again and say how many pulses were missed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckHome {
    pub speed: MmPerS,
    /// Speed of the second touch.
    pub touch_speed: MmPerS,
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Touch the home switch again and report how many pulses were missed.",
    keys: KEYS,
    build: Some(|args| {
        let Home { speed, touch_speed } = Home::read(args)?;
        Ok(CheckHome { speed, touch_speed }.into())
    }),
    needs: &[Need::Motor, Need::Home],
    gives: &[Need::Outside],
    may_touch: false,
    label: "home",
    ..StepFacts::of("check-home", Phase::CheckHome, PauseBehaviour::Repeat)
};

impl CheckHome {
    fn search(&self) -> Home {
        Home { speed: self.speed, touch_speed: self.touch_speed }
    }
}

impl StepKind for CheckHome {
    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        let travel = walk.limits.travel_max.0;
        self.search().check_speeds(walk);
        // At home, which is somewhere in front of the tissue.
        walk.expected.place(-CONTACT_EXPECTED_SHARE * travel);
        walk.reach = Reach { low: -travel, high: 0.0 };
        self.search().expect_from(walk, CONTACT_EXPECTED_SHARE)
    }
}

impl Executable for CheckHome {
    type Run = HomingRun;

    fn begin(&self, cx: &mut Context<'_>) -> Result<HomingRun, String> {
        HomingRun::begin(cx, self.search(), HomingPurpose::Check)
    }
}
