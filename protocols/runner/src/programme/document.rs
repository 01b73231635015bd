//! What a programme is; its text is read by `read`.

use super::labels::LabelSettings;
use palpate_model::metadata::SessionLabels;
use palpate_model::rig::HandAction;
use palpate_model::units::Seconds;
use palpate_protocols::file::{Protocol, ProtocolProblem};
use palpate_protocols::plans::{OnTimeout, Plan, Prompt, Rest, Step};
use std::collections::BTreeMap;
use thiserror::Error;

/// How long a person has to clip a specimen in.
const MOUNT_TIMEOUT: Seconds = Seconds(3600.0);

/// What a programme does, in order.
#[derive(Clone, Debug)]
pub struct Programme {
    /// Name, such as `day-in-the-lab`.
    pub name: String,
    pub title: String,
    pub purpose: String,
    /// Labels of every session that sets no others.
    pub default_labels: SessionLabels,
    /// Whether what previews ask to acknowledge is acknowledged; it is recorded in every session.
    pub is_acknowledged: bool,
    /// Settings of the simulated rig that differ from the usual ones.
    pub simulated: BTreeMap<String, String>,
    pub tasks: Vec<ProgrammeTask>,
    pub(super) label_settings: LabelSettings,
}

#[derive(Clone, Debug)]
pub struct ProgrammeTask {
    pub name: String,
    pub protocol: Protocol,
    pub values: BTreeMap<String, String>,
    /// Number of the specimen that is clipped in first; none keeps the one that is there.
    pub specimen: Option<u64>,
    pub repeats: u32,
    /// Rest before every repeat but the first.
    pub rest: Seconds,
    /// Whether forces of later tasks follow the calibration it measures.
    pub calibrates: bool,
    /// Which task's model its sessions are compared with.
    pub validates: Option<ModelReference>,
    pub line: u32,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ModelReference {
    /// Name of the task whose first session is fitted.
    pub task: String,
}

/// A programme that cannot be carried out, with every reason; prints as a sentence for each.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct ProgrammeError(pub Vec<ProtocolProblem>);

impl Programme {
    /// Whether a text is meant as a programme rather than a protocol.
    #[must_use]
    pub fn is_programme_text(text: &str) -> bool {
        let is_own = |line: &str| {
            let line = line.trim_start();
            line.starts_with("palpate-programme") || line.starts_with("[[task]]")
        };
        text.lines().any(is_own)
    }

    pub fn specimen_at(&self, task: usize) -> Option<u64> {
        let so_far = self.tasks.iter().take(task + 1).rev();
        so_far.filter_map(|task| task.specimen).next()
    }

    pub fn session_count(&self) -> u32 {
        self.tasks.iter().map(|task| task.repeats).sum()
    }
}

impl ProgrammeTask {
    /// The plan of one repeat, counted from 1: the protocol's, behind the rest and the specimen it needs. `remount`
    /// is the specimen that the operator must check before an interrupted programme goes on.
    pub fn plan(&self, repeat: u32, remount: Option<u64>) -> Option<Plan> {
        let mut plan = self.protocol.plan(&self.values).ok()?;
        let mut before = Vec::new();
        if repeat > 1 && self.rest.0 > 0.0 {
            let duration = self.rest;
            before.push(Rest { duration }.into());
        }
        if remount.is_some() {
            // An interrupted run may have left the probe in the tissue, and no specimen can be clipped in under it.
            let ways_up = |step: &&Step| matches!(step, Step::SelfTest(_) | Step::Home(_));
            before.extend(plan.steps.iter().map(|one| &one.step).filter(ways_up).cloned());
        }
        let fresh = self.specimen.filter(|_| repeat == 1);
        if let Some(specimen) = fresh.or(remount) {
            before.push(Step::Prompt(Prompt {
                message: format!("Mount specimen {specimen}; the probe must not touch it"),
                timeout: MOUNT_TIMEOUT,
                on_timeout: OnTimeout::Stop,
                hand: Some(HandAction::Mount { specimen }),
            }));
        }
        plan.steps.splice(0..0, before.into_iter().map(Into::into));
        Some(plan)
    }
}
