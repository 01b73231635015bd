//! Finding the tissue: a first pass to know roughly where it is and, if the plan presses, how it answers;
//! a slow second pass; a rest for the tissue to recover; and the way to depth zero.
//!
//! The trigger of a moving mean is late by construction and published testers trigger early on
//! single peaks, so the trigger only ends a pass; the position comes from a fit: of everything felt where the
//! plan presses, else of the onset in the second pass.

use super::context::{Context, Progress};
use super::input::Record;
use super::millisecond::Millisecond;
use super::state::{Contact, Tare};
use super::touch_log::{Counts, TouchLog};
use crate::plans::FindContact;
use palpate_model::rig::{Phase, Reading};
use palpate_model::signal::{
    ContactEstimate, ContactPoint, MovingMean, TouchEstimate, fit_contact, fit_touch,
};
use palpate_model::units::{Depth, MmPerS, Newtons, Position, Seconds, Volts};
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

/// The criterion is at least this many standard deviations of the filtered signal.
const CRITERION_SIGMAS: f64 = 6.0;

/// A criterion above this would press visibly before it triggers.
const CRITERION_MAX: Newtons = Newtons(0.2);

/// A drift counts as far as it is beyond so many of its standard errors. At three, one steady but noisy cell in a
/// thousand was refused; at five it is less than one in a million, and the fit of the contact allows for the drift
/// that is left.
const DRIFT_SIGMAS: f64 = 5.0;

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

/// A search feels with the load cell.
pub(crate) const NOT_TARED: &str = "tare the load cell before searching with it";

#[derive(Clone, Debug, PartialEq)]
enum Stage {
    Approach,
    Press,
    ApproachBraking,
    Dwell { until_tick: u64 },
    Retreat,
    Recover { until_tick: u64 },
    SlowPass,
    SlowBraking,
    SlowDwell { until_tick: u64 },
    Clear { found: Contact },
    Rest { found: Contact, until_tick: u64 },
    ToZero { found: Contact },
}

/// Data of a contact search in progress.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ContactSearch {
    plan: FindContact,
    criterion: Newtons,
    stage: Stage,
    millisecond: Millisecond,
    filter: MovingMean,
    fast: MovingMean,
    /// Means in the filter, means in a row above the criterion, and in a point of the slow pass.
    filtered: usize,
    consecutive: usize,
    point: u32,
    seen: usize,
    above: u32,
    /// The newest raw forces, one a millisecond, oldest first.
    raw: VecDeque<Newtons>,
    false_triggers: u32,
    first_trigger: Position,
    /// Where the first touch ended, once it has been understood.
    first_end: Option<Position>,
    log: TouchLog,
    pass_start_tick: u64,
    points: Vec<ContactPoint>,
    bin: Bin,
}

/// Milliseconds being averaged into one point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Bin {
    count: u32,
    t: f64,
    position: f64,
    force: f64,
}

impl ContactSearch {
    pub fn begin(cx: &mut Context<'_>, plan: FindContact) -> Result<Self, String> {
        let tare = cx.state.tare.ok_or(NOT_TARED)?;
        let rig = &cx.state.config.rig;
        let means = |ms| rig.means_in(ms);
        let filtered = means(FILTER_MS);
        let (fast, point) = (means(FAST_MS), means(POINT_MS));
        let consecutive = means(CONSECUTIVE_MS).max(CONSECUTIVE_MIN);
        let samples = filtered * rig.samples_per_ms() as usize;
        let (criterion, noise) = above_noise(cx, &tare, plan.criterion, samples);
        if criterion > CRITERION_MAX {
            return Err(format!(
                "noise of {noise:.3} would need a contact criterion of {criterion:.3}, above {CRITERION_MAX}; quieten the signal"
            ));
        }
        let end = Position(cx.state.config.limits.travel_max.0 - TRAVEL_MARGIN_MM);
        let way_mm = end.distance_from(cx.state.derived.position);
        check_drift(
            cx,
            &tare,
            Seconds(way_mm / plan.approach_speed.0),
            criterion,
        )?;
        cx.move_to(end, plan.approach_speed)?;
        Ok(Self {
            plan,
            criterion,
            stage: Stage::Approach,
            millisecond: Millisecond::of(&cx.state.config.rig),
            filter: MovingMean::new(filtered),
            fast: MovingMean::new(fast),
            filtered,
            consecutive,
            point: point as u32,
            seen: 0,
            above: 0,
            raw: VecDeque::with_capacity(consecutive),
            false_triggers: 0,
            first_trigger: Position(0.0),
            first_end: None,
            log: TouchLog::new(cx.state.tick, &cx.state.config.rig),
            pass_start_tick: 0,
            points: Vec::new(),
            bin: Bin::default(),
        })
    }

    pub fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Progress {
        match self.advance(cx, reading) {
            Ok(progress) => progress,
            Err(reason) => Progress::Fail(format!("contact: {reason}")),
        }
    }

    fn advance(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Result<Progress, String> {
        let position = cx.state.derived.position;
        let force = cx.state.derived.force.unwrap_or(Newtons(0.0));
        let Some((felt_at, force)) = self.millisecond.push(position.0, force.0) else {
            return Ok(Progress::Continue);
        };
        let (felt_at, force) = (Position(felt_at), Newtons(force));
        let filtered = Newtons(self.filter.push(force.0));
        let fast = Newtons(self.fast.push(force.0));
        self.remember(reading.tick, felt_at, force);
        let at_rest = cx.at_rest()?;
        self.check_force(filtered, fast)?;
        match self.stage.clone() {
            Stage::Approach => {
                if self.is_first_triggered(force, filtered) {
                    self.first_trigger = position;
                    self.record_trigger(cx, reading, 1, filtered);
                    if self.plan.press.is_some() {
                        self.stage = Stage::Press;
                    } else {
                        cx.stop_move();
                        self.stage = Stage::ApproachBraking;
                    }
                } else if at_rest {
                    return Err(no_tissue(position));
                }
            }
            Stage::Press => {
                let wanted = self.plan.press.map_or(FORCE_MAX, |press| press.force);
                if filtered >= wanted || fast >= FORCE_FAST_MAX {
                    cx.stop_move();
                    self.stage = Stage::ApproachBraking;
                } else if filtered.0 < 0.5 * self.criterion.0 {
                    self.on_false_trigger()?;
                } else if at_rest {
                    return Err(no_tissue(position));
                }
            }
            Stage::ApproachBraking if at_rest => match self.plan.press {
                Some(press) => {
                    let until_tick = reading.tick + cx.state.ticks(press.dwell);
                    self.stage = Stage::Dwell { until_tick };
                }
                None => self.retreat(cx, self.first_trigger)?,
            },
            Stage::Dwell { until_tick } if reading.tick >= until_tick => {
                let first = self.fit()?;
                self.first_end = Some(position);
                self.retreat(cx, first.contact.position)?;
            }
            Stage::Retreat if at_rest => {
                let until_tick = reading.tick + cx.state.ticks(self.plan.recovery);
                self.stage = Stage::Recover { until_tick };
            }
            Stage::Recover { until_tick } if reading.tick >= until_tick => {
                let overrun = self.first_trigger.moved_by(PASS_OVERRUN_MM);
                let end = self.first_end.unwrap_or(overrun);
                cx.move_to(end, self.plan.pass_speed)?;
                self.above = 0;
                self.pass_start_tick = reading.tick;
                self.stage = Stage::SlowPass;
            }
            Stage::SlowPass => {
                self.collect(cx, reading, felt_at, force);
                let target = Newtons(self.plan.pass_force.0.max(2.0 * self.criterion.0));
                let is_felt = self.first_end.is_some() && filtered >= self.criterion;
                if self.is_triggered(filtered, target) {
                    self.record_trigger(cx, reading, 2, filtered);
                    cx.stop_move();
                    self.stage = Stage::SlowBraking;
                } else if at_rest && is_felt {
                    self.record_trigger(cx, reading, 2, filtered);
                    self.stage = Stage::SlowBraking;
                } else if at_rest {
                    return Err(not_felt("pass", self.plan.criterion, self.criterion));
                }
            }
            Stage::SlowBraking if at_rest => match self.plan.press {
                Some(press) => {
                    let until_tick = reading.tick + cx.state.ticks(press.dwell);
                    self.stage = Stage::SlowDwell { until_tick };
                }
                None => self.clear(cx)?,
            },
            Stage::SlowDwell { until_tick } if reading.tick >= until_tick => self.clear(cx)?,
            Stage::Clear { found } if at_rest => {
                cx.enter_phase(Phase::Rest);
                let until_tick = reading.tick + cx.state.ticks(self.plan.recovery);
                self.stage = Stage::Rest { found, until_tick };
            }
            Stage::Rest { found, until_tick } if reading.tick >= until_tick => {
                cx.state.contact = Some(found);
                cx.record(Record::ContactFound {
                    position: found.position,
                    std_error_mm: found.std_error_mm,
                });
                let zero = Depth(0.0).position_from(found.position);
                cx.move_to(zero, self.plan.pass_speed)?;
                self.stage = Stage::ToZero { found };
            }
            Stage::ToZero { .. } if at_rest => return Ok(Progress::Done),
            _ => {}
        }
        Ok(Progress::Continue)
    }

    /// Takes a millisecond into what is remembered, where the plan presses.
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
            Stage::Approach => Counts::Lead,
            // The tissue may lag behind the probe, and what it does then is no part of the body.
            Stage::Retreat => Counts::No,
            Stage::Clear { .. } | Stage::Rest { .. } | Stage::ToZero { .. } => return,
            _ => Counts::Yes,
        };
        self.log.push(tick, position, force, counts);
    }

    /// Refuses a load before the approach and a force that contact finding must not exert.
    fn check_force(&self, filtered: Newtons, fast: Newtons) -> Result<(), String> {
        if self.seen == self.filtered && filtered.abs() >= self.criterion {
            return Err(format!(
                "the load cell reads {filtered:.3} before the tissue is met; free the probe and tare again"
            ));
        }
        let is_searching = matches!(self.stage, Stage::Approach | Stage::Press | Stage::SlowPass);
        if is_searching && filtered > FORCE_MAX {
            return Err(format!(
                "the force reached {filtered:.2} before contact was certain"
            ));
        }
        // Tissue leaves time to stop. What does not is a base or a holder, whatever the fit would say of it.
        let is_stopping = matches!(
            self.stage,
            Stage::ApproachBraking
                | Stage::Dwell { .. }
                | Stage::SlowBraking
                | Stage::SlowDwell { .. }
        );
        if is_stopping && filtered > FORCE_MAX {
            return Err(format!(
                "the force rose to {filtered:.2} while the axis stopped: what was met is no tissue, or too hard for this speed; look what stands before the probe"
            ));
        }
        if self.plan.press.is_some() && self.stage == Stage::Approach && fast >= FORCE_FAST_MAX {
            return Err(format!(
                "the force rose to {fast:.2} at once: what was met is too hard for this speed; approach more slowly"
            ));
        }
        Ok(())
    }

    /// Where the plan presses, so many raw forces in a row tell of the tissue; else filtered ones.
    fn is_first_triggered(&mut self, force: Newtons, filtered: Newtons) -> bool {
        let judged = if self.plan.press.is_some() {
            force
        } else {
            filtered
        };
        self.is_triggered(judged, self.criterion)
    }

    fn on_false_trigger(&mut self) -> Result<(), String> {
        self.false_triggers += 1;
        if self.false_triggers > FALSE_TRIGGERS_MAX {
            return Err(format!(
                "the force rose above {:.3} and fell again {} times without tissue; quieten the signal",
                self.criterion, self.false_triggers
            ));
        }
        self.above = 0;
        self.stage = Stage::Approach;
        Ok(())
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
        self.stage = Stage::Clear { found };
        Ok(())
    }

    fn is_triggered(&mut self, filtered: Newtons, criterion: Newtons) -> bool {
        self.above = if filtered >= criterion {
            self.above + 1
        } else {
            0
        };
        self.above as usize >= self.consecutive
    }

    fn record_trigger(&self, cx: &mut Context<'_>, reading: &Reading, pass: u8, force: Newtons) {
        let position = cx.state.derived.position;
        cx.record(Record::ContactTriggered {
            pass,
            position,
            volts: reading.volts,
            force,
            raw: self.raw.iter().copied().collect(),
        });
    }

    /// Averages what was felt in the slow pass into points for the fit. Only constant speed counts:
    /// the fit takes the pass as one straight line in time.
    fn collect(&mut self, cx: &Context<'_>, reading: &Reading, position: Position, force: Newtons) {
        if !is_cruising(cx.state.derived.velocity, self.plan.pass_speed) {
            return;
        }
        let bin = &mut self.bin;
        bin.count += 1;
        bin.t += (reading.tick - self.pass_start_tick) as f64 * cx.state.config.rig.tick().0;
        bin.position += position.0;
        bin.force += force.0;
        if bin.count == self.point {
            let count = f64::from(self.point);
            self.points.push(ContactPoint {
                t: Seconds(bin.t / count),
                position: Position(bin.position / count),
                force: Newtons(bin.force / count),
            });
            *bin = Bin::default();
        }
    }

    /// What everything felt so far says of the contact position.
    fn fit(&self) -> Result<TouchEstimate, String> {
        let points = self.log.points();
        let found = fit_touch(points).map_err(|err| err.to_string())?;
        let begun = points.first().map_or(Position(0.0), |point| point.position);
        // Three standard errors: a surface before the beginning was not approached. An estimate that
        // is too vague for the plan says nothing about that either, and is refused for what it is.
        let ContactEstimate {
            position,
            std_error_mm,
            ..
        } = found.contact;
        let is_known = std_error_mm <= self.plan.std_error_mm_max;
        if is_known && position < begun.moved_by(3.0 * std_error_mm) {
            return Err(
                "the probe touched the tissue before the search began; retract and tare again"
                    .into(),
            );
        }
        Ok(found)
    }

    fn estimate(&self) -> Result<Contact, String> {
        let limit = self.plan.std_error_mm_max;
        let found = match self.plan.press {
            Some(_) => {
                let TouchEstimate { contact, apart_mm } = self.fit()?;
                // Half of the distance is an error of the position.
                if let Some(apart) = apart_mm.filter(|apart| apart.abs() > 2.0 * limit) {
                    let way = if apart > 0.0 { "after" } else { "before" };
                    return Err(format!(
                        "the second touch met the tissue {:.2} mm {way} where the first did; check that the specimen is held and let it rest longer",
                        apart.abs()
                    ));
                }
                contact
            }
            None => fit_contact(&self.points).map_err(|err| err.to_string())?,
        };
        if found.std_error_mm > limit {
            return Err(format!(
                "the contact position is only known to {:.3} mm, wider than {limit:.3} mm; quieten the signal or press further",
                found.std_error_mm
            ));
        }
        Ok(Contact {
            position: found.position,
            std_error_mm: found.std_error_mm,
        })
    }
}

/// The force that a mean of so many samples reaches only by touching something, and the noise of one sample.
pub(super) fn above_noise(
    cx: &Context<'_>,
    tare: &Tare,
    wanted: Newtons,
    samples: usize,
) -> (Newtons, Newtons) {
    let noise = cx.state.config.curve.force_sigma(Newtons(0.0), tare.noise);
    let filtered = noise.0 / (samples as f64).sqrt();
    (Newtons(wanted.0.max(CRITERION_SIGMAS * filtered)), noise)
}

/// Why a second touch ended without its trigger: `wanted` is the criterion of the plan, `criterion` the one that
/// [`above_noise`] made of it.
pub(super) fn not_felt(touch: &str, wanted: Newtons, criterion: Newtons) -> String {
    let advice = if criterion > wanted {
        format!(
            "noise raised the criterion from {wanted:.3} to {criterion:.3}; quieten the signal, tare and search again"
        )
    } else {
        "look whether the specimen or its support moved, then search again".to_owned()
    };
    format!("the second {touch} did not feel what the first one felt: {advice}")
}

/// Refuses a drift that surely moves the force by half of the criterion within the time an approach may take.
fn check_drift(
    cx: &Context<'_>,
    tare: &Tare,
    span: Seconds,
    criterion: Newtons,
) -> Result<(), String> {
    let Some(drift) = tare.drift else {
        return Ok(());
    };
    let sure = (drift.volts_per_s.abs() - DRIFT_SIGMAS * drift.std_error).max(0.0);
    let curve = &cx.state.config.curve;
    let moved = curve.force_sigma(Newtons(0.0), Volts(sure * span.0));
    if moved.0 > 0.5 * criterion.0 {
        return Err(format!(
            "the unloaded signal drifts by {:.2} mV a minute, which could move the force by {moved:.3} during the approach; let the load cell warm up, then tare again",
            drift.volts_per_s * 6e4
        ));
    }
    Ok(())
}

fn no_tissue(position: Position) -> String {
    format!("no tissue before {:.1} mm; check the specimen", position.0)
}

fn is_cruising(velocity: MmPerS, speed: MmPerS) -> bool {
    // Profiles compute the cruise speed exactly; 1e-9 mm/s is rounding.
    (velocity.0 - speed.0).abs() < 1e-9
}
