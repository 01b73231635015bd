//! The workbench's window as an eframe app: `logic` reads keys and the answers of workers, `ui` draws a snapshot.

use crate::command::{Commands, TextSize, UiCommand};
use crate::screens::screen::{Screen, Screens};
use crate::screens::{result, rig, run, start_page};
use crate::settings::{SettingsFile, ZOOM};
use crate::shell::activity::{activity, run_in_progress};
use crate::shell::armed::armed_ui;
use crate::shell::dropped_files::push_dropped;
use crate::shell::event_log::{EventLog, FOLDED_HEIGHT};
use crate::shell::frame_meter::FrameMeter;
use crate::shell::keys::KeyReader;
use crate::shell::pace::FramePace;
use crate::shell::palette::{Palette, PaletteAction};
use crate::shell::panels::frame;
use crate::shell::rail::{self, rail_ui};
use crate::shell::run_strip::{is_controllable, run_strip_ui};
use crate::shell::sizes::{PanelEdge, STEP, Sizes};
use crate::shell::top_bar::{HEIGHT, top_bar_ui};
use crate::shell::tour::Tour;
use crate::theme;
use crate::widgets::{alarm_ui, places, require};
use crate::window::WindowOptions;
use crate::workbench::Workbench;
use crate::workers::fit::Refit;
use crate::workers::{PathPurpose, pick};
use eframe::egui::{Context, Panel, RawInput, Theme, Ui, ViewportCommand, Visuals};
use palpate_analysis::demonstration_library::has_no_session;
use palpate_analysis::window_requests::WorkbenchRequest;
use palpate_protocols::engine::Operator;
use palpate_runner::RunnerSnapshot;
use std::io::Write;
use std::sync::Arc;

/// The window's own state. The rig, the run and its data belong to the runner.
pub struct WorkbenchApp {
    pub(crate) workbench: Workbench,
    pub(crate) screens: Screens,
    pub(crate) tour: Tour,
    events: EventLog,
    note: String,
    palette: Palette,
    settings: SettingsFile,
    sizes: Sizes,
    keys: KeyReader,
    /// Pressed in this frame, and done once its letters have reached their fields.
    after_letters: Commands,
    meter: FrameMeter,
    pace: FramePace,
    is_zoom_set: bool,
    /// Whose text size is in use, and the one that the last frame named.
    monitor: Option<String>,
    seen_monitor: Option<String>,
    are_fonts_warm: bool,
}

impl WorkbenchApp {
    /// Starts the runner on the rig of the options. Opens no window; what is read from disk is read on threads.
    pub fn new(mut options: WindowOptions, ctx: &Context) -> Result<Self, String> {
        theme::apply(ctx);
        let (settings, notice) = SettingsFile::open(options.settings.take());
        if settings.now.is_dark {
            theme::switch(ctx);
        }
        let pace = FramePace::default();
        let to_open = std::mem::take(&mut options.request.to_open);
        let mut workbench = Workbench::start(options, ctx, pace.waker(ctx))?;
        workbench.notice = notice;
        let form = &mut workbench.form;
        form.set_label("operator", &settings.now.operator);
        if form.folder.is_empty() {
            form.folder.clone_from(&settings.now.sessions);
        }
        let mut screens = Screens::open(&workbench, &settings.now.screen, &settings.now.layouts);
        let library = workbench.library.as_ref();
        let is_first = settings.is_new()
            && to_open.is_empty()
            && workbench.is_simulated
            && library.is_ok_and(|library| has_no_session(library));
        let mut tour = Tour::default();
        if is_first {
            // The tour follows the choice of the simulated rig.
            screens.show(start_page::SCREEN.name);
        } else if settings.has_file() && !settings.now.is_tour_over {
            tour.start();
        }
        let mut app = Self {
            screens,
            workbench,
            tour,
            events: EventLog::default(),
            note: String::new(),
            palette: Palette::default(),
            sizes: Sizes::from_changes([settings.now.left, settings.now.right, settings.now.log]),
            settings,
            keys: KeyReader::default(),
            after_letters: Commands::default(),
            meter: FrameMeter::from_environment(),
            pace,
            is_zoom_set: false,
            monitor: None,
            seen_monitor: None,
            are_fonts_warm: false,
        };
        let mut commands = Commands::default();
        push_dropped(to_open, run::SCREEN.name, &mut commands);
        app.act(ctx, &mut commands);
        Ok(app)
    }

    pub fn snapshot(&self) -> &Arc<RunnerSnapshot> {
        &self.workbench.snapshot
    }

    /// How far the exact fit of the run is.
    pub fn refit(&self) -> Refit<'_> {
        self.workbench.latest_run.refit(self.workbench.measured_run())
    }

    pub fn screen<T: Screen>(&self) -> Option<&T> {
        self.screens.get()
    }

    /// Stops the rig first: the loops of screens may take longer.
    fn stop(&mut self) {
        self.workbench.operator(Operator::Stop);
        self.screens.stop();
        self.palette.close();
    }

    fn act(&mut self, ctx: &Context, commands: &mut Commands) {
        for command in commands.take() {
            self.act_on(ctx, command);
            ctx.request_repaint();
        }
    }

    fn act_on(&mut self, ctx: &Context, command: UiCommand) {
        self.workbench.occupation = self.screens.occupation();
        match command {
            UiCommand::Stop => self.stop(),
            UiCommand::Work => self.screens.shown_mut().work(ctx, &mut self.workbench),
            UiCommand::CancelWork => self.screens.shown_mut().cancel(),
            UiCommand::Show(screen) => self.screens.show(screen),
            // What is judged is to be seen.
            UiCommand::AcceptRun if self.screens.shown() != result::SCREEN.name => {
                self.screens.show(result::SCREEN.name);
            }
            UiCommand::SwitchTheme => theme::switch(ctx),
            UiCommand::Resize { edge, is_larger } => {
                self.sizes.grow(edge, if is_larger { STEP } else { -STEP });
            }
            UiCommand::TextSize(size) => set_text_size(ctx, size),
            UiCommand::Focus(id) => ctx.memory_mut(|memory| memory.request_focus(id)),
            UiCommand::Choose(ask) => {
                let pick = move |dialog| pick(ask, dialog);
                self.workbench.open_dialog(ctx, self.screens.shown(), pick);
            }
            UiCommand::Palette => self.palette.toggle(),
            UiCommand::TourStart => {
                self.tour.start();
                self.screens.show(run::SCREEN.name);
            }
            UiCommand::TourNext => match self.tour.go_on() {
                Some(screen) => self.screens.show(screen),
                None => self.settings.now.is_tour_over = true,
            },
            UiCommand::TourEnd => {
                self.tour.end();
                self.settings.now.is_tour_over = true;
            }
            UiCommand::TakeSimulatedRig if self.workbench.is_simulated => {
                if self.settings.has_file() && !self.settings.now.is_tour_over {
                    self.tour.start();
                }
                self.screens.show(run::SCREEN.name);
            }
            UiCommand::NoteTyped => {
                let text = match self.note.trim() {
                    "" => "mark".to_owned(),
                    text => text.to_owned(),
                };
                if self.workbench.write_note(text) {
                    self.note.clear();
                }
            }
            command => {
                if !self.workbench.act(ctx, &command) {
                    self.screens.act(ctx, &command, &mut self.workbench);
                }
            }
        }
        if self.workbench.has_next_run() {
            // A loop on this computer would disturb the runner.
            self.screens.stop();
            self.workbench.begin_next_run();
        }
    }

    /// Takes an open rig in place of the present one, whose link is closed. Nothing moves.
    fn take_rig(&mut self, ctx: &Context, request: WorkbenchRequest) {
        let is_written = require(!self.workbench.queue.is_busy(), "a verdict is being written");
        if let Err(reason) = self.workbench.free_verdict().and(is_written) {
            self.workbench.refusal = Some(format!("the rig was not connected, because {reason}"));
            return;
        }
        self.screens.stop();
        self.screens.close();
        let old = &self.workbench;
        let station = old.station.settings();
        let request = WorkbenchRequest { station, ..request };
        let options = WindowOptions {
            sessions: old.library.clone().ok(),
            list_ports: old.list_ports,
            ..WindowOptions::from_request(request)
        };
        let taken = Workbench::start(options, ctx, self.pace.waker(ctx));
        let mut new = match taken {
            Ok(new) => new,
            Err(reason) => return self.workbench.refusal = Some(reason),
        };
        new.form.set_label("operator", old.form.label_text("operator"));
        new.form.folder.clone_from(&old.form.folder);
        new.graphics = std::mem::take(&mut self.workbench.graphics);
        let old = std::mem::replace(&mut self.workbench, new);
        // Closing a link may take a moment, for which no frame waits.
        let closing = std::thread::Builder::new().name("rig-closing".into());
        if let Err(err) = closing.spawn(move || drop(old)) {
            self.workbench.refusal = Some(format!(
                "the former rig was not closed ({err}); restart palpate to free its ports"
            ));
        }
        let is_simulated = self.workbench.is_simulated;
        let shown = if is_simulated { run::SCREEN.name } else { rig::SCREEN.name };
        self.screens = Screens::open(&self.workbench, shown, &self.screens.layouts());
    }

    /// Copies into the settings what is only needed when the window closes.
    fn update_settings(&mut self) {
        let now = &mut self.settings.now;
        let form = &self.workbench.form;
        if self.screens.shown() != start_page::SCREEN.name {
            // The result of a run is gone with the window.
            let shown = self.screens.shown();
            let shown = if shown == result::SCREEN.name { run::SCREEN.name } else { shown };
            now.screen = shown.to_owned();
        }
        now.operator = form.label_text("operator").to_owned();
        now.sessions.clone_from(&form.folder);
        [now.left, now.right, now.log] = self.sizes.changes();
        now.layouts = self.screens.layouts();
    }

    /// Takes the text size of the monitor that the window has come to.
    fn follow_monitor(&mut self, ctx: &Context) {
        let monitor = monitor_name(ctx);
        // In the frame after a change of text size, the size of the monitor is still that of before.
        let is_sure = self.seen_monitor == monitor && monitor.is_some();
        self.seen_monitor.clone_from(&monitor);
        let settings = &self.settings.now;
        if !std::mem::replace(&mut self.is_zoom_set, true) {
            ctx.set_zoom_factor(settings.zoom);
        } else if is_sure && monitor != self.monitor {
            ctx.set_zoom_factor(
                monitor.as_deref().map_or(settings.zoom, |it| settings.zoom_of(it)),
            );
            self.monitor = monitor;
        }
    }

    /// Closing stops motion first: the window stays until the axis is at rest.
    fn handle_close(&mut self, ctx: &Context) {
        if ctx.input(|input| input.viewport().close_requested()) {
            if !self.workbench.begin_to_close() {
                ctx.send_viewport_cmd(ViewportCommand::CancelClose);
            }
        } else if self.workbench.may_close() {
            ctx.send_viewport_cmd(ViewportCommand::Close);
        }
    }

    /// Reads the keys that stop nothing, and takes what was dropped.
    fn read_input(&mut self, ctx: &Context, commands: &mut Commands) {
        if self.keys.read(ctx, commands, &mut self.after_letters) {
            let dropped = ctx.input(|input| input.raw.dropped_files.clone());
            let paths = dropped.iter().map(|file| file.path().to_owned());
            push_dropped(paths.collect(), self.screens.shown(), commands);
        }
    }

    fn draw(&mut self, ui: &mut Ui, commands: &mut Commands) {
        let panel = |name: &'static str, ui: &Ui| {
            let panel = Panel::top(name).frame(frame(ui, false));
            panel.resizable(false)
        };
        let snapshot = Arc::clone(&self.workbench.snapshot);
        let activity = activity(&snapshot, self.workbench.intent());
        panel("state", ui).exact_size(HEIGHT + 14.0).show(ui, |ui| {
            let specimen = self.workbench.form.specimen();
            top_bar_ui(ui, &snapshot, &activity, specimen);
        });
        if let Some(run) = run_in_progress(&snapshot).filter(|run| is_controllable(run)) {
            panel("run_strip", ui).show(ui, |ui| run_strip_ui(ui, run, &mut self.note, commands));
        }
        if let Some(reason) = self.workbench.dialog_refusal(self.screens.shown()) {
            panel("dialog_refusal", ui).show(ui, |ui| alarm_ui(ui, reason));
        }
        if let Some(armed) = self.workbench.station.armed() {
            panel("armed", ui).show(ui, |ui| armed_ui(ui, &armed, commands));
        }
        if self.tour.is_on() {
            panel("tour", ui).show(ui, |ui| self.tour.ui(ui, commands));
        }
        Panel::left("rail")
            .exact_size(rail::width(ui.ctx().content_rect().width()))
            .resizable(false)
            .frame(frame(ui, false))
            .show(ui, |ui| rail_ui(ui, self.screens.shown(), commands));
        let log = Panel::bottom("log").frame(frame(ui, true));
        if self.events.update(&snapshot) {
            let log = self.sizes.of(PanelEdge::Log, log);
            let log = log.show(ui, |ui| self.events.ui(ui, &snapshot, commands));
            self.sizes.drag(ui, PanelEdge::Log, log.response.rect);
        } else {
            let log = log.exact_size(FOLDED_HEIGHT).resizable(false);
            log.show(ui, |ui| self.events.folded_ui(ui, &snapshot, commands));
        }
        let screen = self.screens.shown_mut();
        screen.ui(ui, &mut self.sizes, &mut self.workbench, commands);
    }
}

/// A monitor by its pixels and its scale: systems do not report its maker. None where there is no monitor.
fn monitor_name(ctx: &Context) -> Option<String> {
    let viewport = ctx.input(|input| input.viewport().clone());
    let scale = viewport.native_pixels_per_point?;
    // The size is in points, which the zoom changes.
    let pixels = viewport.monitor_size? * ctx.pixels_per_point();
    Some(format!("{:.0} x {:.0} at {scale:.2}", pixels.x, pixels.y))
}

fn set_text_size(ctx: &Context, size: TextSize) {
    let zoom = ctx.zoom_factor();
    let zoom = match size {
        TextSize::Larger => zoom * 1.1,
        TextSize::Smaller => zoom / 1.1,
        TextSize::Usual => 1.0,
    };
    ctx.set_zoom_factor(zoom.clamp(*ZOOM.start(), *ZOOM.end()));
}

impl eframe::App for WorkbenchApp {
    fn clear_color(&self, visuals: &Visuals) -> [f32; 4] {
        theme::clear_color(visuals)
    }

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
        self.handle_close(ctx);
        self.meter.begin(frame.info().cpu_usage);
        self.read_input(ctx, &mut commands);
        self.follow_monitor(ctx);
        self.workbench.poll(ctx);
        if let Some((ask, path)) = self.workbench.poll_dialog() {
            commands.push(match ask {
                PathPurpose::Opened => UiCommand::Review(vec![path]),
                ask => UiCommand::Chosen(ask, path),
            });
        }
        self.workbench.occupation = self.screens.occupation();
        self.screens.poll(ctx, &mut self.workbench);
        // Who watched the run sees what came of it; who is elsewhere is left there.
        if self.workbench.follow_run(ctx) && self.screens.shown() == run::SCREEN.name {
            self.screens.show(result::SCREEN.name);
        }
        if let Some(request) = self.workbench.next_rig.take() {
            self.take_rig(ctx, request);
        }
        self.workbench.refresh_form();
        if let Some(run) = self.workbench.run() {
            self.meter.run(run);
        }
        self.act(ctx, &mut commands);
        self.settings.now.is_dark = ctx.theme() == Theme::Dark;
        self.settings.now.keep_zoom(self.monitor.as_deref(), ctx.zoom_factor());
        self.workbench.occupation = self.screens.occupation();
        let is_watched = self.screens.shown_mut().is_watched();
        let frame_s = frame.info().cpu_usage;
        self.workbench.graphics.take(frame.wgpu_render_state());
        self.workbench.graphics.frame_ms = self.pace.frame_ms(ctx, frame_s);
        self.pace.next(ctx, frame_s, !self.workbench.is_quiet(), is_watched);
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        let mut commands = Commands::default();
        self.draw(ui, &mut commands);
        if self.palette.is_open() {
            let mut actions = self.actions();
            actions.extend(places(ui.ctx()).into_iter().map(|(name, id)| {
                PaletteAction::new(format!("Go to {name}"), "", UiCommand::Focus(id))
            }));
            self.palette.ui(ui, &actions, &mut commands);
        }
        if !std::mem::replace(&mut self.are_fonts_warm, true) {
            theme::warm_up_fonts(ui.ctx());
        }
        self.workbench.refresh_form();
        let ctx = ui.ctx().clone();
        self.act(&ctx, &mut commands);
        let mut keys = std::mem::take(&mut self.after_letters);
        self.act(&ctx, &mut keys);
        self.meter.end();
    }

    fn on_exit(&mut self) {
        self.screens.close();
        self.update_settings();
        let report = self.meter.write_report();
        let report =
            report.map_err(|err| format!("the report of frame times cannot be written: {err}"));
        for err in [self.settings.store(), report].into_iter().filter_map(Result::err) {
            // The window is gone; standard error is the last place to say it.
            let _ = writeln!(std::io::stderr(), "{err}");
        }
    }
}

#[cfg(test)]
mod tests;
