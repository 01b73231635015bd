//! A search for the tissue's surface in progress.
//!
//! The trigger of a moving mean is late by construction and published testers trigger early on
//! single peaks, so the trigger only ends a pass; the position comes from a fit: of all forces where the
//! plan presses, else of the onset in the second pass.

use super::FindContact;
use super::noise::{above_noise, check_drift, second_touch_error};
use super::touch_log::{ForceUse, TouchLog};
use crate::engine::{ContactPosition, NOT_TARED};
use crate::steps::prelude::*;
use palpate_model::signal::{ContactEstimate, ContactPoint, TouchEstimate, fit_contact, fit_touch};
use std::collections::VecDeque;

/// Milliseconds averaged before a force is compared with a criterion: two to three mains cycles.
const FILTER_MS: usize = 50;

/// Consecutive milliseconds that must be above the criterion: filtered, and raw where the plan presses.
const CONSECUTIVE_MS: usize = 10;

/// Where samples come seldom, so many of them at least.
const CONSECUTIVE_MIN: usize = 3;

/// A mean of so few milliseconds is late by 5 ms only: what is hard is noticed by it.
const FAST_MS: usize = 10;

/// A press ends early where the fast mean is above this: filter and brake need what is left to [`FORCE_MAX`].
const FORCE_FAST_MAX: Newtons = Newtons(0.45);

/// Triggers after which the force fell again; more are no accident.
const FALSE_TRIGGERS_MAX: u32 = 5;

/// A criterion above this would press visibly before it triggers.
const CRITERION_MAX: Newtons = Newtons(0.2);

/// Contact finding never exerts more than this.
const FORCE_MAX: Newtons = Newtons(0.5);

/// How far past the first trigger the second pass may go, in mm.
const PASS_OVERRUN_MM: f64 = 4.0;

/// Milliseconds averaged into one point of the fit of a second pass alone: 100 points a second.
const POINT_MS: usize = 10;

/// Distance from contact at which the tissue recovers untouched, in mm.
const CLEARANCE_MM: f64 = 1.0;

/// Share of the travel kept free behind the furthest approach, in mm.
const TRAVEL_MARGIN_MM: f64 = 1.0;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Approach,
    Press,
    ApproachBraking,
    Dwell,
    Retreat,
    Recover,
    SlowPass,
    SlowBraking,
    SlowDwell,
    Clear(ContactPosition),
    Rest(ContactPosition),
    ToZero,
}

/// A contact search in progress.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ContactSearch {
    plan: FindContact,
    criterion: Newtons,
    stage: Stage,
    /// End of a stage that lasts for a set time.
    until_tick: u64,
    millisecond: BlockMean<2>,
    filter: MovingMean,
    fast: MovingMean,
    /// Means in the filter, means in a row above the criterion, and in a point of the slow pass.
    filtered: usize,
    consecutive: usize,
    seen: usize,
    above: u32,
    /// The newest raw forces, one a millisecond, oldest first.
    raw: VecDeque<Newtons>,
    false_triggers: u32,
    first_trigger: Position,
    /// End of the first touch, once its fit has succeeded.
    first_end: Option<Position>,
    log: TouchLog,
    pass_start_tick: u64,
    points: Vec<ContactPoint>,
    /// Time in s, position in mm and force in N of the point in progress.
    point: BlockMean<3>,
}

impl ContactSearch {
    pub fn begin(cx: &mut Context<'_>, plan: FindContact) -> Result<Self, String> {
        let unloaded = cx.unloaded().ok_or(NOT_TARED)?;
        let rig = cx.rig();
        let means = |ms| rig.means_in(ms);
        let filtered = means(FILTER_MS);
        let (fast, point) = (means(FAST_MS), means(POINT_MS));
        let consecutive = means(CONSECUTIVE_MS).max(CONSECUTIVE_MIN);
        let samples = filtered * rig.samples_per_ms() as usize;
        let (criterion, noise) = above_noise(cx, &unloaded, plan.criterion, samples);
        if criterion > CRITERION_MAX {
            return Err(format!(
                "a noise of {noise:.3} needs a contact criterion of {criterion:.3}, but at most {CRITERION_MAX} is allowed; reduce the noise"
            ));
        }
        let end = Position(cx.limits().travel_max.0 - TRAVEL_MARGIN_MM);
        let way_mm = end.distance_from(cx.derived().position);
        check_drift(cx, &unloaded, Seconds(way_mm / plan.approach_speed.0), criterion)?;
        cx.move_to(end, plan.approach_speed)?;
        Ok(Self {
            plan,
            criterion,
            stage: Stage::Approach,
            until_tick: 0,
            millisecond: BlockMean::of_millisecond(cx.rig()),
            filter: MovingMean::new(filtered),
            fast: MovingMean::new(fast),
            filtered,
            consecutive,
            seen: 0,
            above: 0,
            raw: VecDeque::with_capacity(consecutive),
            false_triggers: 0,
            first_trigger: Position(0.0),
            first_end: None,
            log: TouchLog::new(cx.tick(), cx.rig()),
            pass_start_tick: 0,
            points: Vec::new(),
            point: BlockMean::new(point as u32),
        })
    }

    /// Handles a millisecond of the first touch.
    fn first_touch(&mut self, cx: &mut Context<'_>, now: &SearchSample<'_>) -> Result<(), String> {
        let SearchSample { reading, at_rest, .. } = *now;
        let is_over = reading.tick >= self.until_tick;
        match self.stage {
            Stage::Approach => {
                if self.is_first_triggered(now.force, now.filtered) {
                    self.first_trigger = now.position;
                    self.record_trigger(cx, reading, 1, now.filtered);
                    match self.plan.press {
                        Some(_) => self.stage = Stage::Press,
                        None => self.stop(cx, Stage::ApproachBraking),
                    }
                } else if at_rest {
                    return Err(no_tissue(now.position));
                }
            }
            Stage::Press => {
                let wanted = self.plan.press.map_or(FORCE_MAX, |press| press.force);
                if now.filtered >= wanted || now.fast >= FORCE_FAST_MAX {
                    self.stop(cx, Stage::ApproachBraking);
                } else if now.filtered.0 < 0.5 * self.criterion.0 {
                    self.on_false_trigger()?;
                } else if at_rest {
                    return Err(no_tissue(now.position));
                }
            }
            Stage::ApproachBraking if at_rest => match self.plan.press {
                Some(press) => self.stay(cx, press.dwell, Stage::Dwell),
                None => self.retreat(cx, self.first_trigger)?,
            },
            Stage::Dwell if is_over => {
                let first = self.fit()?;
                self.first_end = Some(now.position);
                self.retreat(cx, first.contact.position)?;
            }
            Stage::Retreat if at_rest => self.stay(cx, self.plan.recovery, Stage::Recover),
            _ => {}
        }
        Ok(())
    }

    /// Handles a millisecond of the second touch and of the move to depth zero.
    fn second_touch(
        &mut self,
        cx: &mut Context<'_>,
        now: &SearchSample<'_>,
    ) -> Result<Progress, String> {
        let SearchSample { reading, at_rest, .. } = *now;
        let is_over = reading.tick >= self.until_tick;
        match self.stage {
            Stage::Recover if is_over => {
                let overrun = self.first_trigger.moved_by(PASS_OVERRUN_MM);
                let end = self.first_end.unwrap_or(overrun);
                cx.move_to(end, self.plan.pass_speed)?;
                self.above = 0;
                self.pass_start_tick = reading.tick;
                self.stage = Stage::SlowPass;
            }
            Stage::SlowPass => {
                self.collect(cx, reading, now.mean_position, now.force);
                let target = Newtons(self.plan.pass_force.0.max(2.0 * self.criterion.0));
                let is_felt = self.first_end.is_some() && now.filtered >= self.criterion;
                if self.is_triggered(now.filtered, target) {
                    self.record_trigger(cx, reading, 2, now.filtered);
                    self.stop(cx, Stage::SlowBraking);
                } else if at_rest && is_felt {
                    self.record_trigger(cx, reading, 2, now.filtered);
                    self.stage = Stage::SlowBraking;
                } else if at_rest {
                    return Err(second_touch_error("pass", self.plan.criterion, self.criterion));
                }
            }
            Stage::SlowBraking if at_rest => match self.plan.press {
                Some(press) => self.stay(cx, press.dwell, Stage::SlowDwell),
                None => self.clear(cx)?,
            },
            Stage::SlowDwell if is_over => self.clear(cx)?,
            Stage::Clear(found) if at_rest => {
                cx.enter_phase(Phase::Rest);
                self.stay(cx, self.plan.recovery, Stage::Rest(found));
            }
            Stage::Rest(found) if is_over => {
                cx.set_contact(Some(found));
                let ContactPosition { position, std_error_mm } = found;
                cx.record(Record::ContactFound { position, std_error_mm });
                cx.move_to(Depth(0.0).position_from(position), self.plan.pass_speed)?;
                self.stage = Stage::ToZero;
            }
            Stage::ToZero if at_rest => return Ok(Progress::Done),
            _ => {}
        }
        Ok(Progress::Continue)
    }

    /// Stores a millisecond for the fit, where the plan presses.
    fn remember(&mut self, tick: u64, position: Position, force: Newtons) {
        self.seen += 1;
        if self.plan.press.is_none() {
            return;
        }
        if self.raw.len() == self.consecutive {
            self.raw.pop_front();
        }
        self.raw.push_back(force);
        let counts = match self.stage {
            Stage::Approach => ForceUse::Lead,
            // The tissue may lag behind the probe, which the model does not describe.
            Stage::Retreat => ForceUse::No,
            Stage::Clear(_) | Stage::Rest(_) | Stage::ToZero => return,
            _ => ForceUse::Yes,
        };
        self.log.push(tick, position, force, counts);
    }

    /// Refuses a load before the approach and a force that contact finding must not exert.
    fn check_force(&self, filtered: Newtons, fast: Newtons) -> Result<(), String> {
        if self.seen == self.filtered && filtered.abs() >= self.criterion {
            return Err(format!(
                "the load cell reads {filtered:.3} before the probe touches the tissue; free the probe and tare again"
            ));
        }
        let is_searching = matches!(self.stage, Stage::Approach | Stage::Press | Stage::SlowPass);
        if is_searching && filtered > FORCE_MAX {
            return Err(format!(
                "the force reached {filtered:.2} before the contact point was found, but a search may press with {FORCE_MAX} at most; approach more slowly"
            ));
        }
        // Tissue leaves time to stop; a base or a holder does not, whatever the fit says.
        let is_stopping = matches!(
            self.stage,
            Stage::ApproachBraking | Stage::Dwell | Stage::SlowBraking | Stage::SlowDwell
        );
        if is_stopping && filtered > FORCE_MAX {
            return Err(format!(
                "the force rose to {filtered:.2} while the axis was stopping: the surface is not tissue, or too stiff for this speed; check what is in front of the probe"
            ));
        }
        if self.plan.press.is_some() && self.stage == Stage::Approach && fast >= FORCE_FAST_MAX {
            return Err(format!(
                "the force rose to {fast:.2} within milliseconds: the surface is too stiff for this speed; approach more slowly"
            ));
        }
        Ok(())
    }

    /// Where the plan presses, consecutive raw forces trigger; else filtered ones.
    fn is_first_triggered(&mut self, force: Newtons, filtered: Newtons) -> bool {
        let judged = if self.plan.press.is_some() { force } else { filtered };
        self.is_triggered(judged, self.criterion)
    }

    fn on_false_trigger(&mut self) -> Result<(), String> {
        self.false_triggers += 1;
        if self.false_triggers > FALSE_TRIGGERS_MAX {
            return Err(format!(
                "the criterion of {:.3} was exceeded {} times without lasting contact; reduce the noise",
                self.criterion, self.false_triggers
            ));
        }
        self.above = 0;
        self.stage = Stage::Approach;
        Ok(())
    }

    fn stop(&mut self, cx: &mut Context<'_>, next: Stage) {
        cx.stop_move();
        self.stage = next;
    }

    fn stay(&mut self, cx: &Context<'_>, duration: Seconds, stage: Stage) {
        self.until_tick = cx.tick_after(duration);
        self.stage = stage;
    }

    fn retreat(&mut self, cx: &mut Context<'_>, from: Position) -> Result<(), String> {
        let back = from.moved_by(-self.plan.retreat_mm);
        cx.move_to(Position(back.0.max(0.0)), self.plan.approach_speed)?;
        self.stage = Stage::Retreat;
        Ok(())
    }

    fn clear(&mut self, cx: &mut Context<'_>) -> Result<(), String> {
        let found = self.estimate()?;
        let clear = Position((found.position.0 - CLEARANCE_MM).max(0.0));
        cx.move_to(clear, self.plan.approach_speed)?;
        self.stage = Stage::Clear(found);
        Ok(())
    }

    fn is_triggered(&mut self, filtered: Newtons, criterion: Newtons) -> bool {
        let is_above = filtered >= criterion;
        self.above = if is_above { self.above + 1 } else { 0 };
        self.above as usize >= self.consecutive
    }

    fn record_trigger(&self, cx: &mut Context<'_>, reading: &Reading, pass: u8, force: Newtons) {
        let position = cx.derived().position;
        cx.record(Record::ContactTriggered {
            pass,
            position,
            volts: reading.volts,
            force,
            raw: self.raw.iter().copied().collect(),
        });
    }

    /// Averages forces of the slow pass into points for the fit. Only constant speed counts:
    /// the fit takes the pass as one straight line in time.
    fn collect(&mut self, cx: &Context<'_>, reading: &Reading, position: Position, force: Newtons) {
        if !is_cruising(cx.derived().velocity, self.plan.pass_speed) {
            return;
        }
        let t = (reading.tick - self.pass_start_tick) as f64 * cx.rig().tick().0;
        if let Some([t, position, force]) = self.point.push([t, position.0, force.0]) {
            self.points.push(ContactPoint {
                t: Seconds(t),
                position: Position(position),
                force: Newtons(force),
            });
        }
    }

    /// Estimates the contact position from all forces so far.
    fn fit(&self) -> Result<TouchEstimate, String> {
        let points = self.log.points();
        let found = fit_touch(points).map_err(|err| err.to_string())?;
        let begun = points.first().map_or(Position(0.0), |point| point.position);
        // Three standard errors: a surface before the beginning was not approached. An estimate that
        // is too vague for the plan says nothing about that either, and is refused for what it is.
        let ContactEstimate { position, std_error_mm, .. } = found.contact;
        let is_known = std_error_mm <= self.plan.std_error_mm_max;
        if is_known && position < begun.moved_by(3.0 * std_error_mm) {
            let reason =
                "the probe touched the tissue before the search began; retract and tare again";
            return Err(reason.into());
        }
        Ok(found)
    }

    fn estimate(&self) -> Result<ContactPosition, String> {
        let limit = self.plan.std_error_mm_max;
        let found = match self.plan.press {
            Some(_) => {
                let TouchEstimate { contact, separation_mm } = self.fit()?;
                // Half of the distance is an error of the position.
                if let Some(apart) = separation_mm.filter(|apart| apart.abs() > 2.0 * limit) {
                    let way = if apart > 0.0 { "deeper" } else { "shallower" };
                    return Err(format!(
                        "the second touch detected contact {:.2} mm {way} than the first; check that the specimen is fixed, and let it rest longer",
                        apart.abs()
                    ));
                }
                contact
            }
            None => fit_contact(&self.points).map_err(|err| err.to_string())?,
        };
        if found.std_error_mm > limit {
            return Err(format!(
                "the standard error of the contact point is {:.3} mm, but at most {limit:.3} mm is allowed; reduce the noise or press further",
                found.std_error_mm
            ));
        }
        Ok(ContactPosition { position: found.position, std_error_mm: found.std_error_mm })
    }
}

impl RunningStep for ContactSearch {
    fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Result<Progress, String> {
        let position = cx.derived().position;
        let force = cx.derived().force.unwrap_or(Newtons(0.0));
        let Some([mean_position, force]) = self.millisecond.push([position.0, force.0]) else {
            return Ok(Progress::Continue);
        };
        let filtered = Newtons(self.filter.push(force));
        let fast = Newtons(self.fast.push(force));
        let (mean_position, force) = (Position(mean_position), Newtons(force));
        self.remember(reading.tick, mean_position, force);
        let now = SearchSample {
            reading,
            position,
            mean_position,
            force,
            filtered,
            fast,
            at_rest: cx.at_rest()?,
        };
        self.check_force(filtered, fast)?;
        match self.stage {
            Stage::Approach
            | Stage::Press
            | Stage::ApproachBraking
            | Stage::Dwell
            | Stage::Retreat => self.first_touch(cx, &now).map(|()| Progress::Continue),
            _ => self.second_touch(cx, &now),
        }
    }
}

/// A millisecond as the search feels it.
struct SearchSample<'a> {
    reading: &'a Reading,
    position: Position,
    /// Means of the millisecond, and of what came before it.
    mean_position: Position,
    force: Newtons,
    filtered: Newtons,
    fast: Newtons,
    at_rest: bool,
}

fn no_tissue(position: Position) -> String {
    format!("no tissue was found up to {:.1} mm; check the specimen", position.0)
}

fn is_cruising(velocity: MmPerS, speed: MmPerS) -> bool {
    // Profiles compute the cruise speed exactly; 1e-9 mm/s is rounding.
    (velocity.0 - speed.0).abs() < 1e-9
}
