//! Sessions chosen written as tables or into a lake.

use super::edits::sentence;
use crate::widgets::choice::choice_ui;
use crate::widgets::fact_row::section_ui;
use crate::widgets::task_bar::task_ui;
use crate::widgets::text_row::text_row;
use crate::workers::path_dialog::Dialog;
use crate::workers::task::BackgroundTask;
use eframe::egui::{Context, Ui};
use palpate_analysis::exports::{Destination, Exported, export_all};
use palpate_tables::export::Format;
use std::path::PathBuf;

palpate_model::named! {
    /// What sessions are written as.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    enum Kind {
        #[default]
        Csv = "CSV, a file each",
        Parquet = "Parquet, a file each",
        Arrow = "Arrow, a file each",
        Lake = "one data set (lake)",
    }
}

impl Kind {
    fn destination(self, to: PathBuf) -> Destination {
        match self {
            Self::Csv => Destination::Tables(Format::Csv(b','), to),
            Self::Parquet => Destination::Tables(Format::Parquet, to),
            Self::Arrow => Destination::Tables(Format::Arrow, to),
            Self::Lake => Destination::Lake(to),
        }
    }
}

/// The panel.
#[derive(Default)]
pub(super) struct FilesPanel {
    kind: Kind,
    to: String,
    dialog: Dialog<PathBuf>,
    task: BackgroundTask<Exported>,
}

impl FilesPanel {
    /// Fetches answers that have come.
    pub fn poll(&mut self) {
        self.task.poll();
        if let Some(folder) = self.dialog.poll() {
            self.to = folder.display().to_string();
        }
    }

    fn verdict(&self, chosen: usize) -> Result<(), String> {
        if chosen == 0 {
            return Err("choose sessions first".into());
        }
        match self.to.trim() {
            "" => Err("write the folder that they go to first".into()),
            _ => Ok(()),
        }
    }

    /// Draws the form; `sessions` are the folders of those chosen.
    pub fn ui(&mut self, ui: &mut Ui, sessions: &[PathBuf]) {
        let ctx: Context = ui.ctx().clone();
        section_ui(ui, "Export the sessions chosen");
        let kinds = Kind::ALL.map(|kind| (kind, kind.name()));
        choice_ui(ui, "as", &mut self.kind, &kinds);
        text_row(ui, "to folder", "made if there is none", &mut self.to);
        self.dialog.button_ui(ui, "Choose folder...", |dialog| {
            dialog.set_title("Folder for exports").pick_folder()
        });
        let verdict = self.verdict(sessions.len());
        if task_ui(ui, "Export", &self.task, &verdict) {
            let to = self.kind.destination(PathBuf::from(self.to.trim()));
            let sessions = sessions.to_vec();
            self.task
                .start("export", &ctx, move |progress| Ok(export_all(sessions, &to, progress)));
        }
        if self.task.state().is_none() {
            match self.task.answer() {
                Some(Ok(done)) => {
                    sentence(ui, &done.sentence, false);
                    remarks_ui(ui, &done.remarks);
                }
                Some(Err(err)) => sentence(ui, err, true),
                None => {}
            }
        }
    }
}

/// Remarks that are read here at most; the rest is counted.
const REMARKS: usize = 20;

fn remarks_ui(ui: &mut Ui, remarks: &[String]) {
    remarks.iter().take(REMARKS).for_each(|remark| sentence(ui, remark, true));
    if remarks.len() > REMARKS {
        let text = format!("and {} more remarks", remarks.len() - REMARKS);
        sentence(ui, &text, true);
    }
}
