//! How well a run met its plan: speeds, depths, forces and durations against their targets, missing and late samples, and
//! the use of time.
//!
//! [`FidelityMeter`] takes samples and decisions one by one and needs a few numbers a step, during the run or from its log.

mod quality;

pub use quality::assess_data_quality;

use palpate_model::rig::{AxisStatus, Phase, RigDescription};
use palpate_protocols::engine::{Effect, EndingKind, Record};
use palpate_protocols::plans::Plan;
use palpate_protocols::{MeterSample, StepMeter, StepTarget};
use palpate_sessions::record::SampleRow;
use serde::Serialize;

/// A delay beyond this, in s, makes a sample late: two scheduler slices of a desktop host.
pub const LATE_S: f64 = 0.020;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TargetResult {
    pub step_index: usize,
    pub step: &'static str,
    /// Which repeat it belongs to; 0 where nothing is repeated.
    pub cycle: u32,
    /// `speed`, `speed by pulses`, `depth`, `force`, `duration`, `amplitude` or `frequency`.
    pub quantity: &'static str,
    pub unit: &'static str,
    pub target: f64,
    pub achieved: f64,
    /// The difference in percent of the target; `None` for a target of 0.
    pub error_percent: Option<f64>,
    /// Tolerance, in the unit.
    pub allowed: f64,
    pub is_within: bool,
}

impl TargetResult {
    fn of(step_index: usize, step: &'static str, cycle: u32, one: &StepTarget) -> Self {
        let error = one.achieved - one.target;
        Self {
            step_index,
            step,
            cycle,
            quantity: one.quantity,
            unit: one.unit,
            target: one.target,
            achieved: one.achieved,
            error_percent: (one.target != 0.0).then(|| 100.0 * error / one.target.abs()),
            allowed: one.allowed,
            is_within: error.abs() <= one.allowed,
        }
    }
}

fn sample(row: &SampleRow) -> MeterSample {
    MeterSample {
        tick: row.tick,
        status: AxisStatus(row.status),
        pulses: row.pulses,
        depth: row.depth,
        force: row.force,
    }
}

/// What a session's time went to, in s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct TimeUse {
    /// Self-test, homing, tare, finding contact.
    pub set_up_s: f64,
    pub motion_s: f64,
    /// At constant depth or force, and under a weight.
    pub hold_s: f64,
    /// Rests, questions, pauses, after a stop.
    pub waiting_s: f64,
}

impl TimeUse {
    fn add(&mut self, phase: Phase, seconds: f64) {
        let kind = match phase {
            Phase::Idle
            | Phase::SelfTest
            | Phase::Home
            | Phase::CheckHome
            | Phase::Tare
            | Phase::Contact => &mut self.set_up_s,
            Phase::Ramp
            | Phase::Unload
            | Phase::Sine
            | Phase::Follow
            | Phase::Retract
            | Phase::Jog => &mut self.motion_s,
            Phase::Hold | Phase::Creep | Phase::Weigh => &mut self.hold_s,
            Phase::Rest | Phase::Prompt | Phase::Paused | Phase::Stopped | Phase::Ended => {
                &mut self.waiting_s
            }
            // No run is in this phase.
            Phase::Imported => return,
        };
        *kind += seconds;
    }

    pub fn total_s(&self) -> f64 {
        self.set_up_s + self.motion_s + self.hold_s + self.waiting_s
    }
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Fidelity {
    /// Every target of every completed step, in the order done.
    pub targets: Vec<TargetResult>,
    pub samples: u64,
    /// Samples that are missing between them, by the controller's clock.
    pub dropped: u64,
    /// Samples that came more than [`LATE_S`] later than the one before explains.
    pub late: u64,
    /// The longest such delay in s.
    pub late_worst_s: f64,
    /// The longest time from one sample to the next by the controller's clock, in s.
    pub longest_gap_s: f64,
    pub time_use: TimeUse,
    pub measured: u64,
    /// Skipped steps, tripped monitors, missed pulses, lost contact, targets within their own tolerance.
    pub remarks: Vec<String>,
}

impl Fidelity {
    pub fn missed_targets(&self) -> impl Iterator<Item = &TargetResult> {
        self.targets.iter().filter(|one| !one.is_within)
    }
}

/// Samples that are missing between two samples so many ticks apart.
///
/// Of a rig that reports every tick, each tick between is missing. A polled rig delivers as its link allows: two scheduler
/// slices of a desktop host or half a sample are usual, and a longer gap misses what the rate promises.
fn missing_in(ticks: u64, rig: &RigDescription) -> u64 {
    let between = ticks.saturating_sub(1);
    let per_sample = rig.ticks_per_sample;
    if per_sample <= 1.0 {
        return between;
    }
    let usual = (LATE_S / rig.tick().0).max(1.5 * per_sample);
    if ticks as f64 <= usual { 0 } else { (between as f64 / per_sample) as u64 }
}

/// More remarks would not help a reviewer.
const REMARKS_MAX: usize = 20;

#[derive(Clone, Debug)]
pub struct FidelityMeter {
    plan: Plan,
    rig: RigDescription,
    found: Fidelity,
    /// The step in progress, by its place in the plan.
    current: Option<(usize, StepMeter)>,
    last: Option<SampleRow>,
}

impl FidelityMeter {
    #[must_use]
    pub fn new(plan: &Plan, rig: &RigDescription) -> Self {
        Self {
            plan: plan.clone(),
            rig: rig.clone(),
            found: Fidelity::default(),
            current: None,
            last: None,
        }
    }

    /// The decisions that follow from a sample come before [`FidelityMeter::row`] of that sample.
    pub fn push_effect(&mut self, effect: &Effect) {
        match effect {
            Effect::Record(record) => self.record(record),
            Effect::Finished(outcome) if outcome.ending == EndingKind::Finish => self.complete(),
            Effect::Finished(_) => self.current = None,
            Effect::Command(_) | Effect::ByHand(_) => {}
        }
    }

    fn record(&mut self, record: &Record) {
        match record {
            Record::PhaseStarted { step_index, .. } => {
                if self.current.as_ref().is_some_and(|(index, _)| index == step_index) {
                    return;
                }
                self.complete();
                let planned = self.plan.steps.get(*step_index);
                self.current =
                    planned.map(|planned| (*step_index, StepMeter::new(&planned.step, &self.rig)));
            }
            Record::ForceReached { force, .. } => {
                self.with_meter(|meter| meter.force_reached(*force));
            }
            Record::HoldEndedEarly { .. } | Record::HoldSteady { .. } => {
                self.with_meter(StepMeter::ignore_duration);
            }
            // An interrupted step has no duration or speed to compare.
            Record::Paused { .. } | Record::FinishedEarly | Record::EndingStarted { .. } => {
                self.current = None
            }
            Record::StepFailed { .. } => {
                self.current = None;
                self.remark(record.to_string());
            }
            Record::LeadLost { .. } => {
                self.with_meter(StepMeter::ignore_duration);
                self.remark(record.to_string());
            }
            Record::MonitorTripped { .. } | Record::InterlockTripped { .. } => {
                self.remark(record.to_string());
            }
            Record::HomeChecked { missed_pulses } if missed_pulses.abs() > 1 => {
                self.remark(record.to_string());
            }
            _ => {}
        }
    }

    fn with_meter(&mut self, change: impl FnOnce(&mut StepMeter)) {
        if let Some((_, meter)) = &mut self.current {
            change(meter);
        }
    }

    fn remark(&mut self, remark: String) {
        if self.found.remarks.len() < REMARKS_MAX {
            self.found.remarks.push(remark);
        }
    }

    fn complete(&mut self) {
        let (Some((step_index, meter)), Some(last)) = (self.current.take(), &self.last) else {
            return;
        };
        let (Some((targets, doubt)), Some(planned)) =
            (meter.finish(&sample(last)), self.plan.steps.get(step_index))
        else {
            return;
        };
        let step = planned.step.phase().name();
        let achieved = targets
            .into_iter()
            .map(|target| TargetResult::of(step_index, step, planned.cycle, &target));
        self.found.targets.extend(achieved);
        if let Some(doubt) = doubt {
            self.remark(format!("step {} ({step}): {doubt}", step_index + 1));
        }
    }

    pub fn push_row(&mut self, row: &SampleRow) {
        let tick_secs = self.rig.tick().0;
        self.found.samples += 1;
        let is_measuring = matches!(
            row.phase,
            Phase::Ramp
                | Phase::Hold
                | Phase::Creep
                | Phase::Sine
                | Phase::Follow
                | Phase::Unload
                | Phase::Weigh
        );
        self.found.measured += u64::from(is_measuring);
        let before = self.last.map_or(0, |last| last.host.0);
        let arrived = row.host.0.saturating_sub(before) as f64 * 1e-9;
        self.found.time_use.add(row.phase, arrived);
        // A restarted controller counts from zero again: missing samples are unknown.
        if let Some(ticks) = self.last.and_then(|last| row.tick.checked_sub(last.tick)) {
            self.found.dropped += missing_in(ticks, &self.rig);
            self.found.longest_gap_s = self.found.longest_gap_s.max(ticks as f64 * tick_secs);
            let delay = arrived - ticks as f64 * tick_secs;
            if delay > LATE_S {
                self.found.late += 1;
                self.found.late_worst_s = self.found.late_worst_s.max(delay);
            }
        }
        self.with_meter(|meter| meter.push(&sample(row)));
        self.last = Some(*row);
    }

    /// What was found until now.
    pub fn found(&self) -> &Fidelity {
        &self.found
    }

    #[must_use]
    pub fn into_fidelity(self) -> Fidelity {
        self.found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sessions::log::Session;
    use std::path::Path;

    fn recorded() -> Session {
        let sessions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/sessions");
        Session::open(&sessions.join("ramp-hold-lab")).unwrap()
    }

    #[test]
    fn missing_samples_are_counted_by_the_rate_of_the_rig() {
        let mut rig = recorded().manifest.rig.unwrap();
        rig.tick_nanos = 1_000_000;
        let missing = |per_sample: f64, ticks| {
            let rig = RigDescription { ticks_per_sample: per_sample, ..rig.clone() };
            missing_in(ticks, &rig)
        };
        // Every tick: each between is missing.
        assert_eq!([1, 2, 7].map(|ticks| missing(1.0, ticks)), [0, 1, 6]);
        // A sample in two milliseconds over a link: two scheduler slices are its way.
        assert_eq!([2, 20, 21].map(|ticks| missing(2.0, ticks)), [0, 0, 10]);
        // Eighty a second, by themselves: one that is garbled leaves 25 ms.
        assert_eq!([12, 13, 25, 38].map(|ticks| missing(12.5, ticks)), [0, 0, 1, 2]);
        // Ten a second.
        assert_eq!([100, 149, 200].map(|ticks| missing(100.0, ticks)), [0, 0, 1]);
    }
}
