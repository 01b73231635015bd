//! Finding the tissue: a first pass to know roughly where it is, a slow second pass whose onset
//! is fitted, a rest for the tissue to recover, and the way to depth zero.
//!
//! The trigger of a moving mean is late by construction and published testers trigger early on
//! single peaks, so the trigger only ends a pass; the position comes from the fit.

use super::context::{Context, Progress};
use super::input::Record;
use super::state::Contact;
use crate::plans::FindContact;
use palpate_model::rig::{Phase, Reading};
use palpate_model::signal::{ContactPoint, MovingMean, fit_contact};
use palpate_model::units::{Depth, MmPerS, Newtons, Position, Seconds};

/// Samples averaged before a force is compared with a criterion: 50 ms at 1 kHz, two to three
/// mains cycles.
const FILTER_SAMPLES: usize = 50;

/// Consecutive filtered samples that must be above the criterion.
const CONSECUTIVE: u32 = 10;

/// The criterion is at least this many standard deviations of the filtered signal.
const CRITERION_SIGMAS: f64 = 6.0;

/// A criterion above this would press visibly before it triggers.
const CRITERION_MAX: Newtons = Newtons(0.2);

/// Contact finding never exerts more than this.
const FORCE_MAX: Newtons = Newtons(0.5);

/// How far past the first trigger the second pass may go, in mm.
const PASS_OVERRUN_MM: f64 = 4.0;

/// Raw samples averaged into one point of the fit: 100 points a second at 1 kHz.
const POINT_SAMPLES: u32 = 10;

/// Distance from contact at which the tissue recovers untouched, in mm.
const CLEARANCE_MM: f64 = 1.0;

/// Share of the travel kept free behind the furthest approach, in mm.
const TRAVEL_MARGIN_MM: f64 = 1.0;

#[derive(Clone, Debug, PartialEq)]
enum Stage {
    Approach,
    ApproachBraking,
    Retreat,
    Recover { until_tick: u64 },
    SlowPass,
    SlowBraking,
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
    filter: MovingMean,
    above: u32,
    first_trigger: Position,
    pass_start_tick: u64,
    points: Vec<ContactPoint>,
    bin: Bin,
}

/// Readings being averaged into one point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Bin {
    count: u32,
    t: f64,
    position: f64,
    force: f64,
}

impl ContactSearch {
    pub fn begin(cx: &mut Context<'_>, plan: FindContact) -> Result<Self, String> {
        let tare = cx
            .state
            .tare
            .ok_or("tare the load cell before searching for contact")?;
        let noise = cx.state.config.curve.force_sigma(Newtons(0.0), tare.noise);
        let filtered = noise.0 / (FILTER_SAMPLES as f64).sqrt();
        let criterion = Newtons(plan.criterion.0.max(CRITERION_SIGMAS * filtered));
        if criterion > CRITERION_MAX {
            return Err(format!(
                "noise of {noise:.3} would need a contact criterion of {criterion:.3}, above {CRITERION_MAX}; quieten the signal"
            ));
        }
        let end = Position(cx.state.config.limits.travel_max.0 - TRAVEL_MARGIN_MM);
        cx.move_to(end, plan.approach_speed)?;
        Ok(Self {
            plan,
            criterion,
            stage: Stage::Approach,
            filter: MovingMean::new(FILTER_SAMPLES),
            above: 0,
            first_trigger: Position(0.0),
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
        let filtered = Newtons(self.filter.push(force.0));
        let at_rest = cx.at_rest()?;
        if filtered > FORCE_MAX && matches!(self.stage, Stage::Approach | Stage::SlowPass) {
            return Err(format!(
                "the force reached {filtered:.2} before contact was certain"
            ));
        }
        match self.stage.clone() {
            Stage::Approach => {
                if self.is_triggered(filtered, self.criterion) {
                    self.first_trigger = position;
                    self.record_trigger(cx, reading, 1, filtered);
                    cx.stop_move();
                    self.stage = Stage::ApproachBraking;
                } else if at_rest {
                    return Err(format!(
                        "no tissue before {:.1} mm; check the specimen",
                        position.0
                    ));
                }
            }
            Stage::ApproachBraking if at_rest => {
                let back = self.first_trigger.moved_by(-self.plan.retreat_mm);
                cx.move_to(Position(back.0.max(0.0)), self.plan.approach_speed)?;
                self.stage = Stage::Retreat;
            }
            Stage::Retreat if at_rest => {
                let until_tick = reading.tick + cx.state.ticks(self.plan.recovery);
                self.stage = Stage::Recover { until_tick };
            }
            Stage::Recover { until_tick } if reading.tick >= until_tick => {
                let end = self.first_trigger.moved_by(PASS_OVERRUN_MM);
                cx.move_to(end, self.plan.pass_speed)?;
                self.above = 0;
                self.pass_start_tick = reading.tick;
                self.stage = Stage::SlowPass;
            }
            Stage::SlowPass => {
                self.collect(cx, reading, position, force);
                let target = Newtons(self.plan.pass_force.0.max(2.0 * self.criterion.0));
                if self.is_triggered(filtered, target) {
                    self.record_trigger(cx, reading, 2, filtered);
                    cx.stop_move();
                    self.stage = Stage::SlowBraking;
                } else if at_rest {
                    return Err("the second pass did not feel what the first one felt".into());
                }
            }
            Stage::SlowBraking if at_rest => {
                let found = self.estimate()?;
                let clear = Position((found.position.0 - CLEARANCE_MM).max(0.0));
                cx.move_to(clear, self.plan.approach_speed)?;
                self.stage = Stage::Clear { found };
            }
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

    fn is_triggered(&mut self, filtered: Newtons, criterion: Newtons) -> bool {
        self.above = if filtered >= criterion {
            self.above + 1
        } else {
            0
        };
        self.above >= CONSECUTIVE
    }

    fn record_trigger(&self, cx: &mut Context<'_>, reading: &Reading, pass: u8, force: Newtons) {
        let position = cx.state.derived.position;
        cx.record(Record::ContactTriggered {
            pass,
            position,
            volts: reading.volts,
            force,
        });
    }

    /// Averages readings of the slow pass into points for the fit. Only constant speed counts:
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
        if bin.count == POINT_SAMPLES {
            let count = f64::from(POINT_SAMPLES);
            self.points.push(ContactPoint {
                t: Seconds(bin.t / count),
                position: Position(bin.position / count),
                force: Newtons(bin.force / count),
            });
            *bin = Bin::default();
        }
    }

    fn estimate(&self) -> Result<Contact, String> {
        let estimate = fit_contact(&self.points).map_err(|err| err.to_string())?;
        if estimate.std_error_mm > self.plan.std_error_mm_max {
            return Err(format!(
                "the contact position is only known to {:.3} mm, wider than {:.3} mm; quieten the signal or press further",
                estimate.std_error_mm, self.plan.std_error_mm_max
            ));
        }
        Ok(Contact {
            position: estimate.position,
            std_error_mm: estimate.std_error_mm,
        })
    }
}

fn is_cruising(velocity: MmPerS, speed: MmPerS) -> bool {
    // Profiles compute the cruise speed exactly; 1e-9 mm/s is rounding.
    (velocity.0 - speed.0).abs() < 1e-9
}
