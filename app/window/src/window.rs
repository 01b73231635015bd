//! The window: its options, how it opens, and where its panels stand.

use crate::app::WorkbenchApp;
use crate::command::Commands;
use crate::plots::course::CourseLimits;
use crate::plots::force_depth::force_depth_ui;
use crate::plots::force_time::{force_time_ui, head_ui};
use crate::plots::residual::residual_ui;
use crate::screens::calibration::Facts;
use crate::screens::form::Checked;
use crate::screens::haptics::Offered;
use crate::screens::protocol_panel::{ProtocolFacts, StartFacts, protocol_ui, start_ui};
use crate::screens::results_panel::results_ui;
use crate::screens::rig::Facts as RigFacts;
use crate::screens::rig_panel::rig_ui;
use crate::screens::run_middle::{Middle, expected_ui, views_ui};
use crate::screens::weighing::weighing_ui;
use crate::shell::activity::{Activity, run_in_progress};
use crate::shell::rail::{self, Screen, rail_ui};
use crate::shell::run_strip::{is_controllable, run_strip_ui};
use crate::shell::sizes::{Edge, Sizes};
use crate::shell::top_bar::{HEIGHT, top_bar_ui};
use crate::theme::Tokens;
use crate::workers::fit::Refit;
use crate::workers::ports::ListPorts;
use eframe::egui::{
    CentralPanel, Context, Frame, Margin, Panel, RichText, ScrollArea, Stroke, Ui, ViewportBuilder,
    ViewportCommand, vec2,
};
use palpate_analysis::opening::SETTINGS_FILE;
use palpate_analysis::opening::WorkbenchRequest;
use palpate_drivers::Rig;
use palpate_drivers::serial::list_ports;
use palpate_drivers::sim::SimSettings;
use palpate_model::calibration::Calibration;
use palpate_model::rig::Limits;
use palpate_runner::TimeScale;
use palpate_sessions::library_folder;
use std::path::PathBuf;

/// Height of the residuals under the force in points.
const RESIDUAL_HEIGHT: f32 = 96.0;

/// What a window needs.
pub struct WindowOptions {
    /// The rig, opened.
    pub rig: Box<dyn Rig>,
    /// Volts to newtons of its load cell.
    pub calibration: Calibration,
    /// Interlock thresholds.
    pub limits: Limits,
    /// What must be acknowledged before any run, such as a daily check that failed.
    pub to_acknowledge: Vec<String>,
    /// Pace of a simulated rig.
    pub scale: TimeScale,
    /// Folder for new sessions; the library if none.
    pub sessions: Option<PathBuf>,
    /// Lists the serial ports of this computer.
    pub list_ports: ListPorts,
    /// File in which the window remembers how it looked; nothing is remembered without one.
    pub settings: Option<PathBuf>,
}

impl WindowOptions {
    /// Options for a rig by name: `sim` or `sim:NAME`.
    pub fn open(name: &str, settings: &SimSettings, scale: TimeScale) -> Result<Self, String> {
        let rig = palpate_drivers::open(name, settings).map_err(|err| err.to_string())?;
        let limits = Limits::for_travel(rig.description().travel);
        Ok(Self {
            rig,
            calibration: palpate_drivers::sim::calibration(settings.profile),
            limits,
            to_acknowledge: Vec::new(),
            scale,
            sessions: None,
            list_ports,
            settings: None,
        })
    }
}

impl WindowOptions {
    /// Options for a rig that somebody opened, with what the window remembers in the library.
    #[must_use]
    pub fn remembered(request: WorkbenchRequest) -> Self {
        let WorkbenchRequest {
            rig,
            calibration,
            limits,
            to_acknowledge,
            scale,
        } = request;
        Self {
            rig,
            calibration,
            limits,
            to_acknowledge,
            scale,
            sessions: None,
            list_ports,
            settings: library_folder().ok().map(|at| at.join(SETTINGS_FILE)),
        }
    }
}

/// Opens the window and returns when it has closed, the motion stopped and the session closed.
pub fn run_window(options: WindowOptions) -> Result<(), String> {
    open_window(move |ctx| WorkbenchApp::new(options, ctx))
}

/// Opens a window of the usual size.
pub(crate) fn open_window<A: eframe::App + 'static>(
    make: impl FnOnce(&Context) -> Result<A, String> + 'static,
) -> Result<(), String> {
    let native = eframe::NativeOptions {
        viewport: ViewportBuilder::default()
            .with_title("palpate")
            .with_inner_size(vec2(1360.0, 820.0))
            .with_min_inner_size(vec2(1180.0, 640.0)),
        ..eframe::NativeOptions::default()
    };
    eframe::run_native(
        "palpate",
        native,
        Box::new(move |cc| {
            close_on_signals(&cc.egui_ctx);
            Ok(Box::new(make(&cc.egui_ctx)?))
        }),
    )
    .map_err(|err| format!("the window cannot be opened ({err}); 'palpate run' needs no window"))
}

/// A signal closes the window as its button does: motion stops first, the session is closed.
fn close_on_signals(ctx: &Context) {
    let ctx = ctx.clone();
    // Without a handler the signal still ends the program, only less politely.
    let _ = ctrlc::set_handler(move || {
        ctx.send_viewport_cmd(ViewportCommand::Close);
        ctx.request_repaint();
    });
}

pub(crate) fn frame(ui: &Ui, is_canvas: bool) -> Frame {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    Frame::new()
        .fill(if is_canvas {
            tokens.canvas
        } else {
            tokens.panel
        })
        .inner_margin(Margin::symmetric(8, 6))
        .stroke(Stroke::NONE)
}

/// A panel beside the middle that scrolls.
fn side_ui(ui: &mut Ui, sizes: &mut Sizes, edge: Edge, content: impl FnOnce(&mut Ui)) {
    let panel = match edge {
        Edge::Left => Panel::left("left"),
        _ => Panel::right("right"),
    };
    let scrolled = |ui: &mut Ui| {
        ScrollArea::vertical()
            .id_salt("side")
            .auto_shrink(false)
            .show(ui, content);
    };
    let panel = sizes.of(edge, panel).frame(frame(ui, false));
    let shown = panel.show(ui, scrolled);
    sizes.drag(ui, edge, shown.response.rect);
}

impl WorkbenchApp {
    /// Draws every panel. Changes nothing but what is typed and pressed.
    pub(crate) fn draw(&mut self, ui: &mut Ui, activity: &Activity, commands: &mut Commands) {
        Panel::top("state")
            .exact_size(HEIGHT + 14.0)
            .resizable(false)
            .frame(frame(ui, false))
            .show(ui, |ui| {
                let specimen = self.form.specimen();
                top_bar_ui(ui, &self.snapshot, activity, specimen, commands);
            });
        if let Some(run) = run_in_progress(&self.snapshot).filter(|run| is_controllable(run)) {
            Panel::top("run_strip")
                .resizable(false)
                .frame(frame(ui, false))
                .show(ui, |ui| run_strip_ui(ui, run, &mut self.note, commands));
        }
        if self.tour.is_on() {
            Panel::top("tour")
                .resizable(false)
                .frame(frame(ui, false))
                .show(ui, |ui| self.tour.ui(ui, commands));
        }
        Panel::left("rail")
            .exact_size(rail::WIDTH)
            .resizable(false)
            .frame(frame(ui, false))
            .show(ui, |ui| rail_ui(ui, self.screen, commands));
        let log = Panel::bottom("log").frame(frame(ui, true));
        let log = self.sizes.of(Edge::Log, log);
        let log = log.show(ui, |ui| self.events.ui(ui, &self.snapshot, commands));
        self.sizes.drag(ui, Edge::Log, log.response.rect);
        match self.screen {
            Screen::Rig => self.rig_screen_ui(ui, commands),
            Screen::Library => self.library_ui(ui, commands),
            Screen::Review => self.review_ui(ui, commands),
            Screen::Run => self.run_ui(ui, commands),
            Screen::Models => self.models_ui(ui, commands),
            Screen::Extremes => self.extremes_ui(ui, commands),
            Screen::Haptics => self.haptics_ui(ui, commands),
            Screen::Scene => self.scene_ui(ui, commands),
            Screen::Trade => self.trade_ui(ui, commands),
            Screen::Calibration => self.calibration_ui(ui, commands),
        }
    }

    fn rig_screen_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        side_ui(ui, &mut self.sizes, Edge::Left, |ui| {
            rig_ui(ui, &self.snapshot, &self.ports, commands);
        });
        CentralPanel::default()
            .frame(frame(ui, true))
            .show(ui, |ui| {
                let verdict = self.aside_verdict();
                let curve = &self.bench.curve;
                let reading = self.snapshot.rig.reading;
                let facts = RigFacts {
                    limits: &self.bench.limits,
                    force: reading.map(|reading| curve.newtons_from_volts(reading.volts)),
                    verdict: &verdict,
                    refusal: self.refusal.as_deref(),
                };
                self.rig_screen
                    .middle_ui(ui, &self.snapshot, &facts, commands);
            });
    }

    fn library_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        side_ui(ui, &mut self.sizes, Edge::Left, |ui| {
            self.catalog.left_ui(ui, commands)
        });
        side_ui(ui, &mut self.sizes, Edge::Right, |ui| {
            self.catalog.right_ui(ui, commands)
        });
        CentralPanel::default()
            .frame(frame(ui, true))
            .show(ui, |ui| self.catalog.middle_ui(ui, commands));
    }

    fn review_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        side_ui(ui, &mut self.sizes, Edge::Left, |ui| {
            self.review.left_ui(ui, commands)
        });
        side_ui(ui, &mut self.sizes, Edge::Right, |ui| {
            self.review.right_ui(ui, commands)
        });
        CentralPanel::default()
            .frame(frame(ui, true))
            .show(ui, |ui| self.review.middle_ui(ui, commands));
    }

    fn trade_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        let verdict = self.measure_verdict();
        side_ui(ui, &mut self.sizes, Edge::Left, |ui| {
            self.trade.left_ui(ui, &verdict, commands);
        });
        side_ui(ui, &mut self.sizes, Edge::Right, |ui| {
            self.trade.right_ui(ui)
        });
        CentralPanel::default()
            .frame(frame(ui, true))
            .show(ui, |ui| self.trade.middle_ui(ui));
    }

    fn calibration_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        let facts = Facts {
            in_use: &self.bench.calibration,
            is_busy: self.is_busy(),
            run: self.snapshot.run.as_ref(),
        };
        side_ui(ui, &mut self.sizes, Edge::Left, |ui| {
            self.calibration.left_ui(ui, &facts, commands);
        });
        side_ui(ui, &mut self.sizes, Edge::Right, |ui| {
            self.calibration.right_ui(ui)
        });
        CentralPanel::default()
            .frame(frame(ui, true))
            .show(ui, |ui| self.calibration.middle_ui(ui));
    }

    fn extremes_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        side_ui(ui, &mut self.sizes, Edge::Left, |ui| {
            self.extremes.left_ui(ui, commands)
        });
        side_ui(ui, &mut self.sizes, Edge::Right, |ui| {
            self.extremes.right_ui(ui)
        });
        CentralPanel::default()
            .frame(frame(ui, true))
            .show(ui, |ui| self.extremes.middle_ui(ui));
    }

    fn haptics_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        let verdict = self.loop_verdict();
        let library = self.catalog.chosen().first().cloned();
        let offered = Offered {
            review: self.review.front_session(),
            library: library.as_deref(),
        };
        side_ui(ui, &mut self.sizes, Edge::Left, |ui| {
            self.haptics.left_ui(ui, &offered, &verdict, commands);
        });
        side_ui(ui, &mut self.sizes, Edge::Right, |ui| {
            self.haptics.right_ui(ui)
        });
        CentralPanel::default()
            .frame(frame(ui, true))
            .show(ui, |ui| self.haptics.middle_ui(ui));
    }

    fn scene_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        let verdict = self.scene_verdict();
        side_ui(ui, &mut self.sizes, Edge::Left, |ui| {
            self.scene.left_ui(ui, &verdict, commands);
        });
        side_ui(ui, &mut self.sizes, Edge::Right, |ui| {
            self.scene.right_ui(ui)
        });
        CentralPanel::default()
            .frame(frame(ui, true))
            .show(ui, |ui| self.scene.middle_ui(ui));
    }

    fn models_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        let run = self.snapshot.run.as_ref();
        let last_run = run
            .filter(|run| run.outcome.is_some())
            .map(|run| run.folder.as_path());
        side_ui(ui, &mut self.sizes, Edge::Left, |ui| {
            self.models.left_ui(ui, last_run, commands);
        });
        side_ui(ui, &mut self.sizes, Edge::Right, |ui| {
            self.models.right_ui(ui)
        });
        CentralPanel::default()
            .frame(frame(ui, true))
            .show(ui, |ui| self.models.middle_ui(ui));
    }

    fn run_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        let left = Panel::left("rig_and_protocol").frame(frame(ui, false));
        let left = self.sizes.of(Edge::Left, left);
        let left = left.show(ui, |ui| self.left_ui(ui, commands));
        self.sizes.drag(ui, Edge::Left, left.response.rect);
        let refit = self.refitter.of(self.snapshot.run.as_ref());
        side_ui(ui, &mut self.sizes, Edge::Right, |ui| {
            results_ui(ui, &self.snapshot, refit, self.plots.loops(), commands);
        });
        CentralPanel::default()
            .frame(frame(ui, true))
            .show(ui, |ui| self.middle_ui(ui, commands));
    }

    fn left_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        let verdict = self.start_verdict();
        let is_busy = self.is_busy();
        Panel::bottom("start")
            .resizable(false)
            .frame(Frame::new().inner_margin(Margin::symmetric(0, 6)))
            .show(ui, |ui| {
                let facts = StartFacts {
                    is_busy,
                    verdict: &verdict,
                    refusal: self.refusal.as_deref(),
                    is_link_lost: self.snapshot.rig.link_error.is_some(),
                };
                start_ui(ui, &mut self.form, &facts, commands);
            });
        let facts = ProtocolFacts {
            is_busy,
            library: &self.library,
            recovered: self.recovery.told(),
            is_dialog_open: self.dialog.is_open(),
        };
        CentralPanel::no_frame().show(ui, |ui| {
            ScrollArea::vertical()
                .id_salt("rig_and_protocol")
                .auto_shrink(false)
                .show(ui, |ui| {
                    protocol_ui(ui, &mut self.form, &facts, commands);
                    rig_ui(ui, &self.snapshot, &self.ports, commands);
                });
        });
    }

    fn middle_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        let run = self.snapshot.run.as_ref();
        views_ui(ui, self.middle, run, commands);
        let reading = self.snapshot.rig.reading;
        match self.middle {
            Middle::Weighing => {
                if let Some(run) = run {
                    let signal = reading.map(|reading| reading.volts);
                    weighing_ui(ui, run, signal, &self.bench, commands);
                }
            }
            Middle::Approach => {
                if let Some(run) = run {
                    self.approach.ui(ui, run);
                }
            }
            Middle::Choose => {
                let facts = ProtocolFacts {
                    is_busy: self.is_busy(),
                    library: &self.library,
                    recovered: self.recovery.told(),
                    is_dialog_open: self.dialog.is_open(),
                };
                self.chooser.ui(ui, &self.form, &facts, commands);
            }
            Middle::Course => {
                let checked = self.form.checked();
                let tight = |checked: &Checked| checked.plan.limits.tighten(self.bench.limits);
                let limits = CourseLimits {
                    force: checked.map_or(self.bench.limits, tight).force_max,
                    speed: self.snapshot.rig.description.speed_max,
                };
                expected_ui(ui, checked, limits);
            }
            Middle::Measured => self.plots_ui(ui),
        }
    }

    fn plots_ui(&mut self, ui: &mut Ui) {
        head_ui(ui, &mut self.time_view, &self.plots);
        let run = self.snapshot.run.as_ref();
        let limit = self.bench.limits.force_max;
        let exact = match self.refit() {
            Refit::Done(exact) => Some(exact),
            _ => None,
        };
        // The chart over time carries the limits and phases, so it gets the larger half.
        let height = (ui.available_height() - 30.0) * 0.56;
        let below = if exact.is_some() {
            RESIDUAL_HEIGHT
        } else {
            0.0
        };
        let mut shown = 0.0..=1.0;
        ui.allocate_ui(vec2(ui.available_width(), height - below), |ui| {
            shown = force_time_ui(ui, run, &self.plots, exact, self.time_view, limit);
        });
        if let Some(exact) = exact {
            ui.allocate_ui(vec2(ui.available_width(), below), |ui| {
                residual_ui(ui, exact, shown);
            });
        }
        ui.label(RichText::new("Force over depth").heading().strong());
        let depth = self.form.checked().map_or(0.0, Checked::deepest_mm);
        force_depth_ui(ui, &self.plots, depth);
    }
}
