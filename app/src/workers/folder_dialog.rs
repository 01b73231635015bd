//! The desktop's own folder dialog, on its own thread: it blocks whoever opens it.

use super::Job;
use eframe::egui::Context;
use std::path::PathBuf;

/// A folder dialog that may be open.
#[derive(Debug, Default)]
pub struct FolderDialog(Job<Option<PathBuf>>);

impl FolderDialog {
    /// Whether the dialog is open.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.0.is_busy()
    }

    /// Opens the dialog.
    pub fn open(&mut self, ctx: &Context) -> std::io::Result<()> {
        let ctx = ctx.clone();
        self.0.start(
            "folder-dialog",
            || {
                rfd::FileDialog::new()
                    .set_title("Folder for new sessions")
                    .pick_folder()
            },
            move || ctx.request_repaint(),
        )
    }

    /// The folder chosen, once; `None` while the dialog is open or when it was cancelled.
    pub fn poll(&mut self) -> Option<PathBuf> {
        self.0.poll().flatten()
    }
}
