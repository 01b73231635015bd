//! State that all screens share: the runner and its snapshot, the protocol in the form, the calibration in use.

mod closing;
mod station;

use crate::command::{ManualMove, UiCommand};
use crate::latest_run::LatestRun;
use crate::scene::graphics::PictureGraphics;
use crate::screens::form::{CheckedPlan, ProtocolForm, RunSetup};
use crate::shell::activity::{Intent, is_motion_possible, run_in_progress};
use crate::widgets::require;
use crate::window::WindowOptions;
use crate::workers::queue_desk::QueueDesk;
use crate::workers::station::{StationCommand, StationDesk};
use crate::workers::{BackgroundTask, Dialog, PathPurpose};
use eframe::egui::{Context, Ui};
use palpate_analysis::window_requests::{RigOpener, RunWatcher, WorkbenchRequest};
use palpate_drivers::serial::{PortInfo, SerialError};
use palpate_haptics::surface::SceneCurves;
use palpate_model::calibration::Calibration;
use palpate_protocols::engine::Operator;
use palpate_runner::{
    RunRequest, RunView, Runner, RunnerHandle, RunnerRequest, RunnerSnapshot, StartError,
};
use palpate_sessions::folder::HolderLock;
use rfd::FileDialog;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::sync::{Arc, OnceLock};

/// How far the start of a run is.
enum Start {
    None,
    /// The runner has not answered yet.
    Sent(Receiver<Result<(), StartError>>),
    /// It has begun, but the snapshot with this number does not show it yet.
    Granted {
        seen: u64,
    },
}

/// What one screen offers to the others.
#[derive(Debug, Default)]
pub struct ScreenOffers {
    /// The session in front on the review screen.
    pub review: Option<PathBuf>,
    /// The session chosen in the library.
    pub library: Option<PathBuf>,
    /// Once they are measured on this machine.
    pub scene_curves: Option<Arc<SceneCurves>>,
}

/// Work of the screens that a run or a measurement of times would disturb.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Occupation {
    pub is_busy: bool,
    /// Screens whose loop runs, each with a sentence that says so.
    pub running: Vec<(&'static str, &'static str)>,
}

/// The window's side of the rig and the run, which belong to the runner.
pub struct Workbench {
    /// Dropped before the runner: nothing is started over the network in a window that closes.
    pub station: StationDesk,
    runner: Runner,
    pub snapshot: Arc<RunnerSnapshot>,
    /// The last one whose run is not a move by hand.
    measured: Arc<RunnerSnapshot>,
    /// Calibration and limits of new sessions.
    pub bench: RunSetup,
    /// The calibration that comes with the rig, where the window was opened with another one.
    pub built_in: Option<Calibration>,
    pub form: ProtocolForm,
    /// The folder of recorded sessions, or why there is none.
    pub library: Result<PathBuf, String>,
    pub ports: BackgroundTask<Vec<PortInfo>>,
    pub list_ports: ListPorts,
    pub is_simulated: bool,
    pub open_rig: Option<RigOpener>,
    /// Another rig, which the app takes in place of this one.
    pub next_rig: Option<WorkbenchRequest>,
    /// Dropped after the runner, which has the rig.
    _locks: Vec<HolderLock>,
    /// Dropped after the runner, whose thread must not be the one that waits for a network.
    watcher: Option<Arc<dyn RunWatcher>>,
    /// Problems of the watcher that were shown.
    watcher_problems: usize,
    pub dialog: Dialog<(PathPurpose, PathBuf)>,
    /// The screen that opened the last dialog, and why the dialog was not shown.
    dialog_of: Option<(&'static str, Option<String>)>,
    /// What a person must know since the window opened.
    pub notice: Option<String>,
    /// Why the last command was refused.
    pub refusal: Option<String>,
    pub front: ScreenOffers,
    pub occupation: Occupation,
    /// The queue of specimens.
    pub queue: QueueDesk,
    pub latest_run: LatestRun,
    /// For the picture of a scene.
    pub graphics: PictureGraphics,
    start: Start,
    /// The run that begins once every loop of the window has stopped.
    next_run: Option<RunRequest>,
    /// Specimen and protocol of the form, where it comes from the form.
    form_start: Option<[String; 2]>,
    is_closing: bool,
}

/// Lists serial ports; tests have ports of their own.
pub type ListPorts = fn() -> Result<Vec<PortInfo>, SerialError>;

impl Workbench {
    /// Starts the runner on the rig of the options; `wake` is called when its snapshot changes.
    pub fn start(
        options: WindowOptions,
        ctx: &Context,
        wake: impl Fn() + Send + 'static,
    ) -> Result<Self, String> {
        let WindowOptions { request, sessions, list_ports, .. } = options;
        let curve = request
            .calibration
            .curve()
            .map_err(|err| format!("the load cell's calibration cannot be used: {err}"))?;
        let is_simulated = request.rig.is_virtual();
        let (seen, watcher) = (Arc::new(OnceLock::new()), request.watcher.clone());
        let newest: Arc<OnceLock<RunnerHandle>> = Arc::clone(&seen);
        let runner = Runner::start(request.rig, request.scale, None, move || {
            // On the runner's thread: a hidden window draws no frames, and its runs end all the same.
            if let (Some(watcher), Some(newest)) = (&watcher, newest.get()) {
                watcher.see(&newest.snapshot());
            }
            wake();
        })
        .map_err(|err| format!("the thread that runs protocols cannot be started: {err}"))?;
        let _ = seen.set(runner.handle());
        let mut form = ProtocolForm::default();
        let library = match sessions {
            Some(folder) => {
                form.folder = folder.display().to_string();
                Ok(folder)
            }
            None => palpate_sessions::library_folder().map_err(|err| err.to_string()),
        };
        let station = StationDesk::new(request.station.clone(), library.as_ref().ok());
        let mut workbench = Self {
            station,
            latest_run: LatestRun::new(&request.calibration),
            graphics: PictureGraphics::default(),
            snapshot: runner.snapshot(),
            measured: runner.snapshot(),
            runner,
            bench: RunSetup {
                calibration: request.calibration,
                curve,
                doubts: request.doubts,
                limits: request.limits,
                to_acknowledge: request.to_acknowledge,
            },
            built_in: request.built_in,
            form,
            queue: QueueDesk::new(library.clone()),
            library,
            ports: BackgroundTask::default(),
            list_ports,
            is_simulated,
            open_rig: request.open_rig,
            next_rig: None,
            _locks: request.locks,
            watcher: request.watcher,
            watcher_problems: 0,
            dialog: Dialog::default(),
            dialog_of: None,
            notice: None,
            refusal: None,
            front: ScreenOffers::default(),
            occupation: Occupation::default(),
            start: Start::None,
            next_run: None,
            form_start: None,
            is_closing: false,
        };
        workbench.refresh_ports(ctx);
        if request.station.is_some() {
            workbench.act_on_station(ctx, &StationCommand::Serve);
        }
        Ok(workbench)
    }

    /// Lists the serial ports in the background: some drivers take seconds.
    fn refresh_ports(&mut self, ctx: &Context) {
        let list = self.list_ports;
        self.ports.start("serial-ports", ctx, move |_| list().map_err(|err| err.to_string()));
    }

    /// The run in progress or the last one.
    pub fn run(&self) -> Option<&RunView> {
        self.snapshot.run.as_ref()
    }

    /// The same without moves by hand, which leave the run before them on the screen.
    pub fn measured_run(&self) -> Option<&RunView> {
        self.measured.run.as_ref()
    }

    pub fn intent(&self) -> Intent {
        match (self.is_closing, &self.start) {
            (true, _) => Intent::Closing,
            (false, Start::None) => Intent::None,
            (false, _) => Intent::Starting,
        }
    }

    /// Whether a run is in progress or about to start.
    pub fn is_busy(&self) -> bool {
        run_in_progress(&self.snapshot).is_some() || self.intent() != Intent::None
    }

    /// Whether the protocol may be changed, or why not.
    pub fn free_verdict(&self) -> Result<(), String> {
        require(!self.is_busy(), "a run is in progress")
    }

    pub fn is_quiet(&self) -> bool {
        !self.is_busy() && !is_motion_possible(&self.snapshot) && self.occupation.running.is_empty()
    }

    /// Whether the protocol may start now, or why not.
    pub fn start_verdict(&self) -> Result<(), String> {
        self.move_verdict()?;
        require(!self.latest_run.is_judging(), "the daily check is being judged")?;
        self.form.verdict()
    }

    /// Whether the axis may be moved by hand now, or why not.
    pub fn move_verdict(&self) -> Result<(), String> {
        if let Some(reason) = &self.snapshot.rig.link_error {
            return Err(format!("the link to the rig is lost ({reason})"));
        }
        match (self.intent(), run_in_progress(&self.snapshot)) {
            (Intent::Closing, _) => Err("the window is closing".into()),
            (Intent::Starting, _) => Err("starting".into()),
            (Intent::None, Some(run)) if run.holding.is_some() => {
                Err("the stopped run is still open; retract the probe or close the session first"
                    .into())
            }
            (Intent::None, Some(_)) => Err("a run is in progress".into()),
            (Intent::None, None) => Ok(()),
        }
    }

    /// Whether times may be measured now, or why not.
    pub fn measure_verdict(&self) -> Result<(), String> {
        let has_run = run_in_progress(&self.snapshot).is_some();
        require(!has_run, "a run is in progress and would disturb the timing measurement")?;
        let is_busy = self.occupation.is_busy;
        require(!is_busy, "other work is in progress and would disturb the timing measurement")
    }

    /// Whether the loop of a screen may run now, or why not: its priority would disturb a run, or another loop.
    pub fn loop_verdict(&self, screen: &str) -> Result<(), String> {
        let mut others = self.occupation.running.iter();
        match (self.is_busy(), others.find(|(running, _)| *running != screen)) {
            (true, _) => Err("a run is in progress, and this would disturb its timing".into()),
            (false, Some((_, words))) => Err(format!("{words}, and this would disturb its timing")),
            (false, None) => Ok(()),
        }
    }

    /// Does a command that concerns the rig or the run in progress; false for other commands.
    pub fn act(&mut self, ctx: &Context, command: &UiCommand) -> bool {
        match command {
            UiCommand::Halt => self.operator(Operator::Halt),
            UiCommand::RunControl(control) => {
                let choice = run_in_progress(&self.snapshot).map(|run| control.operator(run));
                if let Some(Ok(choice)) = choice {
                    self.operator(choice);
                }
            }
            UiCommand::Retract => {
                if run_in_progress(&self.snapshot).is_some_and(|run| run.can_retract.is_ok()) {
                    self.operator(Operator::Retract);
                }
            }
            UiCommand::CloseSession => self.operator(Operator::Close),
            UiCommand::Reconnect => {
                let sent = self.runner.request(RunnerRequest::Reconnect);
                self.keep_refusal(sent);
            }
            UiCommand::Station(command) => self.act_on_station(ctx, command),
            UiCommand::ListPorts => self.refresh_ports(ctx),
            UiCommand::Queue(work, reason) => {
                let by = self.form.label_text("operator").to_owned();
                self.queue.ask(work.clone(), &by, reason);
            }
            _ => return false,
        }
        true
    }

    /// Opens the dialog of a screen for a folder or a file.
    pub fn open_dialog(
        &mut self,
        ctx: &Context,
        screen: &'static str,
        pick: impl FnOnce(FileDialog) -> Option<(PathPurpose, PathBuf)> + Send + 'static,
    ) {
        self.dialog_of = Some((screen, self.dialog.open(ctx, pick).err()));
    }

    /// The path that a dialog gave, once.
    pub fn poll_dialog(&mut self) -> Option<(PathPurpose, PathBuf)> {
        let chosen = self.dialog.poll();
        if let (Some(reason), Some((_, refusal))) =
            (self.dialog.take_refusal(), &mut self.dialog_of)
        {
            *refusal = Some(reason);
        }
        chosen
    }

    /// Why the dialog that a screen opened last was not shown.
    pub fn dialog_refusal(&self, screen: &str) -> Option<&str> {
        let (_, refusal) = self.dialog_of.as_ref().filter(|(of, _)| *of == screen)?;
        refusal.as_deref()
    }

    fn keep_refusal(&mut self, done: Result<(), String>) {
        if let Err(reason) = done {
            self.refusal = Some(reason);
        }
    }

    pub fn operator(&mut self, choice: Operator) {
        let passed = self.runner.send_choice(choice);
        self.keep_refusal(passed);
        if matches!(choice, Operator::Stop | Operator::Halt | Operator::Abort)
            && self.station.disarm_for_stop("a person at the rig stopped it")
        {
            let passed = self.runner.send_choice(choice);
            self.keep_refusal(passed);
        }
    }

    /// Writes a note into the run in progress; false without one.
    pub fn write_note(&mut self, text: String) -> bool {
        if run_in_progress(&self.snapshot).is_none() {
            return false;
        }
        let written = self.runner.request(RunnerRequest::Note(text));
        let is_written = written.is_ok();
        self.keep_refusal(written);
        is_written
    }

    /// The protocol of the form as a run, if it may start.
    pub fn ready_run(&self) -> Option<RunRequest> {
        self.start_verdict().ok()?;
        self.form.request(&self.bench)
    }

    /// A manual move as a run; what prevents it becomes the refusal.
    pub fn manual_run(&mut self, manual: &ManualMove) -> Option<RunRequest> {
        self.move_verdict().ok()?;
        let request = self.form.manual_request(manual, &self.snapshot.rig, &self.bench);
        request.map_err(|reason| self.refusal = Some(reason)).ok()
    }

    /// Has a run begin once every loop of the window has stopped. `form_start`: specimen and protocol of the form,
    /// where it comes from the form.
    pub fn set_next_run(&mut self, request: RunRequest, form_start: Option<[String; 2]>) {
        self.next_run = Some(request);
        self.form_start = form_start;
    }

    pub fn has_next_run(&self) -> bool {
        self.next_run.is_some()
    }

    /// Sends the next run to the runner; the answer is polled, never awaited.
    pub fn begin_next_run(&mut self) {
        let Some(request) = self.next_run.take() else { return };
        let (reply, answer) = sync_channel(1);
        self.refusal = None;
        match self.runner.request(RunnerRequest::Run(Box::new(request), reply)) {
            Ok(()) => self.start = Start::Sent(answer),
            Err(reason) => {
                self.queue.cancel_start();
                self.refusal = Some(reason);
            }
        }
    }

    /// Takes the runner's snapshot and its answer to a start.
    pub fn poll(&mut self, ctx: &Context) {
        self.snapshot = self.runner.snapshot();
        if !self.run().is_some_and(|run| ManualMove::is_plan(&run.plan_name)) {
            self.measured = Arc::clone(&self.snapshot);
        }
        self.ports.poll();
        self.poll_watcher();
        self.poll_start();
        self.queue.poll(ctx);
        let busy = self.station_verdict().err();
        self.station.poll(busy);
    }

    /// Shows what the watcher of the runs could not do.
    fn poll_watcher(&mut self) {
        let problems = self.watcher.as_ref().map(|watcher| watcher.problems()).unwrap_or_default();
        if problems.len() != std::mem::replace(&mut self.watcher_problems, problems.len()) {
            self.notice = problems.into_iter().next_back();
        }
    }

    /// Follows the run that is shown; true when a run that has a result has just ended.
    pub fn follow_run(&mut self, ctx: &Context) -> bool {
        let run = self.measured.run.as_ref();
        let depth_mm = self.form.checked().map_or(0.0, CheckedPlan::deepest_mm);
        let library = self.library.as_ref().ok();
        self.latest_run.update(ctx, run, &self.bench, depth_mm, library);
        if let Some(gate) = self.latest_run.take_gate() {
            self.bench.take_gate(gate);
            self.station.disarm("a daily check was made at the rig");
            self.form.forget();
        }
        self.latest_run.take_ended(self.measured.run.as_ref())
    }

    /// Whether the run that waits for its verdict in the queue is the one that was checked last.
    pub fn is_open_run_shown(&self) -> bool {
        let checked = self.library.as_ref().ok().zip(self.latest_run.assessed(self.measured_run()));
        let queue = self.queue.queue();
        checked.is_some_and(|(library, session)| queue.open_run_of(library, session).is_some())
    }

    /// Whether the run shown may be repeated now, or why not: the form has what it would start.
    pub fn repeat_verdict(&self) -> Result<(), String> {
        self.free_verdict()?;
        let is_same = self.latest_run.last_start() == Some(&self.form.next_start());
        require(
            is_same,
            "the form of Run asks for another specimen or protocol now; start it there",
        )
    }

    /// Draws the plots of the run.
    pub fn plots_ui(&mut self, ui: &mut Ui) {
        self.latest_run.plots_ui(ui, self.measured.run.as_ref());
    }

    fn poll_start(&mut self) {
        match &self.start {
            Start::None => {}
            Start::Sent(answer) => match answer.try_recv() {
                Ok(Ok(())) => {
                    if let Some(start) = self.form_start.take() {
                        self.latest_run.set_last_start(start);
                    }
                    self.start = Start::Granted { seen: self.snapshot.sequence };
                }
                Ok(Err(reason)) => {
                    self.refusal = Some(reason.to_string());
                    self.queue.cancel_start();
                    self.start = Start::None;
                }
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => {
                    self.queue.cancel_start();
                    self.refusal = Some(
                        "the thread that runs protocols ended unexpectedly; close palpate and check the rig"
                            .into(),
                    );
                    self.start = Start::None;
                }
            },
            Start::Granted { seen } => {
                if self.snapshot.sequence > *seen {
                    self.start = Start::None;
                    if let Some(run) = &self.snapshot.run {
                        let by = self.form.label_text("operator");
                        self.queue.begun(&run.folder, by);
                    }
                }
            }
        }
    }

    pub fn refresh_form(&mut self) {
        let rig = &self.snapshot.rig;
        self.form.refresh(&rig.description, &self.bench, rig.is_homed);
    }
}
