//! A plan gone through: what every step takes, and what refuses it.

use super::StepPreview;
use super::expected::Expected;
use super::moves::Reach;
use crate::plans::{OnFailure, PlannedStep};
use crate::steps::Known;
use palpate_model::rig::{Limits, Phase, RigDescription};
use palpate_model::units::Seconds;

/// Where contact is expected when nothing is known: in the first half of the travel.
pub(crate) const CONTACT_EXPECTED_SHARE: f64 = 0.3;

/// What ends at rest may wait about so long for the correction under way.
pub(crate) const SETTLE_SECS: f64 = 0.1;

/// A plan gone through step by step. Each step says here what it expects.
pub(crate) struct Walk<'a> {
    pub rig: &'a RigDescription,
    pub limits: &'a Limits,
    pub refusals: Vec<String>,
    pub notes: Vec<String>,
    /// The specimen as it is expected, and the depth the plan has reached.
    pub expected: Expected,
    pub known: Known,
    /// Phase of the step in progress.
    pub phase: Phase,
    /// Where the probe may be, once contact is known.
    pub reach: Reach,
}

/// Expected and longest duration, and whether they are the same and exact.
pub(crate) struct Span(pub f64, pub f64, pub bool);

impl Walk<'_> {
    pub(super) fn step(&mut self, index: usize, planned: &PlannedStep) -> StepPreview {
        let step = planned.step.kind();
        let phase = step.facts().phase;
        self.phase = phase;
        let refused_before = self.refusals.len();
        let missed = step.needs().iter().filter(|need| !self.known.has(**need));
        self.refusals.extend(missed.filter_map(|need| need.refusal()).map(str::to_owned));
        let Span(expected, longest, is_exact) = step.expect(self);
        step.pass(&mut self.known);
        if matches!(planned.on_failure, OnFailure::Retry(_)) && step.facts().is_measuring {
            self.refusals.push(
                "a measurement cannot be tried again, for tissue that was indented is another specimen; let it abort or skip"
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

    /// Notes what the same step in a loop has not told yet.
    pub fn note(&mut self, note: String) {
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }
}
