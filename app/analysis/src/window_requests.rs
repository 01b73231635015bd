//! Requests that open a window: the front end that parses them need not know any window.

use crate::station_settings::StationSettings;
use palpate_drivers::Rig;
use palpate_model::calibration::Calibration;
use palpate_model::rig::Limits;
use palpate_model::units::Newtons;
use palpate_runner::replay::Player;
use palpate_runner::{RunnerSnapshot, TimeScale};
use palpate_sessions::folder::HolderLock;
use std::path::PathBuf;
use std::sync::Arc;

/// Name of the file in the library that holds what the window remembers of its user.
pub const SETTINGS_FILE: &str = "window.json";

/// Version of that file. A new key does not raise it: older versions of palpate keep keys that they do not know.
pub const SETTINGS_VERSION: u32 = 1;

pub struct WorkbenchRequest {
    pub rig: Box<dyn Rig>,
    /// Volts to newtons of its load cell.
    pub calibration: Calibration,
    /// The calibration that comes with the rig, where that is another one.
    pub built_in: Option<Calibration>,
    /// Reasons to doubt the calibration, which must be acknowledged before any run that reads forces with it.
    pub doubts: Vec<String>,
    pub limits: Limits,
    /// Sentences that must be acknowledged before any run, such as a failed daily check.
    pub to_acknowledge: Vec<String>,
    /// Pace of a simulated rig.
    pub scale: TimeScale,
    /// Absolute paths of sessions, protocols or tables to show at once, as if they were dropped on the window.
    pub to_open: Vec<PathBuf>,
    /// Keep the rig from other programs while the window has it.
    pub locks: Vec<HolderLock>,
    /// Serve the rig from the start.
    pub station: Option<StationSettings>,
    /// Opens another rig for the same window, if that is possible.
    pub open_rig: Option<RigOpener>,
    /// Whoever watches the runs beside the window, such as the notifications.
    pub watcher: Option<Arc<dyn RunWatcher>>,
}

/// Watches the runs of a window.
pub trait RunWatcher: Send + Sync {
    /// Called on the runner's thread after every snapshot; it must not wait.
    fn see(&self, snapshot: &RunnerSnapshot);

    /// What went wrong with the watching so far, a sentence each.
    fn problems(&self) -> Vec<String>;
}

impl WorkbenchRequest {
    /// A rig with nothing to acknowledge or to open, held by no lock, which stays the window's only one.
    #[must_use]
    pub fn of(
        rig: Box<dyn Rig>,
        calibration: Calibration,
        limits: Limits,
        scale: TimeScale,
    ) -> Self {
        Self {
            rig,
            calibration,
            built_in: None,
            doubts: Vec::new(),
            limits,
            to_acknowledge: Vec::new(),
            scale,
            to_open: Vec::new(),
            locks: Vec::new(),
            station: None,
            open_rig: None,
            watcher: None,
        }
    }
}

/// Opens a rig by its name, `sim` or the path of a rig file; the error says what to do. It may take seconds.
pub type RigOpener = Arc<dyn Fn(&str) -> Result<WorkbenchRequest, String> + Send + Sync>;

/// A recorded session to play back.
pub struct PlaybackRequest {
    pub player: Player,
    pub calibration: Calibration,
    pub force_max: Newtons,
    /// Name in the head of the window.
    pub name: String,
    pub scale: TimeScale,
}

/// Opens windows. Each call returns when its window has closed.
pub trait WindowOpener {
    fn workbench(&self, request: WorkbenchRequest) -> Result<(), String>;

    fn playback(&self, request: PlaybackRequest) -> Result<(), String>;
}
