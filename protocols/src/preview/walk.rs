//! Goes through a plan: duration and refusals of every step.

use super::StepPreview;
use super::expected::ExpectedSpecimen;
use super::moves::Reach;
use crate::plans::{OnFailure, PlannedStep};
use crate::steps::Preconditions;
use palpate_model::rig::{Limits, Phase, RigDescription};
use palpate_model::units::Seconds;

/// Where contact is expected when nothing is known: in the first half of the travel.
pub(crate) const CONTACT_EXPECTED_SHARE: f64 = 0.3;

/// Typical wait for the correction in progress until the axis rests, in s.
pub(crate) const SETTLE_SECS: f64 = 0.1;

pub(crate) struct Walk<'a> {
    pub rig: &'a RigDescription,
    pub limits: &'a Limits,
    pub refusals: Vec<String>,
    pub notes: Vec<String>,
    /// The specimen as it is expected, and the depth the plan has reached.
    pub expected: ExpectedSpecimen,
    pub known: Preconditions,
    pub phase: Phase,
    /// Where the probe may be, once contact is known.
    pub reach: Reach,
}

/// Expected and longest duration in s, and whether they are the same and exact.
pub(crate) struct DurationEstimate(pub f64, pub f64, pub bool);

impl Walk<'_> {
    pub(super) fn step(&mut self, index: usize, planned: &PlannedStep) -> StepPreview {
        let step = planned.step.kind();
        let phase = step.facts().phase;
        self.phase = phase;
        let refused_before = self.refusals.len();
        let missed = step.needs().iter().filter(|need| !self.known.has(**need));
        self.refusals.extend(missed.filter_map(|need| need.refusal()).map(str::to_owned));
        let DurationEstimate(expected, longest, is_exact) = step.expect(self);
        step.pass(&mut self.known);
        if matches!(planned.on_failure, OnFailure::Retry(_)) && step.facts().is_measuring {
            self.refusals.push(
                "a measurement cannot be retried, because tissue behaves differently once it has been indented; set 'on_failure' to abort or skip"
                    .into(),
            );
        }
        let refusals = self.refusals[refused_before..].to_vec();
        for refusal in &mut self.refusals[refused_before..] {
            *refusal = format!("step {}, {phase}: {refusal}", index + 1);
        }
        StepPreview {
            phase,
            expected: Seconds(expected),
            longest: Seconds(longest),
            is_exact,
            refusals,
        }
    }

    pub fn refuse(&mut self, reason: String) {
        self.refusals.push(reason);
    }

    /// Whether anything was refused so far: from there on places are not known.
    pub fn is_refused(&self) -> bool {
        !self.refusals.is_empty()
    }

    /// Every pass of a loop makes the same note: it is listed once.
    pub fn note(&mut self, note: String) {
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }
}
