//! Report and figure of the session in front, as new files.

use super::super::ReviewSource;
use crate::widgets::{
    alarm_ui, choice_ui, quiet_ui, require, section_ui, task_ui, text_row, tick_box,
};
use crate::workers::{BackgroundTask, Dialog};
use eframe::egui::Ui;
use palpate_analysis::report::dossier::{SessionFigure, SessionReading, folder_name};
use palpate_analysis::report::figures::TimeWindow;
use palpate_analysis::session_actions::{ActionReport, SessionDocument, write_document};
use std::path::PathBuf;

/// A file to be written: its path and the work.
#[derive(Default)]
struct NewFile {
    path: String,
    dialog: Dialog<PathBuf>,
    work: BackgroundTask<ActionReport>,
}

impl NewFile {
    fn poll(&mut self) {
        self.work.poll();
        if let Some(path) = self.dialog.poll() {
            self.path = path.display().to_string();
        }
    }

    /// Draws the field of the path and the button of its dialog.
    fn path_ui(
        &mut self,
        ui: &mut Ui,
        name: &'static str,
        ending: &'static str,
        hint: &str,
        source: &ReviewSource,
    ) {
        text_row(ui, &format!("{} file", name.to_lowercase()), hint, &mut self.path);
        let file = format!("{}.{ending}", folder_name(&source.session));
        self.dialog.button_ui(ui, &format!("{name}..."), move |dialog| {
            let dialog = dialog.set_title(name).set_file_name(file);
            dialog.add_filter(ending, &[ending]).save_file()
        });
    }

    /// Draws the button that writes the file, and the last answer.
    fn write_ui(
        &mut self,
        ui: &mut Ui,
        text: &str,
        endings: &[&str],
        make: impl FnOnce() -> SessionDocument,
    ) {
        if task_ui(ui, text, &self.work, &path_verdict(&self.path, endings)) {
            let (document, to) = (make(), PathBuf::from(self.path.trim()));
            self.work.start("report", ui.ctx(), move |progress| {
                write_document(&document, &to, progress)
            });
        }
        done_ui(ui, &self.work);
    }
}

#[derive(Default)]
pub(super) struct ReportPanel {
    report: NewFile,
    is_of_all: bool,
    figure: NewFile,
    of: SessionFigure,
    /// The stretch between the cursors in s, the earlier first.
    pub span: Option<[f64; 2]>,
    /// The figure shows that stretch alone.
    is_of_span: bool,
}

impl ReportPanel {
    /// Fetches the answers of dialogs and work.
    pub fn poll(&mut self) {
        self.report.poll();
        self.figure.poll();
    }

    pub fn ui(&mut self, ui: &mut Ui, source: &ReviewSource, shown: &[ReviewSource]) {
        section_ui(ui, "Report");
        self.report.path_ui(ui, "Report", "html", "a new .html file", source);
        if shown.len() > 1 {
            tick_box(ui, &mut self.is_of_all, &format!("of all {} shown", shown.len()));
        }
        let all = if self.is_of_all { shown } else { std::slice::from_ref(source) };
        let page = || SessionDocument::Page(all.iter().map(report_source).collect());
        self.report.write_ui(ui, "Write report", &["html", "htm"], page);

        section_ui(ui, "Figure");
        let figures = SessionFigure::ALL.map(|one| (one, one.name()));
        choice_ui(ui, "of", &mut self.of, &figures);
        self.figure.path_ui(ui, "Figure", "svg", "a new .svg or .png file", source);
        let is_over_samples =
            matches!(self.of, SessionFigure::ForceTime | SessionFigure::ForceDepth);
        let span = self.span.filter(|_| is_over_samples);
        if let Some([from, until]) = span {
            let words = format!("only {from:.3} to {until:.3} s");
            tick_box(ui, &mut self.is_of_span, &words);
        }
        let span = span.filter(|_| self.is_of_span);
        let window = span.map_or(TimeWindow::WHOLE, |[from, until]| TimeWindow { from, until });
        let figure = || SessionDocument::Figure(report_source(source), self.of, window);
        self.figure.write_ui(ui, "Write figure", &["svg", "png"], figure);
    }
}

/// Whether a path has the ending of such a file. An existing file is refused when it is written.
fn path_verdict(path: &str, endings: &[&str]) -> Result<(), String> {
    let path = path.trim();
    let is_known = |ending: &&str| {
        let ending = format!(".{ending}");
        path.len() > ending.len() && path.to_ascii_lowercase().ends_with(&ending)
    };
    require(!path.is_empty(), "type the name of a new file, or choose one")?;
    let words = format!("the file name must end in .{}", endings.join(" or ."));
    require(endings.iter().any(is_known), words)
}

/// A session as reports and fits take it.
pub(super) fn report_source(one: &ReviewSource) -> SessionReading {
    SessionReading { session: one.session.clone(), analysis: one.analysis.clone() }
}

/// The last answer of work that has ended.
pub(super) fn done_ui(ui: &mut Ui, task: &BackgroundTask<ActionReport>) {
    match task.answer().filter(|_| !task.is_busy()) {
        None => {}
        Some(Ok(done)) => quiet_ui(ui, &done.sentence),
        Some(Err(reason)) => alarm_ui(ui, reason),
    }
}
