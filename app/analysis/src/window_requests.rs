//! Requests that open a window: the front end that parses them need not know any window.

use palpate_drivers::Rig;
use palpate_model::calibration::Calibration;
use palpate_model::rig::Limits;
use palpate_model::units::Newtons;
use palpate_runner::TimeScale;
use palpate_runner::replay::Player;
use std::path::PathBuf;

/// Name of the file in the library that holds what the window remembers of its user.
pub const SETTINGS_FILE: &str = "window.json";

pub struct WorkbenchRequest {
    pub rig: Box<dyn Rig>,
    /// Volts to newtons of its load cell.
    pub calibration: Calibration,
    pub limits: Limits,
    /// Sentences that must be acknowledged before any run, such as a failed daily check.
    pub to_acknowledge: Vec<String>,
    /// Pace of a simulated rig.
    pub scale: TimeScale,
    /// Absolute paths of sessions, protocols or tables to show at once, as if they were dropped on the window.
    pub to_open: Vec<PathBuf>,
}

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
