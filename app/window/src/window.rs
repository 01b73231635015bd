//! The window: its options, and how it opens.

use crate::app::WorkbenchApp;
use crate::workbench::ListPorts;
use eframe::egui::{Context, ViewportBuilder, ViewportCommand, vec2};
use palpate_analysis::window_requests::{SETTINGS_FILE, WorkbenchRequest};
use palpate_drivers::serial::list_ports;
use palpate_drivers::sim::SimSettings;
use palpate_model::rig::Limits;
use palpate_runner::TimeScale;
use palpate_sessions::library_folder;
use std::path::PathBuf;

/// The window's icon, painted from `icon.svg`.
const ICON: &[u8] = include_bytes!("../icon.png");

/// What a window opens with.
pub struct WindowOptions {
    /// The rig, and what goes with it.
    pub request: WorkbenchRequest,
    /// Folder for new sessions; the library if none.
    pub sessions: Option<PathBuf>,
    pub list_ports: ListPorts,
    /// File of the window's settings; none are kept without one.
    pub settings: Option<PathBuf>,
}

impl WindowOptions {
    /// Options for a rig by name: `sim` or `sim:NAME`.
    pub fn open(name: &str, settings: &SimSettings, scale: TimeScale) -> Result<Self, String> {
        let rig = palpate_drivers::open(name, settings).map_err(|err| err.to_string())?;
        let limits = Limits::for_travel(rig.description().travel);
        let calibration = palpate_drivers::sim::calibration(settings.profile);
        let request = WorkbenchRequest::of(rig, calibration, limits, scale);
        Ok(Self { settings: None, ..Self::from_request(request) })
    }

    /// Options for an open rig, with the settings file of the library.
    #[must_use]
    pub fn from_request(request: WorkbenchRequest) -> Self {
        Self {
            request,
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

pub(crate) fn open_window<A: eframe::App + 'static>(
    make: impl FnOnce(&Context) -> Result<A, String> + 'static,
) -> Result<(), String> {
    let icon = eframe::icon_data::from_png_bytes(ICON).map_err(|err| err.to_string())?;
    let native = eframe::NativeOptions {
        viewport: ViewportBuilder::default()
            .with_icon(icon)
            .with_title("palpate")
            // The name of the desktop entry, by which a desktop finds the icon.
            .with_app_id("palpate")
            .with_inner_size(vec2(1360.0, 820.0))
            .with_min_inner_size(vec2(768.0, 600.0)),
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
