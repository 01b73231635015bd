//! Import of files of other programs as sessions of the library.

use crate::widgets::{progress_ui, quiet_ui, require, section_ui, small_alarm_ui, text_row};
use crate::workers::{BackgroundTask, Dialog};
use eframe::egui::{Button, Context, Label, RichText, Ui, vec2};
use palpate_analysis::imports::{ImportRequest, import_with_summary};
use palpate_model::metadata::SessionLabels;
use std::path::{Path, PathBuf};

/// Between the paths of several files.
const SEPARATOR: char = ';';

#[derive(Default)]
pub(super) struct ImportPanel {
    files: String,
    specimen: String,
    operator: String,
    dialog: Dialog<Vec<PathBuf>>,
    task: BackgroundTask<Vec<String>>,
    was_dry_run: bool,
}

impl ImportPanel {
    /// Fetches answers; true when an import has ended.
    pub fn poll(&mut self) -> bool {
        if let Some(files) = self.dialog.poll() {
            self.add(&files);
        }
        self.task.poll() && !self.was_dry_run
    }

    pub fn add(&mut self, files: &[PathBuf]) {
        for file in files {
            if !self.files.trim().is_empty() {
                self.files.push(SEPARATOR);
                self.files.push(' ');
            }
            self.files += &file.display().to_string();
        }
    }

    fn paths(&self) -> Vec<PathBuf> {
        let paths = self.files.split(SEPARATOR).map(str::trim);
        paths.filter(|path| !path.is_empty()).map(PathBuf::from).collect()
    }

    fn verdict(&self) -> Result<(), String> {
        require(!self.task.is_busy(), "files are being read")?;
        require(!self.paths().is_empty(), "type or choose a file first")
    }

    fn start(&mut self, ctx: &Context, library: &Path, is_dry_run: bool) {
        let request = ImportRequest {
            files: self.paths(),
            labels: SessionLabels {
                specimen: self.specimen.trim().to_owned(),
                operator: self.operator.trim().to_owned(),
                ..SessionLabels::default()
            },
            library: Some(library.to_owned()),
            is_dry_run,
            ..ImportRequest::default()
        };
        self.was_dry_run = is_dry_run;
        self.task.start("import", ctx, move |progress| import_with_summary(&request, progress));
    }

    /// Draws the form; sessions go to this library.
    pub fn ui(&mut self, ui: &mut Ui, library: &Path) {
        let ctx = ui.ctx().clone();
        section_ui(ui, "Files of other programs");
        text_row(ui, "files", "paths, ; between them", &mut self.files);
        self.dialog.button_ui(ui, "Choose files...", |dialog| {
            dialog.set_title("Files to import").pick_files()
        });
        text_row(ui, "of what", "specimen", &mut self.specimen);
        text_row(ui, "who", "operator", &mut self.operator);
        let verdict = self.verdict();
        ui.horizontal(|ui| {
            for (text, is_dry_run) in [("Preview import", true), ("Import", false)] {
                let button = Button::new(text).min_size(vec2(96.0, 26.0));
                if ui.add_enabled(verdict.is_ok(), button).clicked() {
                    self.start(&ctx, library, is_dry_run);
                }
            }
        });
        if let Err(reason) = &verdict {
            quiet_ui(ui, reason);
        }
        if let Some(state) = self.task.state() {
            if progress_ui(ui, &state, "Cancel import") {
                self.task.cancel();
            }
            return;
        }
        match self.task.answer() {
            Some(Ok(files)) => files.iter().for_each(|text| {
                let text = RichText::new(text).monospace().small();
                ui.add(Label::new(text).wrap());
            }),
            Some(Err(err)) => small_alarm_ui(ui, err),
            None => {}
        }
    }
}
