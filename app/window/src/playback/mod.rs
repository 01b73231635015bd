//! The window of `palpate replay SESSION --window`: a recorded session at any moment and any speed. It has no rig, so
//! nothing in it can move one.

mod transport;

use crate::command::{Commands, UiCommand};
use crate::plots::PlotCache;
use crate::screens::live_panel::findings_ui;
use crate::shell::activity::{Intent, activity};
use crate::shell::event_log::{EventLog, FOLDED_HEIGHT};
use crate::shell::panels::frame;
use crate::shell::top_bar::{HEIGHT, numbers_ui};
use crate::theme::{self};
use crate::widgets::{badge_ui, tokens_of};
use crate::window::open_window;
use crate::workers::player::PlayerThread;
use eframe::egui::{
    Align, CentralPanel, Context, Label, Layout, Panel, RichText, ScrollArea, Ui, Visuals, vec2,
};
use palpate_analysis::window_requests::PlaybackRequest;
use palpate_model::Nanos;
use palpate_model::units::{Newtons, Seconds};
use palpate_runner::RunnerSnapshot;
use std::sync::Arc;
use std::time::Duration;
use transport::Transport;

/// Width of the panel beside the plots and height of the event log, in points.
const RIGHT_WIDTH: f32 = 318.0;
const LOG_HEIGHT: f32 = 134.0;
/// Between two frames while it plays: 30 a second is what an eye needs on a chart.
const FRAME_PLAYING: Duration = Duration::from_millis(33);

/// Opens the window and returns when it has closed.
pub fn run_playback(options: PlaybackRequest) -> Result<(), String> {
    open_window(move |ctx| PlaybackApp::new(options, ctx))
}

pub struct PlaybackApp {
    thread: PlayerThread,
    snapshot: Arc<RunnerSnapshot>,
    end: Nanos,
    transport: Transport,
    name: String,
    force_max: Newtons,
    is_same_engine: bool,
    plots: PlotCache,
    events: EventLog,
}

impl PlaybackApp {
    /// Stands at the beginning of the session and plays.
    pub fn new(options: PlaybackRequest, ctx: &Context) -> Result<Self, String> {
        theme::apply(ctx);
        let transport = Transport::new(options.player.end().seconds().0, options.scale);
        let (end, is_same_engine) = (options.player.end(), options.player.is_same_engine());
        let wake = ctx.clone();
        let thread = PlayerThread::start(options.player, move || wake.request_repaint())?;
        Ok(Self {
            snapshot: thread.snapshot(),
            thread,
            end,
            transport,
            name: options.name,
            force_max: options.force_max,
            is_same_engine,
            plots: PlotCache::for_calibration(&options.calibration),
            events: EventLog::unfolded(),
        })
    }

    pub fn snapshot(&self) -> &Arc<RunnerSnapshot> {
        &self.snapshot
    }

    fn state_ui(&self, ui: &mut Ui) {
        let tokens = tokens_of(ui);
        ui.horizontal(|ui| {
            ui.set_height(HEIGHT);
            let state = activity(&self.snapshot, Intent::None);
            badge_ui(ui, &state, vec2(146.0, HEIGHT));
            ui.add_space(6.0);
            ui.vertical(|ui| {
                ui.set_width(380.0);
                ui.add(Label::new(format!("Replay of {}", self.name)).truncate());
                let run = self.snapshot.run.as_ref();
                let words = match run.and_then(|run| run.prompt.as_ref()) {
                    Some(prompt) => format!("prompt: {}", prompt.message),
                    None if !self.is_same_engine => {
                        "engine decisions recomputed: another version recorded them".to_owned()
                    }
                    None => "decisions as recorded; a replay moves no rig".to_owned(),
                };
                ui.add(Label::new(RichText::new(words).color(tokens.text_quiet)).truncate());
            });
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                numbers_ui(ui, &self.snapshot);
            });
        });
    }
}

impl eframe::App for PlaybackApp {
    fn clear_color(&self, visuals: &Visuals) -> [f32; 4] {
        theme::clear_color(visuals)
    }

    fn logic(&mut self, ctx: &Context, _frame: &mut eframe::Frame) {
        self.snapshot = self.thread.snapshot();
        self.plots.update(self.snapshot.run.as_ref(), self.force_max, 0.0);
        let shown = self.snapshot.run.as_ref();
        let shown = shown.map_or(0.0, |run| run.now.seconds().0);
        self.transport.read_keys(ctx, shown);
        let passed = ctx.input(|input| f64::from(input.stable_dt));
        if let Some(wanted) = self.transport.pass(passed, shown) {
            // The end in seconds may be rounded to before the last input.
            let time = match wanted < self.end.seconds().0 {
                true => Nanos::from_seconds(Seconds(wanted)),
                false => self.end,
            };
            self.thread.go_to(time);
        }
        if self.transport.is_playing() {
            ctx.request_repaint_after(FRAME_PLAYING);
        }
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        let mut commands = Commands::default();
        Panel::top("head")
            .exact_size(HEIGHT + 14.0)
            .resizable(false)
            .frame(frame(ui, false))
            .show(ui, |ui| self.state_ui(ui));
        let log = Panel::bottom("log").resizable(false).frame(frame(ui, true));
        if self.events.update(&self.snapshot) {
            let log = log.exact_size(LOG_HEIGHT);
            log.show(ui, |ui| self.events.ui(ui, &self.snapshot, &mut commands));
        } else {
            let log = log.exact_size(FOLDED_HEIGHT);
            log.show(ui, |ui| self.events.folded_ui(ui, &self.snapshot, &mut commands));
        }
        Panel::bottom("transport").resizable(false).frame(frame(ui, false)).show(ui, |ui| {
            let run = self.snapshot.run.as_ref();
            let shown = run.map_or(0.0, |run| run.now.seconds().0);
            self.transport.ui(ui, shown);
        });
        Panel::right("results")
            .exact_size(RIGHT_WIDTH)
            .resizable(false)
            .frame(frame(ui, false))
            .show(ui, |ui| {
                let area = ScrollArea::vertical().id_salt("results");
                area.auto_shrink(false).show(ui, |ui| {
                    let RunnerSnapshot { rig, run, .. } = &*self.snapshot;
                    findings_ui(ui, rig, run.as_ref(), self.plots.cycles());
                });
            });
        CentralPanel::default().frame(frame(ui, true)).show(ui, |ui| self.plots.ui(ui, None));
        // The only thing that the events ask for here.
        if commands.take().contains(&UiCommand::SwitchTheme) {
            theme::switch(ui.ctx());
        }
    }
}
