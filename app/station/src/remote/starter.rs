//! Carries out what the desk decides: starts runs, follows them to their end, fits them.

use super::{RemoteDesk, RemoteRunState};
use palpate_analysis::daily::DailyCheckGate;
use palpate_analysis::fit::FitRecipe;
use palpate_analysis::source::SourceSelection;
use palpate_model::calibration::Calibration;
use palpate_model::rig::Limits;
use palpate_protocols::plans::Plan;
use palpate_protocols::preview::preview;
use palpate_rheology::fit::FitOptions;
use palpate_runner::{
    AfterStop, PromptResponder, RigView, RunRequest, RunnerHandle, RunnerRequest, RunnerSnapshot,
    StartError, wall_now,
};
use palpate_sessions::new_session_folder;
use palpate_sessions::new_session_id;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

/// What runs over the network are made with.
#[derive(Clone, Debug)]
pub struct RemoteBench {
    /// Volts to newtons.
    pub calibration: Calibration,
    /// Interlock thresholds.
    pub limits: Limits,
    /// Sentences that a person at the rig must acknowledge: with any of them nothing is started.
    pub to_acknowledge: Vec<String>,
    pub is_virtual: bool,
    pub library: PathBuf,
}

impl RemoteBench {
    /// Whether the rig can run a plan without an acknowledgement, or why not.
    pub(crate) fn check(&self, plan: &Plan, rig: &RigView) -> Result<(), String> {
        let curve = self.calibration.curve().map_err(|err| err.to_string())?;
        let preview = preview(plan, &rig.description, &self.limits, &curve, rig.is_homed);
        preview.check_start(false)
    }
}

/// A run of ours that was asked of the runner.
struct Begun {
    id: u64,
    folder: PathBuf,
    /// Until the runner has answered.
    answer: Option<Receiver<Result<(), StartError>>>,
    audit: String,
}

/// Looks at the desk and the rig from time to time.
pub(crate) struct Starter {
    desk: Arc<Mutex<RemoteDesk>>,
    runner: RunnerHandle,
    begun: Option<Begun>,
}

/// A fit to make on a thread that may take its time.
pub(crate) struct FitWork {
    id: u64,
    folder: PathBuf,
    desk: Arc<Mutex<RemoteDesk>>,
}

impl FitWork {
    pub fn carry_out(self) {
        let fit = fit(&self.folder);
        lock(&self.desk).fitted(self.id, fit);
    }
}

pub(crate) fn lock(desk: &Mutex<RemoteDesk>) -> std::sync::MutexGuard<'_, RemoteDesk> {
    // The desk is consistent between its calls; a panic elsewhere does not change that.
    desk.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Starter {
    pub fn new(desk: Arc<Mutex<RemoteDesk>>, runner: RunnerHandle) -> Self {
        Self { desk, runner, begun: None }
    }

    /// Goes on by a step; a fit is returned where a run has ended. It reads the journal of daily checks where it starts one.
    pub fn turn(&mut self, bench: Option<&RemoteBench>) -> Option<FitWork> {
        let snapshot = self.runner.snapshot();
        let now = wall_now();
        {
            let mut desk = lock(&self.desk);
            desk.expire(now);
            if let Some(reason) = fault(&snapshot, self.runner.is_alive()) {
                desk.disarm(&reason);
            }
        }
        if let Some(begun) = self.begun.take() {
            let (begun, work) = self.follow(begun, &snapshot);
            self.begun = begun;
            return work;
        }
        let is_free = snapshot.run.as_ref().is_none_or(|run| run.outcome.is_some());
        if let (Some(bench), true) = (bench, is_free) {
            let next = lock(&self.desk).next(now);
            if let Some((id, queue, plan)) = next {
                match self.start(id, &queue.labels, plan, bench) {
                    Ok(begun) => self.begun = Some(begun),
                    Err(reason) => lock(&self.desk).refused(id, reason),
                }
            }
        }
        None
    }

    fn start(
        &self,
        id: u64,
        labels: &palpate_model::metadata::SessionLabels,
        plan: Plan,
        bench: &RemoteBench,
    ) -> Result<Begun, String> {
        let rig = &self.runner.snapshot().rig.description.name.clone();
        let gate =
            DailyCheckGate::of(&plan, Some(&bench.library), rig, bench.is_virtual, wall_now())
                .map_err(|err| err.to_string())?;
        let mut to_acknowledge = bench.to_acknowledge.clone();
        to_acknowledge.extend(gate.to_acknowledge());
        let folder = new_session_folder(&bench.library, &new_session_id(wall_now().into()));
        let request = RunRequest {
            plan,
            calibration: bench.calibration.clone(),
            limits: bench.limits,
            out: Some(folder.clone()),
            labels: labels.clone(),
            // Only a person at the rig can acknowledge.
            is_acknowledged: false,
            to_acknowledge,
            after_stop: AfterStop::Close,
            answers: match bench.is_virtual {
                true => PromptResponder::Confirm,
                false => PromptResponder::Operator,
            },
            leader: None,
        };
        let audit = {
            let desk = lock(&self.desk);
            let run = desk.run(id).map_err(|err| err.to_string())?;
            let values: Vec<String> =
                run.values.iter().map(|(name, value)| format!("{name} = {value}")).collect();
            format!(
                "run {id} of the armed queue '{}', asked for over the network by '{}' ({}){}",
                run.queue,
                run.token,
                values.join(", "),
                match run.remark.as_str() {
                    "" => String::new(),
                    remark => format!(": {remark}"),
                }
            )
        };
        let (reply, answer) = sync_channel(1);
        lock(&self.desk).send(id, || {
            self.runner.request(RunnerRequest::Run(Box::new(request), reply))?;
            // Served right behind the start, so that a run at full pace has it too.
            self.runner.request(RunnerRequest::Note(audit.clone()))
        })?;
        tracing::info!("{audit}");
        Ok(Begun { id, folder, answer: Some(answer), audit })
    }

    fn follow(
        &self,
        mut begun: Begun,
        snapshot: &RunnerSnapshot,
    ) -> (Option<Begun>, Option<FitWork>) {
        let mut desk = lock(&self.desk);
        let ended = "the thread that controls the rig has ended";
        if let Some(answer) = &begun.answer {
            match answer.try_recv() {
                Ok(Ok(())) => {
                    desk.begun(begun.id, begun.folder.clone());
                    begun.answer = None;
                }
                Ok(Err(StartError::Refused(reason))) => {
                    desk.refused(begun.id, reason);
                    return (None, None);
                }
                Ok(Err(StartError::Failed(reason))) => {
                    desk.refused(begun.id, reason.clone());
                    desk.disarm(&reason);
                    return (None, None);
                }
                Err(TryRecvError::Empty) if self.runner.is_alive() => {}
                Err(_) => {
                    desk.refused(begun.id, ended.to_owned());
                    desk.disarm(ended);
                    return (None, None);
                }
            }
        }
        let own = snapshot.run.as_ref().filter(|run| run.folder == begun.folder);
        if let Some(outcome) = own.and_then(|run| run.outcome.as_ref()) {
            desk.ended(begun.id, outcome.ending, &outcome.reason);
            tracing::info!("{}: ended by {}", begun.audit, outcome.ending);
            let work = FitWork { id: begun.id, folder: begun.folder, desk: Arc::clone(&self.desk) };
            return (None, Some(work));
        }
        if !self.runner.is_alive() {
            desk.refused(begun.id, ended.to_owned());
            return (None, None);
        }
        let is_replaced = begun.answer.is_none()
            && own.is_none()
            && snapshot.run.as_ref().is_some_and(|run| run.outcome.is_none())
            && desk.run(begun.id).is_ok_and(|run| run.state == RemoteRunState::Running);
        if is_replaced {
            // A person has started another run before we looked: ours is over.
            desk.refused(begun.id, "another run has taken its place; see its session".into());
            desk.disarm("a person at the rig started another run");
            return (None, None);
        }
        (Some(begun), None)
    }
}

/// Why the rig can no longer be trusted unattended.
fn fault(snapshot: &RunnerSnapshot, is_alive: bool) -> Option<String> {
    if !is_alive {
        return Some("the thread that controls the rig has ended".into());
    }
    if let Some(reason) = &snapshot.rig.link_error {
        return Some(format!("the link to the rig was lost: {reason}"));
    }
    let run = snapshot.run.as_ref()?;
    if let Some(reason) = &run.log_error {
        return Some(format!("the session could not be written: {reason}"));
    }
    run.holding.as_ref().map(|stop| format!("the run was stopped: {}", stop.reason))
}

/// Parameters of the default model, as `palpate fit` finds them, or why there are none.
fn fit(folder: &Path) -> Value {
    let recipe = FitRecipe::new(FitOptions::default(), SourceSelection::default());
    let fitted = match recipe.fit(folder) {
        Ok(fitted) => fitted,
        Err(err) => return json!({ "error": err.to_string() }),
    };
    match &fitted.result {
        Ok(report) => json!({
            "model": report.model,
            "parameters": report.parameters,
            "rmse_n": report.rmse_n,
            "r2": report.r2,
            "warnings": report.warnings,
        }),
        Err(refusal) => json!({ "error": refusal.to_string() }),
    }
}
