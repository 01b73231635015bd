//! The desktop's own dialogs for folders and files, each on its own thread: they block whoever opens them.

use super::Job;
use crate::widgets::{alarm_ui, quiet_ui};
use eframe::egui::{Button, Context, Ui};
use palpate_runner::Stopwatch;
use rfd::FileDialog;
use std::path::PathBuf;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathPurpose {
    /// Where new sessions go.
    NewSessions,
    /// A recorded session to compare models on.
    Session,
    /// A table to compare models on.
    Table,
    /// A protocol to run.
    Protocol,
    /// A recorded session to feel.
    Body,
    /// A recorded session whose modulus is wanted.
    Press,
    /// A folder of the sessions of a study.
    Study,
    /// A scene file.
    Scene,
    /// A recorded session to look at.
    Opened,
    /// A rig file to connect.
    Rig,
    /// A remote queue to arm.
    RemoteQueue,
    /// A table of specimens for the queue.
    Specimens,
}

/// A person needs more time than this to cancel a dialog, in s.
const SEEN_S: f64 = 0.4;
const NO_DIALOG: &str = "this desktop shows no file dialog (it needs xdg-desktop-portal or zenity); type the path into the field instead, or drop the file on the window";

/// Why a dialog gave nothing after so many seconds, where it may not have been shown at all: only a desktop of X11 or
/// Wayland can lack it. Windows and macOS always show it, and a quick Escape cancelled it.
fn unseen_reason(seconds: f64, can_lack_dialogs: bool) -> Option<String> {
    (can_lack_dialogs && seconds < SEEN_S).then(|| NO_DIALOG.to_owned())
}

/// A dialog that may be open, and gives a `T`.
#[derive(Debug)]
pub struct Dialog<T> {
    job: Job<Option<T>>,
    opened: Option<Stopwatch>,
    refusal: Option<String>,
}

impl<T> Default for Dialog<T> {
    fn default() -> Self {
        Self { job: Job::default(), opened: None, refusal: None }
    }
}

impl<T: Send + 'static> Dialog<T> {
    /// Whether the dialog is open.
    pub fn is_open(&self) -> bool {
        self.job.is_busy()
    }

    /// Opens the dialog, unless it is open.
    pub fn open(
        &mut self,
        ctx: &Context,
        pick: impl FnOnce(FileDialog) -> Option<T> + Send + 'static,
    ) -> Result<(), String> {
        self.refusal = None;
        self.opened = Some(Stopwatch::start());
        let opened = self.job.start("dialog", ctx, move || pick(FileDialog::new()));
        opened.map_err(|err| format!("the dialog cannot be opened: {err}"))
    }

    /// What was chosen, once; `None` while the dialog is open or when it was cancelled.
    pub fn poll(&mut self) -> Option<T> {
        let answer = self.job.poll()?;
        // The library for dialogs does not say why it showed none.
        let seconds = self.opened.as_ref().map_or(f64::INFINITY, Stopwatch::seconds);
        if answer.is_none() {
            let can_lack_dialogs = !cfg!(any(target_os = "windows", target_os = "macos"));
            self.refusal = unseen_reason(seconds, can_lack_dialogs);
        }
        answer
    }

    /// Why the last dialog was not shown, once.
    pub fn take_refusal(&mut self) -> Option<String> {
        self.refusal.take()
    }

    /// Draws the button that opens the dialog.
    pub fn button_ui(
        &mut self,
        ui: &mut Ui,
        text: &str,
        pick: impl FnOnce(FileDialog) -> Option<T> + Send + 'static,
    ) {
        let is_open = self.is_open();
        if ui.add_enabled(!is_open, Button::new(text)).clicked() {
            self.refusal = self.open(ui.ctx(), pick).err();
        }
        if is_open {
            quiet_ui(ui, "the dialog is open");
        }
        if let Some(refusal) = &self.refusal {
            alarm_ui(ui, refusal);
        }
    }
}

/// Chooses what is asked for.
#[must_use]
pub fn pick(ask: PathPurpose, dialog: FileDialog) -> Option<(PathPurpose, PathBuf)> {
    let of_kind = |title: &str, kind: &str, endings: &[&str]| {
        let dialog = dialog.clone().set_title(title);
        dialog.add_filter(kind, endings).pick_file()
    };
    let path = match ask {
        PathPurpose::NewSessions => dialog.set_title("Folder for new sessions").pick_folder(),
        PathPurpose::Session | PathPurpose::Body | PathPurpose::Press | PathPurpose::Opened => {
            dialog.set_title("Folder of a session").pick_folder()
        }
        PathPurpose::Study => dialog.set_title("Folder of sessions").pick_folder(),
        PathPurpose::Specimens => of_kind("Table of specimens", "tables", &["csv", "tsv", "txt"]),
        PathPurpose::Table => of_kind("Table of a recording", "tables", &["csv", "tsv", "txt"]),
        PathPurpose::Scene => of_kind("Scene", "scenes", &["toml"]),
        PathPurpose::RemoteQueue => of_kind("Remote queue", "remote queues", &["toml"]),
        PathPurpose::Rig => of_kind("Rig file", "rig files", &["toml"]),
        PathPurpose::Protocol => of_kind("Protocol", "protocols", &["toml"]),
    };
    Some((ask, path?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_desktop_that_may_lack_dialogs_is_said_to_show_none() {
        assert!(unseen_reason(0.1, true).is_some_and(|words| words.contains("zenity")));
        assert_eq!(unseen_reason(2.0, true), None);
        assert_eq!(unseen_reason(0.1, false), None);
    }
}
