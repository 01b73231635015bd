//! Finding the stiff base a specimen lay on: a touch to know where it is, a slow one whose straight line of force
//! over position tells the surface, and the way to it.
//!
//! A stiff surface gives no time: both touches are slow, and the rig's own compliance is all that softens them.

use super::contact::{NOT_TARED, above_noise, not_felt};
use super::context::{Context, Progress};
use super::input::Record;
use super::millisecond::Millisecond;
use super::state::Contact;
use crate::plans::FindBase;
use palpate_model::rig::{StiffSample, Thickness, Touched, fit_compliance, thickness};
use palpate_model::signal::MovingMean;
use palpate_model::units::{Newtons, Position};

/// Milliseconds averaged before a force is compared: late by 5 ms only, a few micrometres at these speeds.
const FILTER_MS: usize = 10;

/// How far past the first touch the second may go, in mm.
const PASS_OVERRUN_MM: f64 = 0.5;

/// Share of the travel kept free behind the furthest approach, in mm.
const TRAVEL_MARGIN_MM: f64 = 1.0;

/// Share of the force of the second touch from which the surfaces count as seated.
pub(crate) const SEATED_SHARE: f64 = 0.3;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Approach,
    Braking,
    Retreat,
    SlowPass,
    SlowBraking,
    ToSurface,
}

/// Data of a search for the base.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BaseSearch {
    plan: FindBase,
    criterion: Newtons,
    stage: Stage,
    millisecond: Millisecond,
    filter: MovingMean,
    first: Position,
    samples: Vec<StiffSample>,
}

impl BaseSearch {
    pub fn begin(cx: &mut Context<'_>, plan: FindBase) -> Result<Self, String> {
        let tare = cx.state.tare.ok_or(NOT_TARED)?;
        let rig = &cx.state.config.rig;
        let filtered = rig.means_in(FILTER_MS);
        let samples = filtered * rig.samples_per_ms() as usize;
        let (criterion, noise) = above_noise(cx, &tare, plan.criterion, samples);
        if plan.approach_speed > FindBase::SPEED_MAX || plan.pass_speed > FindBase::SPEED_MAX {
            return Err(format!(
                "a base is stiff; touch it at {} at most",
                FindBase::SPEED_MAX
            ));
        }
        if criterion >= plan.pass_force {
            return Err(format!(
                "noise of {noise:.3} would need a criterion of {criterion:.3}, no less than the {:.3} of the second touch; quieten the signal",
                plan.pass_force
            ));
        }
        let end = Position(cx.state.config.limits.travel_max.0 - TRAVEL_MARGIN_MM);
        cx.move_to(end, plan.approach_speed)?;
        Ok(Self {
            plan,
            criterion,
            stage: Stage::Approach,
            millisecond: Millisecond::of(&cx.state.config.rig),
            filter: MovingMean::new(filtered),
            first: Position(0.0),
            samples: Vec::new(),
        })
    }

    pub fn on_reading(&mut self, cx: &mut Context<'_>) -> Progress {
        match self.advance(cx) {
            Ok(progress) => progress,
            Err(reason) => Progress::Fail(format!("base: {reason}")),
        }
    }

    fn advance(&mut self, cx: &mut Context<'_>) -> Result<Progress, String> {
        let position = cx.state.derived.position;
        let force = cx.state.derived.force.unwrap_or(Newtons(0.0));
        let Some((felt_at, force)) = self.millisecond.push(position.0, force.0) else {
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
                    "nothing stiff before {:.1} mm; check the base",
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
                self.samples.push(StiffSample {
                    position: Position(felt_at),
                    force,
                    sigma,
                });
                if filtered >= self.plan.pass_force {
                    cx.stop_move();
                    self.stage = Stage::SlowBraking;
                } else if at_rest {
                    return Err(not_felt("touch", self.plan.criterion, self.criterion));
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

    /// The surface from the slow touch; with a contact found before, the thickness between them.
    fn found(&self, cx: &mut Context<'_>) -> Result<Contact, String> {
        let seated = Newtons(SEATED_SHARE * self.plan.pass_force.0);
        let line = fit_compliance(&self.samples, seated).map_err(|err| err.to_string())?;
        let found = Contact {
            position: line.surface,
            std_error_mm: line.surface_std_error_mm,
        };
        let touched = |contact: Contact| Touched {
            position: contact.position,
            std_error_mm: contact.std_error_mm,
        };
        let behind = cx
            .state
            .contact
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
        cx.state.contact = Some(found);
        Ok(found)
    }
}
