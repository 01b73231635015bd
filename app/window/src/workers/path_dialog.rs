//! The desktop's own dialog for folders and files, on its own thread: it blocks whoever opens it.

use super::Job;
use eframe::egui::Context;
use std::path::PathBuf;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ask {
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
    /// A scene file.
    Scene,
}

/// A dialog that may be open.
#[derive(Debug, Default)]
pub struct PathDialog(Job<Option<(Ask, PathBuf)>>);

impl PathDialog {
    /// Whether the dialog is open.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.0.is_busy()
    }

    /// Opens the dialog, unless one is open.
    pub fn open(&mut self, ask: Ask, ctx: &Context) -> std::io::Result<()> {
        let ctx = ctx.clone();
        let dialog = rfd::FileDialog::new();
        let pick = move || match ask {
            Ask::NewSessions => dialog.set_title("Folder for new sessions").pick_folder(),
            Ask::Session | Ask::Body => dialog.set_title("Folder of a session").pick_folder(),
            Ask::Table => dialog
                .set_title("Table of a recording")
                .add_filter("tables", &["csv", "tsv", "txt"])
                .pick_file(),
            Ask::Scene => dialog
                .set_title("Scene")
                .add_filter("scenes", &["toml"])
                .pick_file(),
            Ask::Protocol => dialog
                .set_title("Protocol")
                .add_filter("protocols", &["toml"])
                .pick_file(),
        };
        self.0.start(
            "path-dialog",
            move || pick().map(|path| (ask, path)),
            move || ctx.request_repaint(),
        )
    }

    /// What was chosen, once; `None` while the dialog is open or when it was cancelled.
    pub fn poll(&mut self) -> Option<(Ask, PathBuf)> {
        self.0.poll().flatten()
    }
}

/// The dialog for a folder, which may be open.
#[derive(Debug, Default)]
pub struct FolderDialog(Job<Option<PathBuf>>);

impl FolderDialog {
    /// Whether the dialog is open.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.0.is_busy()
    }

    /// Opens the dialog with this head, unless it is open.
    pub fn open(&mut self, title: &'static str, ctx: &Context) -> std::io::Result<()> {
        let ctx = ctx.clone();
        let pick = move || rfd::FileDialog::new().set_title(title).pick_folder();
        self.0
            .start("folder-dialog", pick, move || ctx.request_repaint())
    }

    /// What was chosen, once; `None` while the dialog is open or when it was cancelled.
    pub fn poll(&mut self) -> Option<PathBuf> {
        self.0.poll().flatten()
    }
}

/// The dialog for files to read, which may be open.
#[derive(Debug, Default)]
pub struct FilesDialog(Job<Option<Vec<PathBuf>>>);

impl FilesDialog {
    /// Whether the dialog is open.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.0.is_busy()
    }

    /// Opens the dialog with this head, unless it is open.
    pub fn open(&mut self, title: &'static str, ctx: &Context) -> std::io::Result<()> {
        let ctx = ctx.clone();
        let pick = move || rfd::FileDialog::new().set_title(title).pick_files();
        self.0
            .start("files-dialog", pick, move || ctx.request_repaint())
    }

    /// What was chosen, once; `None` while the dialog is open or when it was cancelled.
    pub fn poll(&mut self) -> Option<Vec<PathBuf>> {
        self.0.poll().flatten()
    }
}

/// What a file is written as.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SaveAs {
    /// Head of the dialog.
    pub title: &'static str,
    /// Name that stands there.
    pub name: String,
    /// Ending without its dot.
    pub ending: &'static str,
}

/// The dialog for a file to write, which may be open.
#[derive(Debug, Default)]
pub struct SaveDialog(Job<Option<PathBuf>>);

impl SaveDialog {
    /// Whether the dialog is open.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.0.is_busy()
    }

    /// Opens the dialog, unless it is open.
    pub fn open(&mut self, wanted: SaveAs, ctx: &Context) -> std::io::Result<()> {
        let ctx = ctx.clone();
        let pick = move || {
            rfd::FileDialog::new()
                .set_title(wanted.title)
                .set_file_name(wanted.name)
                .add_filter(wanted.ending, &[wanted.ending])
                .save_file()
        };
        self.0
            .start("save-dialog", pick, move || ctx.request_repaint())
    }

    /// What was chosen, once; `None` while the dialog is open or when it was cancelled.
    pub fn poll(&mut self) -> Option<PathBuf> {
        self.0.poll().flatten()
    }
}
