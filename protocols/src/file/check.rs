//! Everything that can be said of a protocol before it runs: the language, the order of steps, and the rig.

use super::problem::{PROBLEMS_MAX, ProtocolProblem};
use super::{ExpandedProtocol, Protocol};
use crate::preview::{Preview, preview};
use palpate_model::calibration::CalibrationCurve;
use palpate_model::rig::{Limits, RigDescription};
use std::collections::BTreeMap;

#[derive(Clone, Debug)]
pub struct ProtocolCheck {
    /// The protocol with its plan and preview for the chosen values; none if it cannot be read or written out.
    pub plan: Option<(Protocol, ExpandedProtocol, Preview)>,
    /// Errors and warnings, in order of lines.
    pub problems: Vec<ProtocolProblem>,
}

impl ProtocolCheck {
    pub fn is_sound(&self) -> bool {
        !self.problems.iter().any(ProtocolProblem::is_error)
    }
}

/// Checks a text with chosen values on a rig whose axis is not homed.
#[must_use]
pub fn check(
    text: &str,
    values: &BTreeMap<String, String>,
    rig: &RigDescription,
    limits: &Limits,
    curve: &CalibrationCurve,
) -> ProtocolCheck {
    let written = Protocol::read(text)
        .and_then(|protocol| protocol.write_out(values).map(|written| (protocol, written)));
    let (protocol, written) = match written {
        Ok(pair) => pair,
        Err(problems) => {
            return ProtocolCheck { plan: None, problems };
        }
    };
    let preview = preview(&written.plan, rig, limits, curve, false);
    let mut problems = written.warnings.clone();
    for (step, line) in preview.steps.iter().zip(&written.lines) {
        for reason in &step.refusals {
            let problem = ProtocolProblem::error(*line, reason.clone());
            // Every pass of a loop is refused for the same reason.
            if problems.len() < PROBLEMS_MAX && !problems.contains(&problem) {
                problems.push(problem);
            }
        }
    }
    for reason in written.plan.limits.unused(limits) {
        problems.push(ProtocolProblem::warning(protocol.limits_line(), reason));
    }
    problems.sort_by_key(|problem| problem.line);
    ProtocolCheck { plan: Some((protocol, written, preview)), problems }
}
