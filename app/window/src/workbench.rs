//! What every screen shares: the runner and what it says, the protocol that stands ready, the calibration in use.

use crate::command::{ManualMove, UserCommand};
use crate::screens::form::{ProtocolForm, RunSetup};
use crate::shell::activity::{Intent, is_motion_possible, run_in_progress};
use crate::window::WindowOptions;
use crate::workers::path_dialog::{Dialog, PathPurpose, pick};
use crate::workers::ports::Ports;
use eframe::egui::Context;
use palpate_haptics::surface::SceneCurves;
use palpate_protocols::engine::Operator;
use palpate_runner::{Request, RunRequest, RunView, Runner, Snapshot, StartError};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};

/// A start that was asked for.
enum Start {
    /// Not asked for.
    None,
    /// The runner has not answered yet.
    Asked(Receiver<Result<(), StartError>>),
    /// It has started, but the snapshot with this number does not show it yet.
    Granted { seen: u64 },
}

/// What a screen has in front that others offer to take.
#[derive(Debug, Default)]
pub struct ScreenOffers {
    /// The session on the review screen.
    pub review: Option<PathBuf>,
    /// The session chosen in the library.
    pub library: Option<PathBuf>,
    /// What a scene costs on this machine, once that is measured.
    pub scene_curves: Option<Arc<SceneCurves>>,
}

/// What screens are at beside the rig.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Occupation {
    /// Whether times measured now would be disturbed.
    pub is_busy: bool,
    /// Screens whose loop runs: name, and what runs in words.
    pub running: Vec<(&'static str, &'static str)>,
}

/// The rig, the run and their data belong to the runner; this is the window's side of them.
pub struct Workbench {
    runner: Runner,
    /// The newest snapshot taken for drawing.
    pub snapshot: Arc<Snapshot>,
    /// Calibration and limits of new sessions.
    pub bench: RunSetup,
    /// The protocol that stands ready.
    pub form: ProtocolForm,
    /// The folder of recorded sessions, or why there is none.
    pub library: Result<PathBuf, String>,
    /// The serial ports of this computer.
    pub ports: Ports,
    /// The desktop's dialog.
    pub dialog: Dialog<(PathPurpose, PathBuf)>,
    /// Why what was asked for last was not done.
    pub refusal: Option<String>,
    /// What screens offer each other.
    pub front: ScreenOffers,
    /// What screens are at.
    pub occupation: Occupation,
    start: Start,
    starts: u64,
    run_wanted: Option<RunRequest>,
    is_closing: bool,
}

impl Workbench {
    /// Starts the runner on the rig of the options; `wake` is called with its news.
    pub fn start(
        options: WindowOptions,
        ctx: &Context,
        wake: impl Fn() + Send + 'static,
    ) -> Result<Self, String> {
        let curve = options
            .calibration
            .curve()
            .map_err(|err| format!("the load cell's calibration cannot be used: {err}"))?;
        let runner = Runner::start(options.rig, options.scale, None, wake)
            .map_err(|err| format!("the runner's thread cannot be started: {err}"))?;
        let mut ports = Ports::new(options.list_ports);
        ports.refresh(ctx);
        let mut form = ProtocolForm::default();
        let library = match options.sessions {
            Some(folder) => {
                form.folder = folder.display().to_string();
                Ok(folder)
            }
            None => palpate_sessions::library_folder().map_err(|err| err.to_string()),
        };
        Ok(Self {
            snapshot: runner.snapshot(),
            runner,
            bench: RunSetup {
                calibration: options.calibration,
                curve,
                limits: options.limits,
                to_acknowledge: options.to_acknowledge,
            },
            form,
            library,
            ports,
            dialog: Dialog::default(),
            refusal: None,
            front: ScreenOffers::default(),
            occupation: Occupation::default(),
            start: Start::None,
            starts: 0,
            run_wanted: None,
            is_closing: false,
        })
    }

    /// The run in progress or the last one.
    pub fn run(&self) -> Option<&RunView> {
        self.snapshot.run.as_ref()
    }

    /// How many runs were started from this window.
    pub fn starts(&self) -> u64 {
        self.starts
    }

    /// What the window is in the middle of.
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

    /// Whether what stands ready may be changed, or why not.
    pub fn free_verdict(&self) -> Result<(), String> {
        match self.is_busy() {
            true => Err("a run is in progress".to_owned()),
            false => Ok(()),
        }
    }

    /// Whether nothing moves, is about to move or runs.
    pub fn is_quiet(&self) -> bool {
        !self.is_busy() && !is_motion_possible(&self.snapshot) && self.occupation.running.is_empty()
    }

    /// Whether the protocol that stands ready may start now, or the reason why not.
    pub fn start_verdict(&self) -> Result<(), String> {
        self.move_verdict()?;
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
                Err("the stopped run waits: retract or close it first".into())
            }
            (Intent::None, Some(_)) => Err("a run is in progress".into()),
            (Intent::None, None) => Ok(()),
        }
    }

    /// Whether times may be measured now, or the reason why not.
    pub fn measure_verdict(&self) -> Result<(), String> {
        if run_in_progress(&self.snapshot).is_some() {
            return Err("a run is in progress and would disturb the times".into());
        }
        match self.occupation.is_busy {
            true => Err("other work is under way and would disturb the times".into()),
            false => Ok(()),
        }
    }

    /// Whether the loop of a screen may run now, or why not: its priority would disturb a run, or another loop.
    pub fn loop_verdict(&self, screen: &str) -> Result<(), String> {
        let mut others = self.occupation.running.iter();
        match (self.is_busy(), others.find(|(running, _)| *running != screen)) {
            (true, _) => Err("a run is in progress and would be disturbed".into()),
            (false, Some((_, words))) => Err(format!("{words} and would be disturbed")),
            (false, None) => Ok(()),
        }
    }

    /// Does what concerns the rig and the run in progress; whether that was asked for.
    pub fn act(&mut self, ctx: &Context, command: &UserCommand) -> bool {
        match command {
            UserCommand::Halt => self.operator(Operator::Halt),
            UserCommand::RunControl(wish) => {
                let choice = run_in_progress(&self.snapshot).map(|run| wish.operator(run));
                if let Some(Ok(choice)) = choice {
                    self.operator(choice);
                }
            }
            UserCommand::Retract => {
                if run_in_progress(&self.snapshot).is_some_and(|run| run.can_retract.is_ok()) {
                    self.operator(Operator::Retract);
                }
            }
            UserCommand::CloseSession => self.operator(Operator::Close),
            UserCommand::Reconnect => {
                let asked = self.runner.request(Request::Reconnect);
                self.heed(asked);
            }
            UserCommand::ListPorts => self.ports.refresh(ctx),
            UserCommand::Choose(ask) => {
                let ask = *ask;
                let opened = self.dialog.open(ctx, move |dialog| pick(ask, dialog));
                self.heed(opened);
            }
            _ => return false,
        }
        true
    }

    /// What cannot be done is told.
    fn heed(&mut self, done: Result<(), String>) {
        if let Err(reason) = done {
            self.refusal = Some(reason);
        }
    }

    /// Passes on the operator's choice.
    pub fn operator(&mut self, choice: Operator) {
        let passed = self.runner.operator(choice);
        self.heed(passed);
    }

    /// Something is written down in the run in progress; without one there is nowhere to write it, and false is returned.
    pub fn write_note(&mut self, text: String) -> bool {
        if run_in_progress(&self.snapshot).is_none() {
            return false;
        }
        let written = self.runner.request(Request::Note(text));
        let is_written = written.is_ok();
        self.heed(written);
        is_written
    }

    /// The protocol that stands ready as a run, if it may start.
    pub fn ready_run(&self) -> Option<RunRequest> {
        self.start_verdict().ok()?;
        self.form.request(&self.bench)
    }

    /// A run beside the protocol that stands ready; what keeps it from being is told.
    pub fn manual_run(&mut self, aside: &ManualMove) -> Option<RunRequest> {
        self.move_verdict().ok()?;
        match self.form.aside(aside, &self.snapshot.rig, &self.bench) {
            Ok(request) => Some(request),
            Err(reason) => {
                self.refusal = Some(reason);
                None
            }
        }
    }

    /// Wants a run, which begins once every loop of the window has stopped.
    pub fn want_run(&mut self, request: RunRequest) {
        self.run_wanted = Some(request);
    }

    /// Whether a run is wanted.
    pub fn is_run_wanted(&self) -> bool {
        self.run_wanted.is_some()
    }

    /// Asks the runner to begin the run that is wanted; the answer is polled, never awaited.
    pub fn begin_wanted_run(&mut self) {
        let Some(request) = self.run_wanted.take() else {
            return;
        };
        let (reply, answer) = sync_channel(1);
        self.refusal = None;
        match self.runner.request(Request::Run(Box::new(request), reply)) {
            Ok(()) => self.start = Start::Asked(answer),
            Err(reason) => self.refusal = Some(reason),
        }
    }

    /// Takes what the runner says.
    pub fn poll(&mut self) {
        self.snapshot = self.runner.snapshot();
        self.ports.poll();
        match &self.start {
            Start::None => {}
            Start::Asked(answer) => match answer.try_recv() {
                Ok(Ok(())) => {
                    self.starts += 1;
                    self.start = Start::Granted { seen: self.snapshot.sequence };
                }
                Ok(Err(reason)) => {
                    self.refusal = Some(reason.to_string());
                    self.start = Start::None;
                }
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => {
                    self.refusal = Some("the runner ended; close palpate and check the rig".into());
                    self.start = Start::None;
                }
            },
            Start::Granted { seen } => {
                if self.snapshot.sequence > *seen {
                    self.start = Start::None;
                }
            }
        }
    }

    /// Checks what stands in the form.
    pub fn refresh_form(&mut self) {
        let rig = &self.snapshot.rig;
        self.form.refresh(&rig.description, &self.bench, rig.is_homed);
    }

    /// The window is to close, which stops first: whether it may close now, with the axis at rest.
    pub fn begin_to_close(&mut self) -> bool {
        // Nothing may start in a window that is about to close.
        self.is_closing = true;
        let is_safe = self.is_at_rest();
        if !is_safe {
            self.operator(Operator::Stop);
        }
        is_safe
    }

    /// Whether a window that waited for the axis to rest may close now.
    pub fn may_close(&self) -> bool {
        self.is_closing && (self.is_at_rest() || !self.runner.is_alive())
    }

    fn is_at_rest(&self) -> bool {
        let snapshot = self.runner.snapshot();
        !is_motion_possible(&snapshot) && matches!(self.start, Start::None)
    }
}
