//! Everything a user can ask for, one enum. Drawing code pushes; only the app acts.

use crate::screens::run_panes::RunPane;
use crate::shell::run_strip::RunControl;
use crate::shell::sizes::PanelEdge;
use crate::workers::path_dialog::PathPurpose;
use eframe::egui::Id;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// One thing the user asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum UserCommand {
    /// Start the plan in the form.
    Start,
    /// Stop motion, now.
    Stop,
    /// Cut the motion, now, without braking.
    Halt,
    /// Pause, resume, finish early, abort or answer a prompt, where the run allows it.
    RunControl(RunControl),
    /// After a stop: leave the tissue.
    Retract,
    /// After a stop: end the session where the probe stands.
    CloseSession,
    /// Connect the rig anew after its link was lost; nothing moves.
    Reconnect,
    /// List the serial ports again.
    ListPorts,
    /// Choose a folder or a file in a dialog of its own.
    Choose(PathPurpose),
    /// Show the protocols, the expected course or what was measured.
    View(RunPane),
    /// Take a built-in protocol into the form.
    TakeProtocol(&'static str),
    /// Read the protocol file whose path is typed.
    OpenProtocol,
    /// Write down in the run in progress what stands in the field for notes; a mark if nothing does.
    NoteTyped,
    /// Move by hand: a short run beside the protocol in the form.
    ManualMove(ManualMove),
    /// Take the protocol that calibrates the load cell.
    MeasureCalibration,
    /// Store the calibration that the last run measured.
    KeepCalibration,
    /// Begin the work of the screen shown: compare models, measure, test.
    Work,
    /// End the work of the screen shown.
    CancelWork,
    /// Start the haptic loop on the body and device that were checked.
    LoopStart,
    /// Stop the haptic loop.
    LoopStop,
    /// Start the scene.
    SceneStart,
    /// Stop the scene.
    SceneStop,
    /// Read the scene file whose path is typed; the built-in scene where none is.
    OpenScene,
    /// Show where the curves of a scene are measured.
    MeasureScene,
    /// Change between the light and the dark theme.
    SwitchTheme,
    /// Look at sessions on the review screen, instead of those there.
    Review(Vec<PathBuf>),
    /// Make text and everything else larger or smaller.
    TextSize(TextSize),
    /// Make a panel larger, or smaller.
    Resize {
        /// Which.
        edge: PanelEdge,
        /// Whether larger.
        is_larger: bool,
    },
    /// Put the keyboard's focus on something.
    Focus(Id),
    /// Open or close the list of everything that can be asked for.
    Palette,
    /// Begin the tour of the window.
    TourStart,
    /// Go on with it.
    TourNext,
    /// End it.
    TourEnd,
    /// Show the screen of this name. What goes on goes on, and the stop control stays.
    Show(&'static str),
    /// Take what was chosen in a dialog, or dropped on the window.
    Chosen(PathPurpose, PathBuf),
    /// Import tables of other programs.
    Import(Vec<PathBuf>),
    /// Compute a recording of the haptic loop again.
    ReplayLoop(PathBuf),
    /// Compute a recording of a scene again.
    ReplayScene(PathBuf),
}

impl UserCommand {
    /// Whether it stops motion: nothing may come before it.
    pub const fn is_stop(&self) -> bool {
        matches!(self, Self::Stop | Self::Halt)
    }
}

/// A run beside the protocol in the form.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ManualMove {
    /// Name of the built-in protocol.
    pub protocol: &'static str,
    /// Its values, as they would be typed.
    pub values: BTreeMap<String, String>,
}

impl ManualMove {
    /// Move by a distance in mm, towards the tissue where it is positive, at a speed in mm/s.
    #[must_use]
    pub fn jog(distance: f64, speed: f64) -> Self {
        let values = [
            ("distance".to_owned(), format!("{distance} mm")),
            ("speed".to_owned(), format!("{speed} mm/s")),
        ];
        Self { protocol: "free-jog", values: values.into() }
    }

    /// Find home, and touch it once more.
    #[must_use]
    pub fn home() -> Self {
        let values =
            [("repeats".to_owned(), "1".to_owned()), ("distance".to_owned(), "1 mm".to_owned())];
        Self { protocol: "check-home", values: values.into() }
    }
}

/// How the size of text changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextSize {
    /// By a tenth.
    Larger,
    /// By a tenth.
    Smaller,
    /// As it is made.
    Usual,
}

/// What was asked for since the app last acted.
#[derive(Debug, Default)]
pub struct CommandQueue(Vec<UserCommand>);

impl CommandQueue {
    /// Asks for something.
    pub fn push(&mut self, command: UserCommand) {
        self.0.push(command);
    }

    /// Everything asked for, a halt and then a stop before all else; leaves nothing behind.
    pub fn take(&mut self) -> Vec<UserCommand> {
        let mut commands = std::mem::take(&mut self.0);
        commands.sort_by_key(|command| match command {
            UserCommand::Halt => 0,
            UserCommand::Stop => 1,
            _ => 2,
        });
        commands
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_overtakes_what_was_asked_before() {
        let mut commands = CommandQueue::default();
        for command in
            [UserCommand::Start, UserCommand::ListPorts, UserCommand::Stop, UserCommand::Halt]
        {
            commands.push(command);
        }
        assert_eq!(
            commands.take(),
            [UserCommand::Halt, UserCommand::Stop, UserCommand::Start, UserCommand::ListPorts]
        );
        assert!(commands.take().is_empty());
    }
}
