//! Files of other programs made into sessions of the library.

use super::edits::sentence;
use crate::widgets::fact_row::section_ui;
use crate::widgets::task_bar::progress_ui;
use crate::widgets::text_row::text_row;
use crate::workers::path_dialog::Dialog;
use crate::workers::task::BackgroundTask;
use eframe::egui::{Button, Context, Label, RichText, Ui, vec2};
use palpate_analysis::imports::{Request, import_and_tell};
use palpate_model::about::Labels;
use std::path::{Path, PathBuf};

/// What parts the paths of several files.
const BETWEEN: char = ';';

/// The panel.
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
    /// Fetches answers that have come; true when sessions were made.
    pub fn poll(&mut self) -> bool {
        if let Some(files) = self.dialog.poll() {
            self.add(&files);
        }
        let was_busy = self.task.state().is_some();
        self.task.poll();
        let has_ended = was_busy && self.task.state().is_none();
        has_ended && !self.was_dry_run
    }

    /// Adds files to those named.
    pub fn add(&mut self, files: &[PathBuf]) {
        for file in files {
            if !self.files.trim().is_empty() {
                self.files.push(BETWEEN);
                self.files.push(' ');
            }
            self.files += &file.display().to_string();
        }
    }

    fn paths(&self) -> Vec<PathBuf> {
        let paths = self.files.split(BETWEEN).map(str::trim);
        paths.filter(|path| !path.is_empty()).map(PathBuf::from).collect()
    }

    fn verdict(&self) -> Result<(), String> {
        if self.task.state().is_some() {
            return Err("files are being read".into());
        }
        match self.paths().is_empty() {
            true => Err("name a file first".into()),
            false => Ok(()),
        }
    }

    fn start(&mut self, ctx: &Context, library: &Path, is_dry_run: bool) {
        let request = Request {
            files: self.paths(),
            labels: Labels {
                specimen: self.specimen.trim().to_owned(),
                operator: self.operator.trim().to_owned(),
                ..Labels::default()
            },
            library: Some(library.to_owned()),
            is_dry_run,
            ..Request::default()
        };
        self.was_dry_run = is_dry_run;
        self.task.start("import", ctx, move |progress| import_and_tell(&request, progress));
    }

    /// Draws the form; sessions go to this library.
    pub fn ui(&mut self, ui: &mut Ui, library: &Path) {
        let ctx = ui.ctx().clone();
        section_ui(ui, "Import files of other programs");
        text_row(ui, "files", "paths, ; between them", &mut self.files);
        self.dialog.button_ui(ui, "Choose files...", |dialog| {
            dialog.set_title("Files to import").pick_files()
        });
        text_row(ui, "of what", "specimen", &mut self.specimen);
        text_row(ui, "who", "who measured", &mut self.operator);
        let verdict = self.verdict();
        let size = vec2(96.0, 26.0);
        let pressed = |ui: &mut Ui, text: &str| {
            let button = Button::new(text).min_size(size);
            ui.add_enabled(verdict.is_ok(), button).clicked()
        };
        let mut wanted = None;
        ui.horizontal(|ui| {
            if pressed(ui, "See how it reads") {
                wanted = Some(true);
            }
            if pressed(ui, "Import") {
                wanted = Some(false);
            }
        });
        if let Err(reason) = &verdict {
            sentence(ui, reason, false);
        }
        if let Some(is_dry_run) = wanted {
            self.start(&ctx, library, is_dry_run);
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
            Some(Err(err)) => sentence(ui, err, true),
            None => {}
        }
    }
}
