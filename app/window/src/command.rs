//! All commands of the user, one enum. Drawing code pushes them; only the app executes them.

use crate::screens::run_panes::RunPane;
use crate::shell::run_strip::RunControl;
use crate::shell::sizes::PanelEdge;
use crate::workers::PathPurpose;
use crate::workers::queue_desk::QueueWork;
use crate::workers::station::StationCommand;
use eframe::egui::Id;
use std::collections::BTreeMap;
use std::path::PathBuf;

#[derive(Clone, Debug, PartialEq)]
pub enum UiCommand {
    Start,
    /// Controlled stop: the axis brakes.
    Stop,
    /// Immediate stop without braking; the axis must be homed again.
    Halt,
    RunControl(RunControl),
    /// After a stop: move the probe out of the tissue.
    Retract,
    /// After a stop: end the session where the probe is.
    CloseSession,
    /// Connects the rig again after its link was lost; nothing moves.
    Reconnect,
    ListPorts,
    /// Works on the simulated rig; the first time with the tour.
    TakeSimulatedRig,
    /// Searches the serial ports and the rig files.
    FindRig,
    /// Opens the rig of this file in place of the present one.
    ConnectRig(PathBuf),
    /// Records the sessions of the demonstration into the empty library.
    FillLibrary,
    /// Opens a dialog for a folder or a file.
    Choose(PathPurpose),
    View(RunPane),
    /// Takes a built-in protocol into the form.
    TakeProtocol(&'static str),
    /// Accepts the run that has ended.
    AcceptRun,
    /// Takes protocol and labels of the specimen with this number in the queue into the form.
    TakeSpecimen(u32),
    /// Has the queue of specimens changed, with a reason where one is needed.
    Queue(QueueWork, String),
    /// Reads the protocol file whose path is typed.
    OpenProtocol,
    /// Writes the text of the note field into the run in progress, or a mark where it is empty.
    NoteTyped,
    ManualMove(ManualMove),
    /// Serves the rig, or arms a queue for runs over the network.
    Station(StationCommand),
    /// Takes the protocol that calibrates the load cell.
    MeasureCalibration,
    /// Takes the protocol of the daily check.
    CheckRig,
    /// Saves the calibration that the last run measured.
    KeepCalibration,
    /// Starts the work of the screen shown: compare models, measure, test.
    Work,
    CancelWork,
    /// Starts the haptic loop on the material and device that were checked.
    LoopStart,
    LoopStop,
    SceneStart,
    SceneStop,
    /// Reads the scene file whose path is typed, or the built-in scene.
    OpenScene,
    /// Shows the screen that measures the curves of a scene.
    MeasureScene,
    SwitchTheme,
    /// Shows these sessions on the review screen, instead of those there.
    Review(Vec<PathBuf>),
    TextSize(TextSize),
    Resize {
        edge: PanelEdge,
        is_larger: bool,
    },
    Focus(Id),
    /// Opens or closes the command palette.
    Palette,
    TourStart,
    TourNext,
    TourEnd,
    /// Shows the screen of this name.
    Show(&'static str),
    /// A path was chosen in a dialog, or dropped on the window.
    Chosen(PathPurpose, PathBuf),
    /// Proposes files of other programs for import.
    Import(Vec<PathBuf>),
    /// Proposes a recording of the haptic loop for replay.
    ReplayLoop(PathBuf),
    /// Proposes a recording of a scene for replay.
    ReplayScene(PathBuf),
}

impl UiCommand {
    /// A stop comes before all other commands.
    pub const fn is_stop(&self) -> bool {
        matches!(self, Self::Stop | Self::Halt)
    }
}

/// A short run apart from the protocol in the form.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ManualMove {
    /// A built-in one.
    pub protocol: &'static str,
    /// As they would be typed.
    pub values: BTreeMap<String, String>,
}

impl ManualMove {
    /// Whether a run by this plan is a move by hand: nothing is measured by it.
    #[must_use]
    pub fn is_plan(name: &str) -> bool {
        [Self::jog(0.0, 0.0).protocol, Self::home().protocol].contains(&name)
    }

    /// Moves by a distance in mm, positive towards the tissue, at a speed in mm/s.
    #[must_use]
    pub fn jog(distance: f64, speed: f64) -> Self {
        let values = [
            ("distance".to_owned(), format!("{distance} mm")),
            ("speed".to_owned(), format!("{speed} mm/s")),
        ];
        Self { protocol: "free-jog", values: values.into() }
    }

    /// Finds home, and touches it once more to compare.
    #[must_use]
    pub fn home() -> Self {
        let values =
            [("repeats".to_owned(), "1".to_owned()), ("distance".to_owned(), "1 mm".to_owned())];
        Self { protocol: "check-home", values: values.into() }
    }
}

/// A change of the size of text: a tenth, or back to the usual size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextSize {
    Larger,
    Smaller,
    Usual,
}

/// Commands since the app last acted.
#[derive(Debug, Default)]
pub struct Commands(Vec<UiCommand>);

impl Commands {
    pub fn push(&mut self, command: UiCommand) {
        self.0.push(command);
    }

    /// Takes all commands, halts and then stops first.
    pub fn take(&mut self) -> Vec<UiCommand> {
        let mut commands = std::mem::take(&mut self.0);
        commands.sort_by_key(|command| match command {
            UiCommand::Halt => 0,
            UiCommand::Stop => 1,
            _ => 2,
        });
        commands
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_overtakes_commands_before_it() {
        let mut commands = Commands::default();
        for command in [UiCommand::Start, UiCommand::ListPorts, UiCommand::Stop, UiCommand::Halt] {
            commands.push(command);
        }
        assert_eq!(
            commands.take(),
            [UiCommand::Halt, UiCommand::Stop, UiCommand::Start, UiCommand::ListPorts]
        );
        assert!(commands.take().is_empty());
    }
}
