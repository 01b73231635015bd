//! Runs that are asked for over the network: only of a queue that a person at the rig has armed, for a time that they chose.
//! Any fault, any stop and any run that did not finish takes the arming back.

mod queue;
mod starter;

pub use queue::{AllowedRange, RemoteQueue, RemoteQueueError};
pub use starter::RemoteBench;
pub(crate) use starter::{Starter, lock};

use palpate_protocols::engine::EndingKind;
use palpate_protocols::plans::Plan;
use palpate_sessions::journal::format_time;
use serde::Serialize;
use serde_json::Value;
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, SystemTime};
use thiserror::Error;

/// Runs that may wait: whoever decides from results asks for a few at a time.
const WAITING_MAX: usize = 20;

/// Runs that are remembered.
const REMEMBERED_MAX: usize = 500;

/// Longest time of an arming.
pub const ARMED_MAX: Duration = Duration::from_hours(24);

/// Longest remark with a run.
const REMARK_MAX: usize = 500;

#[derive(Clone, Debug)]
struct Arming {
    queue: Arc<RemoteQueue>,
    until: SystemTime,
    runs_left: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RemoteRunState {
    Waiting,
    Running,
    Ended,
    /// It could not be started.
    Refused,
    /// Taken back before its start, by whoever asked or because the arming was.
    Withdrawn,
}

impl RemoteRunState {
    /// In a sentence behind the name of a run.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Waiting => "waits",
            Self::Running => "is in progress",
            Self::Ended => "has ended",
            Self::Refused => "was refused",
            Self::Withdrawn => "was withdrawn",
        }
    }
}

/// A run that was asked for over the network.
#[derive(Clone, Debug, Serialize)]
pub struct RemoteRun {
    pub id: u64,
    pub queue: String,
    /// Name of the token that asked for it.
    pub token: String,
    pub asked_at: String,
    pub values: BTreeMap<String, String>,
    pub remark: String,
    pub state: RemoteRunState,
    /// Name of the session's folder, once it has one.
    pub session: Option<String>,
    pub ending: Option<String>,
    /// Why it ended, was refused or withdrawn.
    pub reason: Option<String>,
    /// Parameters of the exact fit, or why there are none; absent until it is done.
    pub fit: Option<Value>,
    #[serde(skip)]
    folder: Option<PathBuf>,
    /// Whether the runner was asked to begin it.
    #[serde(skip)]
    is_sent: bool,
}

/// What a run asked for.
#[derive(Clone, Debug, Default)]
pub struct RemoteRequest {
    pub queue: String,
    pub values: BTreeMap<String, String>,
    pub remark: String,
}

#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum RemoteRefusal {
    #[error("no queue is armed ({0}); a person at the rig must arm one")]
    NotArmed(String),
    #[error("the queue '{armed}' is armed, not '{asked}'; name that one")]
    OtherQueue { armed: String, asked: String },
    #[error("{0}")]
    Values(String),
    #[error("{WAITING_MAX} runs wait already; wait for one to end")]
    Full,
    #[error("all runs of this arming are used; a person at the rig must arm the queue again")]
    Used,
    #[error("there is no run {0}")]
    Unknown(u64),
    #[error("run {0} does not wait any more, so it cannot be withdrawn; stop the rig to end it")]
    NotWaiting(u64),
    #[error("{queue}: {values} cannot be run: {reason}; change the file of the queue")]
    Corner { queue: String, values: String, reason: String },
    #[error("an arming lasts from a minute to 24 hours; give a time in between")]
    Time,
}

/// What is armed, and what is asked for. It decides; [`Starter`] carries out.
#[derive(Debug, Default)]
pub struct RemoteDesk {
    arming: Option<Arming>,
    /// Why the last arming was taken back.
    disarmed: Option<String>,
    /// Why the rig is not free, where the front end needs it.
    busy: Option<String>,
    runs: VecDeque<RemoteRun>,
    last_id: u64,
}

/// What everybody may see of it.
#[derive(Debug, Serialize)]
pub struct RemoteState {
    pub armed: Option<ArmedState>,
    /// Why nothing is armed.
    pub disarmed: Option<String>,
    /// Newest last.
    pub runs: Vec<RemoteRun>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ArmedState {
    pub queue: String,
    pub protocol: String,
    pub until: String,
    pub runs_left: u32,
    /// Smallest and largest value of each parameter that may be chosen, in its unit.
    pub choose: BTreeMap<String, (f64, f64, &'static str)>,
}

impl RemoteDesk {
    /// Arms a queue that was [checked](RemoteQueue::check), in place of any other.
    pub(crate) fn arm(
        &mut self,
        queue: RemoteQueue,
        now: SystemTime,
        time: Duration,
    ) -> Result<(), RemoteRefusal> {
        if !(Duration::from_mins(1)..=ARMED_MAX).contains(&time) {
            return Err(RemoteRefusal::Time);
        }
        self.disarm("another queue was armed");
        self.disarmed = None;
        let runs_left = queue.runs_max;
        self.arming = Some(Arming { queue: Arc::new(queue), until: now + time, runs_left });
        Ok(())
    }

    /// Takes the arming back; what the runner was not asked for yet is withdrawn. A run in progress goes on.
    pub fn disarm(&mut self, reason: &str) {
        if self.arming.take().is_none() {
            return;
        }
        self.disarmed = Some(reason.to_owned());
        let is_withdrawn = |run: &RemoteRun| match run.state {
            RemoteRunState::Waiting => true,
            RemoteRunState::Running => !run.is_sent,
            _ => false,
        };
        for run in self.runs.iter_mut().filter(|run| is_withdrawn(run)) {
            run.state = RemoteRunState::Withdrawn;
            run.reason = Some(format!("the arming was taken back: {reason}"));
        }
    }

    /// Takes the arming back behind a stop that was passed on. Where a run was begun at the same time, its start may stand behind
    /// that stop: then it is true, and the stop must be passed on once more.
    #[must_use]
    pub fn disarm_for_stop(&mut self, reason: &str) -> bool {
        self.disarm(reason);
        self.running().is_some_and(|run| run.session.is_none())
    }

    /// Lets `send` ask the runner for a run, unless it was withdrawn meanwhile: whoever takes the arming back does it before this
    /// or after it.
    fn send(&mut self, id: u64, send: impl FnOnce() -> Result<(), String>) -> Result<(), String> {
        let run = self.run_mut(id).ok_or("the run is forgotten")?;
        if run.state != RemoteRunState::Running {
            return Err(run.reason.clone().unwrap_or_default());
        }
        run.is_sent = true;
        send()
    }

    /// Says whether the front end needs the rig for itself, and for what.
    pub fn set_busy(&mut self, reason: Option<String>) {
        self.busy = reason;
    }

    /// Takes back an arming whose time is over.
    pub fn expire(&mut self, now: SystemTime) {
        if self.arming.as_ref().is_some_and(|arming| arming.until <= now) {
            self.disarm("its time is over");
        }
    }

    pub fn armed(&self) -> Option<ArmedState> {
        let arming = self.arming.as_ref()?;
        let allowed = arming.queue.allowed.iter();
        Some(ArmedState {
            queue: arming.queue.name.clone(),
            protocol: arming.queue.protocol.name.clone(),
            until: format_time(arming.until),
            runs_left: arming.runs_left,
            choose: allowed
                .map(|(name, range)| (name.clone(), (range.from, range.to, range.kind.unit())))
                .collect(),
        })
    }

    #[must_use]
    pub fn state(&self, most: usize) -> RemoteState {
        let skipped = self.runs.len().saturating_sub(most);
        RemoteState {
            armed: self.armed(),
            disarmed: self.disarmed.clone(),
            runs: self.runs.iter().skip(skipped).cloned().collect(),
        }
    }

    pub fn run(&self, id: u64) -> Result<&RemoteRun, RemoteRefusal> {
        self.runs.iter().find(|run| run.id == id).ok_or(RemoteRefusal::Unknown(id))
    }

    fn run_mut(&mut self, id: u64) -> Option<&mut RemoteRun> {
        self.runs.iter_mut().find(|run| run.id == id)
    }

    fn waiting(&self) -> impl Iterator<Item = &RemoteRun> {
        self.runs.iter().filter(|run| run.state == RemoteRunState::Waiting)
    }

    /// Puts a run at the end of those that wait; `check` says whether the rig can run its plan.
    pub fn ask(
        &mut self,
        request: RemoteRequest,
        token: &str,
        now: SystemTime,
        check: impl FnOnce(&Plan) -> Result<(), String>,
    ) -> Result<&RemoteRun, RemoteRefusal> {
        self.expire(now);
        let Some(arming) = &self.arming else {
            let reason = self.disarmed.clone().unwrap_or_else(|| "none was armed yet".into());
            return Err(RemoteRefusal::NotArmed(reason));
        };
        if arming.queue.name != request.queue {
            let armed = arming.queue.name.clone();
            return Err(RemoteRefusal::OtherQueue { armed, asked: request.queue });
        }
        if request.remark.chars().count() > REMARK_MAX {
            let most = format!("the remark is too long; give at most {REMARK_MAX} characters");
            return Err(RemoteRefusal::Values(most));
        }
        let plan = arming.queue.plan(&request.values).map_err(RemoteRefusal::Values)?;
        check(&plan).map_err(RemoteRefusal::Values)?;
        let waiting = self.waiting().count();
        if waiting >= WAITING_MAX {
            return Err(RemoteRefusal::Full);
        }
        if waiting as u64 >= u64::from(arming.runs_left) {
            return Err(RemoteRefusal::Used);
        }
        let is_over = |run: &RemoteRun| {
            !matches!(run.state, RemoteRunState::Waiting | RemoteRunState::Running)
        };
        if self.runs.len() >= REMEMBERED_MAX
            && let Some(oldest) = self.runs.iter().position(is_over)
        {
            self.runs.remove(oldest);
        }
        self.last_id += 1;
        self.runs.push_back(RemoteRun {
            id: self.last_id,
            queue: request.queue,
            token: token.to_owned(),
            asked_at: format_time(now),
            values: request.values,
            remark: request.remark,
            state: RemoteRunState::Waiting,
            session: None,
            ending: None,
            reason: None,
            fit: None,
            folder: None,
            is_sent: false,
        });
        self.run(self.last_id)
    }

    /// Takes back a run that waits.
    pub fn withdraw(&mut self, id: u64, token: &str) -> Result<(), RemoteRefusal> {
        let run = self.run_mut(id).ok_or(RemoteRefusal::Unknown(id))?;
        if run.state != RemoteRunState::Waiting {
            return Err(RemoteRefusal::NotWaiting(id));
        }
        run.state = RemoteRunState::Withdrawn;
        run.reason = Some(format!("withdrawn by '{token}'"));
        Ok(())
    }

    /// The next run to start, with its plan, if the rig is free; it counts as running from now on.
    fn next(&mut self, now: SystemTime) -> Option<(u64, Arc<RemoteQueue>, Plan)> {
        self.expire(now);
        if self.busy.is_some() || self.running().is_some() {
            return None;
        }
        let queue = Arc::clone(&self.arming.as_ref()?.queue);
        let (id, values) = self.waiting().next().map(|run| (run.id, run.values.clone()))?;
        let plan = queue.plan(&values);
        let run = self.run_mut(id)?;
        match plan {
            Ok(plan) => {
                run.state = RemoteRunState::Running;
                if let Some(arming) = &mut self.arming {
                    arming.runs_left = arming.runs_left.saturating_sub(1);
                }
                Some((id, queue, plan))
            }
            Err(reason) => {
                run.state = RemoteRunState::Refused;
                run.reason = Some(reason);
                None
            }
        }
    }

    fn running(&self) -> Option<&RemoteRun> {
        self.runs.iter().find(|run| run.state == RemoteRunState::Running)
    }

    fn refused(&mut self, id: u64, reason: String) {
        if let Some(run) = self.run_mut(id).filter(|run| run.state == RemoteRunState::Running) {
            run.state = RemoteRunState::Refused;
            run.reason = Some(reason);
        }
    }

    fn begun(&mut self, id: u64, folder: PathBuf) {
        if let Some(run) = self.run_mut(id) {
            run.session = folder.file_name().map(|name| name.to_string_lossy().into_owned());
            run.folder = Some(folder);
        }
    }

    /// A run of ours has ended. One that did not finish takes the arming back.
    fn ended(&mut self, id: u64, ending: EndingKind, reason: &str) {
        if let Some(run) = self.run_mut(id) {
            run.state = RemoteRunState::Ended;
            run.ending = Some(ending.name().to_owned());
            run.reason = Some(reason.to_owned());
        }
        if ending != EndingKind::Finish {
            self.disarm(&format!("run {id} ended by {ending}: {reason}"));
        } else if self.arming.as_ref().is_some_and(|arming| arming.runs_left == 0) {
            self.disarm("all its runs are used");
        }
    }

    fn fitted(&mut self, id: u64, fit: Value) {
        if let Some(run) = self.run_mut(id) {
            run.fit = Some(fit);
        }
    }
}

#[cfg(test)]
mod tests;
