//! Export of the sessions chosen as tables or into a lake.

use crate::widgets::{choice_ui, quiet_ui, require, section_ui, small_alarm_ui, task_ui, text_row};
use crate::workers::{BackgroundTask, Dialog};
use eframe::egui::Ui;
use palpate_analysis::exports::{ExportDestination, ExportSummary, export_all};
use palpate_tables::export::TableFormat;
use std::path::PathBuf;

palpate_model::named! {
    /// Format of an export.
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
    fn destination(self, to: PathBuf) -> ExportDestination {
        match self {
            Self::Csv => ExportDestination::Tables(TableFormat::Csv(b','), to),
            Self::Parquet => ExportDestination::Tables(TableFormat::Parquet, to),
            Self::Arrow => ExportDestination::Tables(TableFormat::Arrow, to),
            Self::Lake => ExportDestination::Lake(to),
        }
    }
}

#[derive(Default)]
pub(super) struct FilesPanel {
    kind: Kind,
    to: String,
    dialog: Dialog<PathBuf>,
    task: BackgroundTask<ExportSummary>,
}

impl FilesPanel {
    pub fn poll(&mut self) {
        self.task.poll();
        if let Some(folder) = self.dialog.poll() {
            self.to = folder.display().to_string();
        }
    }

    fn verdict(&self, chosen: usize) -> Result<(), String> {
        require(chosen > 0, "choose sessions first")?;
        require(!self.to.trim().is_empty(), "type the folder of the export first")
    }

    /// Draws the form; `sessions` are the folders of those chosen.
    pub fn ui(&mut self, ui: &mut Ui, sessions: &[PathBuf]) {
        section_ui(ui, "Export chosen sessions");
        let kinds = Kind::ALL.map(|kind| (kind, kind.name()));
        choice_ui(ui, "as", &mut self.kind, &kinds);
        text_row(ui, "to folder", "a folder; created if missing", &mut self.to);
        self.dialog.button_ui(ui, "Choose folder...", |dialog| {
            dialog.set_title("Folder for exports").pick_folder()
        });
        let verdict = self.verdict(sessions.len());
        if task_ui(ui, "Export", &self.task, &verdict) {
            let to = self.kind.destination(PathBuf::from(self.to.trim()));
            let sessions = sessions.to_vec();
            self.task
                .start("export", ui.ctx(), move |progress| Ok(export_all(sessions, &to, progress)));
        }
        match self.task.answer().filter(|_| !self.task.is_busy()) {
            Some(Ok(done)) => {
                quiet_ui(ui, &done.sentence);
                remarks_ui(ui, &done.remarks);
            }
            Some(Err(err)) => small_alarm_ui(ui, err),
            None => {}
        }
    }
}

/// Remarks shown; the others are counted.
const REMARKS: usize = 20;

fn remarks_ui(ui: &mut Ui, remarks: &[String]) {
    remarks.iter().take(REMARKS).for_each(|remark| small_alarm_ui(ui, remark));
    if remarks.len() > REMARKS {
        small_alarm_ui(ui, format!("and {} more remarks", remarks.len() - REMARKS));
    }
}
