//! Starting a run: every check comes before any motion.

use super::active_run::ActiveRun;
use super::clock::wall_now;
use super::leading::SharedLeadSource;
use super::study::complete_labels;
use super::watch::HostWatch;
use palpate_model::Nanos;
use palpate_model::calibration::Calibration;
use palpate_model::metadata::SessionLabels;
use palpate_model::rig::{Limits, RigDescription};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_protocols::engine::{ENGINE_VERSION, EngineConfig};
use palpate_protocols::plans::Plan;
use palpate_protocols::preview::{Preview, preview};
use palpate_sessions::populations::is_member;
use palpate_sessions::{
    Manifest, RECORD_VERSION, RecordingPace, SessionFolder, SessionWriter, check_free_space,
    library_folder, new_session_folder, new_session_id, spare_folder,
};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::SystemTime;
use thiserror::Error;

/// What happens when a run stopped before its plan was complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AfterStop {
    /// Unattended: close the session where the probe stands.
    Close,
    Wait,
    /// As [`Self::Wait`], but a pause that cannot end by itself ends the run: nothing can resume it.
    Ask,
}

/// Who answers the plan's prompts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PromptResponder {
    /// The operator, within the prompt's time.
    #[default]
    Operator,
    /// The program, at once: a simulated rig simulates the hand too.
    Confirm,
}

#[derive(Clone, Debug)]
pub struct RunRequest {
    pub plan: Plan,
    /// Volts to newtons.
    pub calibration: Calibration,
    /// Interlock thresholds.
    pub limits: Limits,
    /// Session folder; a new one in the library if none.
    pub out: Option<PathBuf>,
    pub labels: SessionLabels,
    /// Whether the operator acknowledged what the preview asks to acknowledge.
    pub is_acknowledged: bool,
    /// What beside the preview is to be acknowledged, such as a daily check that failed.
    pub to_acknowledge: Vec<String>,
    pub after_stop: AfterStop,
    pub answers: PromptResponder,
    /// Source of leads for a step that follows; a plan with such a step is refused without it.
    pub leader: Option<SharedLeadSource>,
}

#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum StartError {
    /// The request is not possible; nothing was changed.
    #[error("{0}")]
    Refused(String),
    #[error("{0}")]
    Failed(String),
}

/// What the runner knows about the rig when a run is asked for.
pub(super) struct RigContext<'a> {
    pub rig: &'a Arc<RigDescription>,
    pub is_virtual: bool,
    pub is_homed: bool,
    /// The rig's clock now: session time zero.
    pub origin: Nanos,
    /// Watches the computer; `None` at full pace.
    pub watch: Option<HostWatch>,
}

pub(super) fn start(
    request: &RunRequest,
    context: RigContext<'_>,
) -> Result<ActiveRun, StartError> {
    let refused = |reason: String| StartError::Refused(reason);
    if let (None, Some(reason)) = (&request.leader, request.plan.refusal_without_master()) {
        return Err(refused(reason));
    }
    let curve = request.calibration.curve().map_err(|err| refused(err.to_string()))?;
    let preview = preview(&request.plan, context.rig, &request.limits, &curve, context.is_homed);
    preview.check_start(request.is_acknowledged).map_err(refused)?;
    if let (Some(first), false) = (request.to_acknowledge.first(), request.is_acknowledged) {
        return Err(refused(format!("{first}; acknowledge this to continue")));
    }
    let mut labels = request.labels.clone();
    if let Ok(library) = library_folder() {
        complete_labels(&mut labels, &library).map_err(|err| refused(err.to_string()))?;
    }
    labels.check().map_err(|err| refused(err.to_string()))?;
    // A session must not name a simulated specimen that was not simulated.
    let is_simulated = context.rig.settings.contains_key(ModifiedKelvin::THESIS.named()[0].0);
    if is_member(&labels.specimen) && !is_simulated {
        return Err(refused(format!(
            "the rig does not simulate '{}'; start this run with --specimen on the command line, or give the name of the specimen on the rig",
            labels.specimen
        )));
    }

    let started_at = wall_now();
    let session_id = new_session_id(started_at.into());
    let path = match &request.out {
        Some(path) => path.clone(),
        None => {
            let library = library_folder().map_err(|err| refused(err.to_string()))?;
            new_session_folder(&library, &session_id)
        }
    };
    check_free_space(&path, preview.storage_bytes).map_err(|err| refused(err.to_string()))?;
    let folder = SessionFolder::create(&path).map_err(|err| refused(err.to_string()))?;

    let mut manifest = manifest(request, &context, &preview, session_id.clone(), started_at)?;
    manifest.set_labels(labels);
    let pace = if context.is_virtual { RecordingPace::Virtual } else { RecordingPace::Real };
    let writer = SessionWriter::start(folder, spare_folder().as_deref(), &manifest, pace)
        .map_err(|err| StartError::Failed(err.to_string()))?;
    let config = EngineConfig {
        rig: context.rig.as_ref().clone(),
        limits: request.plan.limits.tighten(request.limits),
        curve,
        plan: request.plan.clone(),
        is_homed: context.is_homed,
    };
    Ok(ActiveRun::new(config, preview, (writer, session_id), path, request, context))
}

fn manifest(
    request: &RunRequest,
    context: &RigContext<'_>,
    preview: &Preview,
    session_id: String,
    started_at: SystemTime,
) -> Result<Manifest, StartError> {
    let json = |what: &str, value: serde_json::Result<serde_json::Value>| {
        value.map_err(|err| StartError::Failed(format!("the {what} cannot be recorded ({err})")))
    };
    let mut acknowledgements = Vec::new();
    if request.is_acknowledged {
        acknowledgements.extend_from_slice(&preview.acknowledgements);
        acknowledgements.extend_from_slice(&request.to_acknowledge);
    }
    Ok(Manifest {
        record_version: RECORD_VERSION,
        session_id,
        software_version: env!("CARGO_PKG_VERSION").into(),
        engine_version: ENGINE_VERSION,
        started_at: started_at.into(),
        signal: Some(context.rig.signal()),
        rig: Some(context.rig.as_ref().clone()),
        limits: Some(request.limits),
        calibration: json("calibration", serde_json::to_value(&request.calibration))?,
        plan: json("plan", serde_json::to_value(&request.plan))?,
        settings: serde_json::json!({ "is_homed_at_start": context.is_homed }),
        acknowledgements,
        ..Manifest::default()
    })
}
