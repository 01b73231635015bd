//! Finding the stiff base a specimen lay on: a touch to know where it is, a slow one whose straight line of force
//! over position tells the surface, and the way to it.
//!
//! A stiff surface gives no time: both touches are slow, and the rig's own compliance is all that softens them.

use super::find_contact::{above_noise, second_touch_error};
use super::prelude::*;
use crate::engine::{ContactPosition, NOT_TARED};
use crate::preview::CONTACT_EXPECTED_SHARE;
use palpate_model::rig::{StiffSample, Thickness, TouchPosition, fit_compliance, thickness};

/// Find the stiff base the specimen lay on, with the specimen taken away: its thickness.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FindBase {
    pub approach_speed: MmPerS,
    /// Filtered force above tare that ends the first touch.
    pub criterion: Newtons,
    /// Distance to withdraw before the second touch, in mm.
    pub retreat_mm: f64,
    /// Speed of the second touch.
    pub pass_speed: MmPerS,
    /// Filtered force that ends the second touch.
    pub pass_force: Newtons,
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Find the base without a specimen on it. The thickness of the specimen is the distance from its contact point, found earlier, to the base.",
    keys: &[
        Key::usual("speed", QuantityKind::Speed, "0.6 mm/s", "speed of the first touch"),
        Key::usual("criterion", QuantityKind::Force, "0.05 N", "force that ends the first touch"),
        Key::usual(
            "retreat",
            QuantityKind::Length,
            "0.3 mm",
            "distance of the retract before the second touch",
        ),
        Key::usual("pass_speed", QuantityKind::Speed, "0.03 mm/s", "speed of the second touch"),
        Key::usual("pass_force", QuantityKind::Force, "0.4 N", "force that ends the second touch"),
    ],
    build: Some(|args| {
        Ok(FindBase {
            approach_speed: args.speed("speed")?,
            criterion: Newtons(args.number("criterion")?),
            retreat_mm: args.number("retreat")?,
            pass_speed: args.speed("pass_speed")?,
            pass_force: Newtons(args.number("pass_force")?),
        }
        .into())
    }),
    needs: &[Need::Motor, Need::Home, Need::Tare, Need::Outside],
    gives: &[Need::Contact],
    label: "base",
    ..StepFacts::of("find-base", Phase::Contact, PauseBehaviour::RepeatFromStart)
};

impl FindBase {
    /// Fastest touch of a stiff base. At 0.6 mm/s an axis is stopped within 12 micrometres of feeling something: 0.4 N
    /// on a rig that gives way by 30 micrometres per newton.
    pub const SPEED_MAX: MmPerS = MmPerS(0.6);

    /// Share of the force of the second touch from which the surfaces count as seated.
    pub const SEATED_SHARE: f64 = 0.3;

    fn check_speeds(&self) -> Result<(), String> {
        if self.approach_speed.0.max(self.pass_speed.0) > Self::SPEED_MAX.0 {
            return Err(format!(
                "a speed is too high for a stiff base; give at most {}",
                Self::SPEED_MAX
            ));
        }
        Ok(())
    }
}

impl Default for FindBase {
    /// The first touch as fast as [`FindBase::SPEED_MAX`]. The second is the slowest that a step of 0.03 mm/s allows, and
    /// ends at 0.4 N, under the half newton that finding positions may exert.
    fn default() -> Self {
        Self {
            approach_speed: Self::SPEED_MAX,
            criterion: Newtons(0.05),
            retreat_mm: 0.3,
            pass_speed: MmPerS(0.03),
            pass_force: Newtons(0.4),
        }
    }
}

impl StepKind for FindBase {
    fn rate_advice(&self) -> &'static str {
        "; the base is too stiff for this speed: give find-base a lower speed, or a simulated rig a machine compliance of 30 um/N"
    }

    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_sizes(&[self.retreat_mm, self.criterion.0, self.pass_force.0]);
        walk.check_speed(self.approach_speed);
        walk.check_speed(self.pass_speed);
        walk.refusals.extend(self.check_speeds().err());
        let travel = walk.limits.travel_max.0;
        let slow = walk.move_secs(self.retreat_mm, self.pass_speed);
        let after = |walk: &Walk<'_>, share: f64| {
            walk.move_secs(share * travel, self.approach_speed) + slow
        };
        // Behind the specimen, as far as it is thick.
        let near = after(walk, 2.0 * CONTACT_EXPECTED_SHARE);
        let far = after(walk, 1.0);
        walk.expected.place_on_base();
        walk.reach = Reach::at(0.0);
        walk.unknown(near, far)
    }
}

/// Milliseconds averaged before a force is compared: late by 5 ms only, a few micrometres at these speeds.
const FILTER_MS: usize = 10;

/// How far past the first touch the second may go, in mm.
const PASS_OVERRUN_MM: f64 = 0.5;

/// Share of the travel kept free behind the furthest approach, in mm.
const TRAVEL_MARGIN_MM: f64 = 1.0;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Approach,
    Braking,
    Retreat,
    SlowPass,
    SlowBraking,
    ToSurface,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BaseSearch {
    plan: FindBase,
    criterion: Newtons,
    stage: Stage,
    millisecond: BlockMean<2>,
    filter: MovingMean,
    first: Position,
    samples: Vec<StiffSample>,
}

impl Executable for FindBase {
    type Run = Box<BaseSearch>;

    fn begin(&self, cx: &mut Context<'_>) -> Result<Box<BaseSearch>, String> {
        let unloaded = cx.unloaded().ok_or(NOT_TARED)?;
        let filtered = cx.rig().means_in(FILTER_MS);
        let samples = filtered * cx.rig().samples_per_ms() as usize;
        let (criterion, noise) = above_noise(cx, &unloaded, self.criterion, samples);
        self.check_speeds()?;
        if criterion >= self.pass_force {
            return Err(format!(
                "a noise of {noise:.3} needs a contact criterion of {criterion:.3}, but the criterion must be below the force of {:.3} that ends the second touch; reduce the noise",
                self.pass_force
            ));
        }
        let end = Position(cx.limits().travel_max.0 - TRAVEL_MARGIN_MM);
        cx.move_to(end, self.approach_speed)?;
        Ok(Box::new(BaseSearch {
            plan: *self,
            criterion,
            stage: Stage::Approach,
            millisecond: BlockMean::of_millisecond(cx.rig()),
            filter: MovingMean::new(filtered),
            first: Position(0.0),
            samples: Vec::new(),
        }))
    }
}

impl RunningStep for BaseSearch {
    fn on_reading(&mut self, cx: &mut Context<'_>, _reading: &Reading) -> Result<Progress, String> {
        let position = cx.derived().position;
        let force = cx.derived().force.unwrap_or(Newtons(0.0));
        let Some([mean_position, force]) = self.millisecond.push([position.0, force.0]) else {
            return Ok(Progress::Continue);
        };
        let force = Newtons(force);
        let filtered = Newtons(self.filter.push(force.0));
        let at_rest = cx.at_rest()?;
        match self.stage {
            // The mean of the first sample alone is above it once in two hundred searches.
            Stage::Approach if self.filter.is_full() && filtered >= self.criterion => {
                self.first = position;
                cx.stop_move();
                self.stage = Stage::Braking;
            }
            Stage::Approach if at_rest => {
                return Err(format!(
                    "no stiff surface was found up to {:.1} mm; check the base",
                    position.0
                ));
            }
            Stage::Braking if at_rest => {
                let back = self.first.moved_by(-self.plan.retreat_mm);
                cx.move_to(Position(back.0.max(0.0)), self.plan.approach_speed)?;
                self.stage = Stage::Retreat;
            }
            Stage::Retreat if at_rest => {
                let end = self.first.moved_by(PASS_OVERRUN_MM);
                cx.move_to(end, self.plan.pass_speed)?;
                self.stage = Stage::SlowPass;
            }
            Stage::SlowPass => {
                // Forces this small are all worth the same.
                let sigma = Newtons(1.0);
                self.samples.push(StiffSample { position: Position(mean_position), force, sigma });
                if filtered >= self.plan.pass_force {
                    cx.stop_move();
                    self.stage = Stage::SlowBraking;
                } else if at_rest {
                    return Err(second_touch_error("touch", self.plan.criterion, self.criterion));
                }
            }
            Stage::SlowBraking if at_rest => {
                let found = self.found(cx)?;
                cx.move_to(found.position, self.plan.pass_speed)?;
                self.stage = Stage::ToSurface;
            }
            Stage::ToSurface if at_rest => return Ok(Progress::Done),
            _ => {}
        }
        Ok(Progress::Continue)
    }
}

impl BaseSearch {
    /// The surface from the slow touch; with a contact found before, the thickness between them.
    fn found(&self, cx: &mut Context<'_>) -> Result<ContactPosition, String> {
        let seated = Newtons(FindBase::SEATED_SHARE * self.plan.pass_force.0);
        let line = fit_compliance(&self.samples, seated).map_err(|err| err.to_string())?;
        let found =
            ContactPosition { position: line.surface, std_error_mm: line.surface_std_error_mm };
        let touched = |contact: ContactPosition| TouchPosition {
            position: contact.position,
            std_error_mm: contact.std_error_mm,
        };
        let behind = cx
            .known_contact()
            .map(|tissue| thickness(touched(tissue), touched(found)))
            .transpose()
            .map_err(|err| err.to_string())?;
        cx.record(Record::BaseFound {
            position: found.position,
            std_error_mm: found.std_error_mm,
            compliance_mm_per_n: line.mm_per_newton,
            thickness_mm: behind.map(|Thickness { mm, .. }| mm),
            thickness_std_error_mm: behind.map(|one| one.std_error_mm),
        });
        cx.set_contact(Some(found));
        Ok(found)
    }
}
