//! The workbench's window as an eframe app: `logic` reads keys and answers, `ui` draws a snapshot.

use crate::command::{Aside, Command, Commands, TextSize};
use crate::plots::PlotCache;
use crate::plots::force_time::TimeView;
use crate::screens::approach::Approach;
use crate::screens::calibration::{CalibrationScreen, Facts};
use crate::screens::extremes::ExtremesScreen;
use crate::screens::form::{Bench, ProtocolForm};
use crate::screens::haptics::HapticsScreen;
use crate::screens::library::LibraryScreen;
use crate::screens::models::ModelsScreen;
use crate::screens::review::ReviewScreen;
use crate::screens::rig::RigScreen;
use crate::screens::run_middle::{Chooser, Middle, first_view};
use crate::screens::scene::SceneScreen;
use crate::screens::trade::TradeScreen;
use crate::settings::{Kept, ZOOM};
use crate::shell::activity::{Intent, activity, is_motion_possible, run_in_progress};
use crate::shell::event_log::EventLog;
use crate::shell::frame_meter::FrameMeter;
use crate::shell::keys::Keys;
use crate::shell::pace::FramePace;
use crate::shell::palette::{Action, Palette};
use crate::shell::rail::Screen;
use crate::shell::sizes::{STEP, Sizes};
use crate::shell::tour::Tour;
use crate::theme;
use crate::widgets::places::places;
use crate::window::WindowOptions;
use crate::workers::fit::{Refit, Refitter};
use crate::workers::path_dialog::{Ask, PathDialog};
use crate::workers::ports::Ports;
use crate::workers::recovery::Recovery;
use eframe::egui::{Context, RawInput, Theme, Ui, ViewportCommand};
use palpate_analysis::haptics_tape::is_tape;
use palpate_analysis::select::Selected;
use palpate_haptics::surface::SceneCurves;
use palpate_protocols::engine::Operator;
use palpate_rheology::extremes::Row;
use palpate_rheology::trade::TradeCurves;
use palpate_runner::{Request, RunRequest, Runner, Snapshot, StartError};
use palpate_sessions::ticks::TICKS;
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

/// The window's own state. The rig, the run and its data belong to the runner.
pub struct WorkbenchApp {
    pub(crate) runner: Runner,
    pub(crate) snapshot: Arc<Snapshot>,
    pub(crate) bench: Bench,
    pub(crate) form: ProtocolForm,
    pub(crate) library: Result<String, String>,
    pub(crate) ports: Ports,
    pub(crate) recovery: Recovery,
    pub(crate) dialog: PathDialog,
    pub(crate) plots: PlotCache,
    pub(crate) refitter: Refitter,
    pub(crate) middle: Middle,
    pub(crate) chooser: Chooser,
    pub(crate) time_view: TimeView,
    pub(crate) screen: Screen,
    pub(crate) rig_screen: RigScreen,
    pub(crate) catalog: LibraryScreen,
    pub(crate) review: ReviewScreen,
    pub(crate) models: ModelsScreen,
    pub(crate) extremes: ExtremesScreen,
    pub(crate) haptics: HapticsScreen,
    pub(crate) scene: SceneScreen,
    pub(crate) trade: TradeScreen,
    pub(crate) calibration: CalibrationScreen,
    pub(crate) events: EventLog,
    pub(crate) refusal: Option<String>,
    pub(crate) note: String,
    pub(crate) approach: Approach,
    pub(crate) palette: Palette,
    pub(crate) tour: Tour,
    pub(crate) settings: Kept,
    pub(crate) sizes: Sizes,
    is_zoom_set: bool,
    start: Start,
    is_closing: bool,
    are_fonts_warm: bool,
    keys: Keys,
    meter: FrameMeter,
    pace: FramePace,
}

impl WorkbenchApp {
    /// Starts the runner on the rig of the options. Opens no window; what is read from disk is read on threads.
    pub fn new(options: WindowOptions, ctx: &Context) -> Result<Self, String> {
        theme::apply(ctx);
        let (settings, told) = Kept::open(options.settings);
        if settings.now.is_dark {
            theme::switch(ctx);
        }
        let mut tour = Tour::default();
        if settings.is_kept() && !settings.now.is_tour_over {
            tour.start();
        }
        let curve = options
            .calibration
            .curve()
            .map_err(|err| format!("the load cell's calibration cannot be used: {err}"))?;
        let plots = PlotCache::for_calibration(&options.calibration);
        let pace = FramePace::default();
        let runner = Runner::start(options.rig, options.scale, None, pace.waker(ctx))
            .map_err(|err| format!("the runner's thread cannot be started: {err}"))?;
        let mut ports = Ports::new(options.list_ports);
        ports.refresh(ctx);
        let curves_in = match &options.sessions {
            Some(folder) => Ok(folder.clone()),
            None => palpate_sessions::library_folder().map_err(|err| err.to_string()),
        };
        let mut recovery = Recovery::default();
        if let Ok(library) = &curves_in {
            recovery.start(library.clone(), ctx);
        }
        let mut form = ProtocolForm::default();
        form.folder.clone_from(&settings.now.sessions);
        form.set_told("operator", &settings.now.operator);
        if let Some(folder) = options.sessions {
            form.folder = folder.display().to_string();
        }
        let rig = runner.snapshot().rig.description.name.clone();
        let own = options.calibration.clone();
        let calibration = CalibrationScreen::new(curves_in.clone(), own, &rig);
        Ok(Self {
            snapshot: runner.snapshot(),
            runner,
            bench: Bench {
                calibration: options.calibration,
                curve,
                limits: options.limits,
                to_acknowledge: options.to_acknowledge,
            },
            form,
            library: palpate_sessions::folder::library_folder()
                .map(|path| path.display().to_string())
                .map_err(|err| err.to_string()),
            ports,
            recovery,
            dialog: PathDialog::default(),
            plots,
            refitter: Refitter::default(),
            middle: Middle::default(),
            chooser: Chooser::default(),
            time_view: TimeView::default(),
            sizes: Sizes::remembered([settings.now.left, settings.now.right, settings.now.log]),
            screen: Screen::by_name(&settings.now.screen).unwrap_or_default(),
            rig_screen: RigScreen::default(),
            catalog: LibraryScreen::new(curves_in.clone()),
            review: ReviewScreen::new(curves_in.clone()),
            models: ModelsScreen::default(),
            extremes: ExtremesScreen::default(),
            haptics: HapticsScreen::default(),
            scene: SceneScreen::default(),
            calibration,
            trade: TradeScreen::new(curves_in),
            events: EventLog::default(),
            refusal: told,
            note: String::new(),
            approach: Approach::default(),
            palette: Palette::default(),
            tour,
            settings,
            is_zoom_set: false,
            start: Start::None,
            is_closing: false,
            are_fonts_warm: false,
            keys: Keys::default(),
            meter: FrameMeter::from_environment(),
            pace,
        })
    }

    /// The newest snapshot taken for drawing.
    #[must_use]
    pub fn snapshot(&self) -> &Arc<Snapshot> {
        &self.snapshot
    }

    /// Where the exact fit of the run on the screen stands.
    #[must_use]
    pub fn refit(&self) -> Refit<'_> {
        self.refitter.of(self.snapshot.run.as_ref())
    }

    /// The last comparison of models.
    #[must_use]
    pub fn comparison(&self) -> Option<&Result<Selected, String>> {
        self.models.answer()
    }

    /// The curves of error against time.
    #[must_use]
    pub fn trade_curves(&self) -> Option<&TradeCurves> {
        self.trade.curves()
    }

    /// The curves of a scene.
    #[must_use]
    pub fn scene_curves(&self) -> Option<&SceneCurves> {
        self.trade.scene_curves()
    }

    /// What the last test of the extremes found.
    #[must_use]
    pub fn extremes_rows(&self) -> Option<&[Row]> {
        self.extremes.rows()
    }

    /// The haptics screen.
    #[must_use]
    pub fn haptics(&self) -> &HapticsScreen {
        &self.haptics
    }

    /// The scene screen.
    #[must_use]
    pub fn scene(&self) -> &SceneScreen {
        &self.scene
    }

    /// What the window is in the middle of.
    #[must_use]
    pub fn intent(&self) -> Intent {
        match (self.is_closing, &self.start) {
            (true, _) => Intent::Closing,
            (false, Start::None) => Intent::None,
            (false, _) => Intent::Starting,
        }
    }

    /// Whether the form may start a run now, or the reason why not.
    pub(crate) fn start_verdict(&self) -> Result<(), String> {
        if let Some(reason) = &self.snapshot.rig.link_error {
            return Err(format!("the link to the rig is lost ({reason})"));
        }
        if self.is_closing {
            return Err("the window is closing".into());
        }
        if !matches!(self.start, Start::None) {
            return Err("starting".into());
        }
        match run_in_progress(&self.snapshot) {
            Some(run) if run.holding.is_some() => {
                Err("the stopped run waits: retract or close it first".into())
            }
            Some(_) => Err("a run is in progress".into()),
            None => self.form.verdict(),
        }
    }

    /// Whether times may be measured now, or the reason why not.
    pub(crate) fn measure_verdict(&self) -> Result<(), String> {
        if run_in_progress(&self.snapshot).is_some() {
            return Err("a run is in progress and would disturb the times".into());
        }
        let others = [
            self.models.is_busy(),
            self.extremes.is_busy(),
            self.haptics.is_busy(),
            self.scene.is_busy(),
            self.trade.is_busy(),
        ];
        if others.contains(&true) {
            return Err("other work is under way and would disturb the times".into());
        }
        Ok(())
    }

    /// Whether the haptic loop may run now, or why not: its priority would disturb a run.
    pub(crate) fn loop_verdict(&self) -> Result<(), String> {
        match (self.is_busy(), self.scene.is_running()) {
            (true, _) => Err("a run is in progress and would be disturbed".into()),
            (_, true) => Err("the scene runs and would be disturbed".into()),
            _ => Ok(()),
        }
    }

    /// Whether the scene may run now, or why not.
    pub(crate) fn scene_verdict(&self) -> Result<(), String> {
        match (self.is_busy(), self.haptics.is_running()) {
            (true, _) => Err("a run is in progress and would be disturbed".into()),
            (_, true) => Err("the haptic loop runs and would be disturbed".into()),
            _ => self.scene.verdict(),
        }
    }

    /// Does what was asked for.
    fn act(&mut self, ctx: &Context, commands: &mut Commands) {
        for command in commands.take() {
            match command {
                Command::Start => self.start(),
                Command::Stop => {
                    // The rig first: what else stops may take its time.
                    self.operator(Operator::Stop);
                    self.haptics.stop_loop();
                    self.scene.stop();
                    self.palette.close();
                }
                Command::Halt => self.operator(Operator::Halt),
                Command::Wish(wish) => {
                    let choice = run_in_progress(&self.snapshot).map(|run| wish.operator(run));
                    if let Some(Ok(choice)) = choice {
                        self.operator(choice);
                    }
                }
                Command::Retract => {
                    if run_in_progress(&self.snapshot).is_some_and(|run| run.can_retract.is_ok()) {
                        self.operator(Operator::Retract);
                    }
                }
                Command::CloseSession => self.operator(Operator::Close),
                Command::Reconnect => {
                    if let Err(err) = self.runner.request(Request::Reconnect) {
                        self.refusal = Some(err);
                    }
                }
                Command::ListPorts => self.ports.refresh(ctx),
                Command::Choose(ask) => {
                    if let Err(err) = self.dialog.open(ask, ctx) {
                        self.refusal = Some(format!("the dialog cannot be opened: {err}"));
                    }
                }
                Command::MeasureCalibration => {
                    self.screen = Screen::Run;
                    self.take_protocol("load-cell-calibration");
                }
                Command::KeepCalibration => {
                    self.screen = Screen::Calibration;
                    self.calibration.keep(self.snapshot.run.as_ref(), ctx);
                }
                Command::View(view) => {
                    self.screen = Screen::Run;
                    self.middle = view;
                }
                Command::TakeProtocol(name) => {
                    self.screen = Screen::Run;
                    self.take_protocol(name);
                }
                Command::OpenProtocol => self.read_protocol(|chooser| chooser.read_typed(ctx)),
                Command::Work => match self.screen {
                    Screen::Rig | Screen::Run | Screen::Library => {}
                    Screen::Review => self.review.fit(ctx),
                    Screen::Models => self.models.start(ctx),
                    Screen::Trade => {
                        if self.measure_verdict().is_ok() {
                            self.trade.start(ctx);
                        }
                    }
                    Screen::Extremes => self.extremes.start(ctx),
                    Screen::Haptics => self.haptics.start_check(ctx),
                    Screen::Scene => self.scene.compute(ctx),
                    Screen::Calibration => self.use_calibration(),
                },
                Command::CancelWork => match self.screen {
                    Screen::Rig | Screen::Run | Screen::Calibration | Screen::Library => {}
                    Screen::Review => self.review.cancel_fit(),
                    Screen::Models => self.models.cancel(),
                    Screen::Trade => self.trade.cancel(),
                    Screen::Extremes => self.extremes.cancel(),
                    Screen::Haptics => self.haptics.cancel(),
                    Screen::Scene => self.scene.cancel(),
                },
                Command::LoopStart => {
                    if self.loop_verdict().is_ok() {
                        self.screen = Screen::Haptics;
                        self.haptics.start_loop(ctx);
                    }
                }
                Command::LoopStop => self.haptics.stop_loop(),
                Command::SceneStart => {
                    if self.scene_verdict().is_ok() {
                        self.screen = Screen::Scene;
                        self.scene.start(ctx);
                    }
                }
                Command::SceneStop => self.scene.stop(),
                Command::OpenScene => self.scene.read(ctx),
                Command::MeasureScene => {
                    self.screen = Screen::Trade;
                    self.trade.show_scene();
                }
                Command::Review(sessions) => {
                    self.screen = Screen::Review;
                    self.review.open(sessions, ctx);
                }
                Command::Show(screen) => self.screen = screen,
                Command::SwitchTheme => theme::switch(ctx),
                Command::Resize { edge, is_larger } => {
                    self.sizes.grow(edge, if is_larger { STEP } else { -STEP });
                }
                Command::TextSize(size) => {
                    let zoom = ctx.zoom_factor();
                    let zoom = match size {
                        TextSize::Larger => zoom * 1.1,
                        TextSize::Smaller => zoom / 1.1,
                        TextSize::Usual => 1.0,
                    };
                    ctx.set_zoom_factor(zoom.clamp(*ZOOM.start(), *ZOOM.end()));
                }
                Command::Focus(id) => ctx.memory_mut(|memory| memory.request_focus(id)),
                Command::Palette => self.palette.toggle(),
                Command::TourStart => {
                    self.tour.start();
                    self.screen = Screen::Run;
                }
                Command::TourNext => match self.tour.go_on() {
                    Some(screen) => self.screen = screen,
                    None => self.settings.now.is_tour_over = true,
                },
                Command::TourEnd => {
                    self.tour.end();
                    self.settings.now.is_tour_over = true;
                }
                Command::NoteTyped => {
                    let text = match self.note.trim() {
                        "" => "mark".to_owned(),
                        text => text.to_owned(),
                    };
                    if self.write_note(text) {
                        self.note.clear();
                    }
                }
                Command::Aside(aside) => self.run_aside(&aside),
            }
            ctx.request_repaint();
        }
    }

    /// Takes a built-in protocol into the form, unless what stands there runs.
    fn take_protocol(&mut self, name: &str) {
        if !self.is_busy() {
            self.form.choose_built_in(name);
            self.middle = Middle::Course;
        }
    }

    /// What the calibration screen must know of the rest.
    pub(crate) fn calibration_facts(&self) -> Facts<'_> {
        Facts {
            in_use: &self.bench.calibration,
            is_busy: self.is_busy(),
            run: self.snapshot.run.as_ref(),
        }
    }

    /// Whether a run is in progress or about to start.
    pub(crate) fn is_busy(&self) -> bool {
        run_in_progress(&self.snapshot).is_some() || self.intent() != Intent::None
    }

    /// New sessions are read with the calibration chosen on its screen.
    fn use_calibration(&mut self) {
        let Ok(calibration) = self.calibration.usable(&self.calibration_facts()) else {
            return;
        };
        // What makes no curve is not usable.
        if let Ok(curve) = calibration.curve() {
            self.bench.calibration = calibration.clone();
            self.bench.curve = curve;
            self.form.forget();
        }
    }

    /// Something is written down in the run in progress; without one there is nowhere to write it, and false is returned.
    fn write_note(&mut self, text: String) -> bool {
        if run_in_progress(&self.snapshot).is_none() {
            return false;
        }
        match self.runner.request(Request::Note(text)) {
            Ok(()) => true,
            Err(err) => {
                self.refusal = Some(err);
                false
            }
        }
    }

    /// Whether the axis may be moved by hand now, or why not.
    pub(crate) fn aside_verdict(&self) -> Result<(), String> {
        if let Some(reason) = &self.snapshot.rig.link_error {
            return Err(format!("the link to the rig is lost ({reason})"));
        }
        match (run_in_progress(&self.snapshot), self.intent()) {
            (Some(run), _) if run.holding.is_some() => {
                Err("the stopped run waits: retract or close it first".into())
            }
            (Some(_), _) => Err("a run is in progress".into()),
            (None, Intent::Closing) => Err("the window is closing".into()),
            (None, Intent::Starting) => Err("starting".into()),
            (None, Intent::None) => Ok(()),
        }
    }

    fn run_aside(&mut self, aside: &Aside) {
        if self.aside_verdict().is_err() {
            return;
        }
        match self.form.aside(aside, &self.snapshot.rig, &self.bench) {
            Ok(request) => self.ask_to_run(request),
            Err(reason) => self.refusal = Some(reason),
        }
    }

    /// Takes over what is remembered until the window is opened again.
    fn remember(&mut self, ctx: &Context) {
        let now = &mut self.settings.now;
        now.is_dark = ctx.theme() == Theme::Dark;
        now.zoom = ctx.zoom_factor();
    }

    /// The rest of it, when the window closes.
    fn remember_last(&mut self) {
        let now = &mut self.settings.now;
        now.screen = self.screen.name().to_owned();
        now.operator = self.form.told_text("operator").to_owned();
        now.sessions.clone_from(&self.form.folder);
        [now.left, now.right, now.log] = self.sizes.told();
    }

    /// Files dropped on the window go where they belong.
    fn take_dropped(&mut self, ctx: &Context) {
        let dropped = ctx.input(|input| input.raw.dropped_files.clone());
        let paths: Vec<PathBuf> = dropped
            .into_iter()
            .map(|file| file.path().to_owned())
            .collect();
        if paths.is_empty() {
            return;
        }
        let ends = |path: &PathBuf, wanted: &[&str]| {
            let ending = path.extension().and_then(|one| one.to_str());
            ending.is_some_and(|one| wanted.contains(&one.to_lowercase().as_str()))
        };
        let (protocols, others): (Vec<_>, Vec<_>) =
            paths.into_iter().partition(|path| ends(path, &["toml"]));
        let (tables, sessions): (Vec<_>, Vec<_>) = others
            .into_iter()
            .partition(|path| path.is_file() && !ends(path, &["mcap"]));
        if let Some(path) = protocols.first().filter(|_| self.screen == Screen::Scene) {
            self.scene.take(path, ctx);
        } else if let Some(path) = protocols.first() {
            self.screen = Screen::Run;
            self.read_protocol(|chooser| chooser.read(path, ctx));
        }
        if !tables.is_empty() && self.screen == Screen::Models {
            tables.iter().for_each(|path| self.models.add(path));
        } else if !tables.is_empty() {
            self.screen = Screen::Library;
            self.catalog.take_files(&tables);
        }
        let (recordings, sessions): (Vec<_>, Vec<_>) = sessions
            .into_iter()
            .partition(|path| path.join(TICKS).is_file());
        if let Some(folder) = recordings.first() {
            // What is of neither is told to be so on the scene's.
            if is_tape(folder).unwrap_or(false) {
                self.screen = Screen::Haptics;
                self.haptics.take_recording(folder);
            } else {
                self.screen = Screen::Scene;
                self.scene.take_recording(folder);
            }
        }
        if !sessions.is_empty() {
            // A log that was dropped stands for its session.
            let folder = |path: PathBuf| match (path.is_file(), path.parent()) {
                (true, Some(folder)) => folder.to_owned(),
                _ => path,
            };
            self.screen = Screen::Review;
            self.review
                .open(sessions.into_iter().map(folder).collect(), ctx);
        }
    }

    fn read_protocol(&mut self, read: impl FnOnce(&mut Chooser) -> std::io::Result<()>) {
        if let Err(err) = read(&mut self.chooser) {
            self.refusal = Some(format!("the protocol cannot be read: {err}"));
        }
    }

    fn operator(&mut self, choice: Operator) {
        if let Err(reason) = self.runner.operator(choice) {
            self.refusal = Some(reason);
        }
    }

    /// Asks the runner to start what stands in the form; the answer is polled, never awaited.
    fn start(&mut self) {
        if self.start_verdict().is_err() {
            return;
        }
        if let Some(request) = self.form.request(&self.bench) {
            self.ask_to_run(request);
        }
    }

    fn ask_to_run(&mut self, request: RunRequest) {
        let view = first_view(&request.plan);
        let (reply, answer) = sync_channel(1);
        self.refusal = None;
        // Nothing comes between a rig and its runner.
        self.haptics.stop_loop();
        self.scene.stop();
        match self.runner.request(Request::Run(Box::new(request), reply)) {
            Ok(()) => {
                self.start = Start::Asked(answer);
                self.middle = view;
            }
            Err(reason) => self.refusal = Some(reason),
        }
    }

    fn poll_start(&mut self) {
        match &self.start {
            Start::None => {}
            Start::Asked(answer) => match answer.try_recv() {
                Ok(Ok(())) => {
                    self.plots = PlotCache::for_calibration(&self.bench.calibration);
                    self.start = Start::Granted {
                        seen: self.snapshot.sequence,
                    };
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

    /// Closing stops first: the window stays until the axis rests.
    fn handle_close(&mut self, ctx: &Context) {
        let is_safe = !is_motion_possible(&self.snapshot) && matches!(self.start, Start::None);
        let is_asked = ctx.input(|input| input.viewport().close_requested());
        // Nothing may start in a window that is about to close.
        self.is_closing |= is_asked;
        if is_asked && !is_safe {
            self.operator(Operator::Stop);
            ctx.send_viewport_cmd(ViewportCommand::CancelClose);
        } else if !is_asked && self.is_closing && (is_safe || !self.runner.is_alive()) {
            ctx.send_viewport_cmd(ViewportCommand::Close);
        }
    }
}

impl eframe::App for WorkbenchApp {
    fn raw_input_hook(&mut self, ctx: &Context, raw_input: &mut RawInput) {
        let mut stops = Commands::default();
        self.keys.read_early(ctx, &raw_input.events, &mut stops);
        self.act(ctx, &mut stops);
    }

    fn logic(&mut self, ctx: &Context, frame: &mut eframe::Frame) {
        // Stops come before anything else of a frame.
        let mut commands = Commands::default();
        self.keys.read_stops(ctx, &mut commands);
        self.act(ctx, &mut commands);
        self.snapshot = self.runner.snapshot();
        self.handle_close(ctx);
        self.meter.begin(frame.info().cpu_usage);
        let is_new = self.keys.read(ctx, &mut commands);
        if !std::mem::replace(&mut self.is_zoom_set, true) {
            ctx.set_zoom_factor(self.settings.now.zoom);
        }
        if is_new {
            self.take_dropped(ctx);
        }
        self.poll_start();
        self.ports.poll();
        self.recovery.poll();
        match self.dialog.poll() {
            Some((Ask::NewSessions, folder)) => self.form.folder = folder.display().to_string(),
            Some((Ask::Session | Ask::Table, path)) => self.models.add(&path),
            Some((Ask::Body, path)) => self.haptics.take(&path),
            Some((Ask::Scene, path)) => self.scene.take(&path, ctx),
            Some((Ask::Protocol, path)) => self.read_protocol(|chooser| chooser.read(&path, ctx)),
            None => {}
        }
        if let Some((path, text)) = self.chooser.poll() {
            // What runs stands in the form until it has ended.
            if !self.is_busy() {
                self.form.choose_file(&path, text);
                self.middle = match self.form.protocol {
                    Ok(_) => Middle::Course,
                    Err(_) => Middle::Choose,
                };
            }
        }
        self.catalog.poll(ctx);
        self.review.poll(ctx);
        self.models.poll();
        self.extremes.poll();
        self.haptics.poll();
        self.scene.poll();
        self.scene.plan(self.trade.scene_curves());
        self.trade.poll();
        self.calibration.poll();
        if self.screen == Screen::Library {
            self.catalog.shown(ctx);
        }
        if self.screen == Screen::Trade {
            self.trade.shown(ctx);
        }
        if self.screen == Screen::Calibration {
            self.calibration.shown(ctx);
        }
        if self.screen == Screen::Scene {
            self.scene.shown(ctx);
        }
        let rig = &self.snapshot.rig;
        self.form
            .refresh(&rig.description, &self.bench, rig.is_homed);
        if let Some(run) = &self.snapshot.run {
            self.meter.run(run);
        }
        self.plots.update(self.snapshot.run.as_ref());
        self.refitter.update(ctx, self.snapshot.run.as_ref());
        self.act(ctx, &mut commands);
        self.remember(ctx);
        let is_quiet = run_in_progress(&self.snapshot).is_none()
            && self.intent() == Intent::None
            && !is_motion_possible(&self.snapshot)
            && !self.haptics.is_running()
            && !self.scene.is_running();
        // On the rig's screen somebody may press the cell by hand.
        self.pace.next(ctx, !is_quiet, self.screen == Screen::Rig);
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        let mut commands = Commands::default();
        let activity = activity(&self.snapshot, self.intent());
        self.draw(ui, &activity, &mut commands);
        if self.palette.is_open() {
            let mut actions = self.actions();
            actions.extend(
                places(ui.ctx())
                    .into_iter()
                    .map(|(name, id)| Action::new(format!("Go to {name}"), "", Command::Focus(id))),
            );
            self.palette.ui(ui, &actions, &mut commands);
        }
        if !std::mem::replace(&mut self.are_fonts_warm, true) {
            theme::warm_up_fonts(ui.ctx());
        }
        let rig = &self.snapshot.rig;
        self.form
            .refresh(&rig.description, &self.bench, rig.is_homed);
        let ctx = ui.ctx().clone();
        self.act(&ctx, &mut commands);
        self.meter.end();
    }

    fn on_exit(&mut self) {
        self.haptics.close();
        self.scene.close();
        self.remember_last();
        if let Err(err) = self.settings.store() {
            let _ =
                std::io::Write::write_all(&mut std::io::stderr(), format!("{err}\n").as_bytes());
        }
        if let Err(err) = self.meter.write_report() {
            // Nobody is left to read a screen; standard error is the last place to say it.
            let _ = std::io::Write::write_all(
                &mut std::io::stderr(),
                format!("the frame report cannot be written: {err}\n").as_bytes(),
            );
        }
    }
}

#[cfg(test)]
mod tests;
