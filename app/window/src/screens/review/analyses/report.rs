//! Report and figure of what is in front, as new files.

use super::super::Looked;
use crate::widgets::{alarm_ui, choice_ui, quiet_ui, section_ui, task_ui, text_row, tick_box};
use crate::workers::path_dialog::Dialog;
use crate::workers::task::BackgroundTask;
use eframe::egui::Ui;
use palpate_analysis::analyses::{Done, Paper, paper};
use palpate_analysis::report::dossier::{Figure, Wanted, name_of};
use palpate_analysis::report::figures::Window;
use rfd::FileDialog;
use std::path::PathBuf;

/// The field that a dialog fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Field {
    Report,
    Figure,
}

/// The form and its work.
#[derive(Default)]
pub(super) struct ReportPanel {
    report: String,
    is_of_all: bool,
    figure: String,
    of: Figure,
    /// The stretch between the cursors in s, the earlier first.
    pub span: Option<[f64; 2]>,
    /// Whether the figure shows it alone.
    is_of_span: bool,
    dialog: Dialog<PathBuf>,
    asked: Option<Field>,
    pages: BackgroundTask<Done>,
    figures: BackgroundTask<Done>,
}

impl ReportPanel {
    /// Fetches what threads have answered.
    pub fn poll(&mut self) {
        self.pages.poll();
        self.figures.poll();
        if let Some(path) = self.dialog.poll() {
            let path = path.display().to_string();
            match self.asked.take() {
                Some(Field::Report) => self.report = path,
                Some(Field::Figure) => self.figure = path,
                None => {}
            }
        }
    }

    /// Draws the form.
    pub fn ui(&mut self, ui: &mut Ui, source: &Looked, shown: &[Looked]) {
        section_ui(ui, "Report");
        text_row(ui, "report file", "a new .html file", &mut self.report);
        self.choose_ui(ui, Field::Report, source);
        if shown.len() > 1 {
            tick_box(ui, &mut self.is_of_all, &format!("of all {} shown", shown.len()));
        }
        let verdict = path_verdict(&self.report, &["html", "htm"]);
        if task_ui(ui, "Write report", &self.pages, &verdict) {
            let sessions: Vec<Wanted> = match self.is_of_all && shown.len() > 1 {
                true => shown.iter().map(report_source).collect(),
                false => vec![report_source(source)],
            };
            let to = PathBuf::from(self.report.trim());
            self.pages.start("report", ui.ctx(), move |progress| {
                paper(&Paper::Page(sessions), &to, progress)
            });
        }
        done_ui(ui, &self.pages);

        section_ui(ui, "Figure");
        let figures = Figure::ALL.map(|one| (one, one.name()));
        choice_ui(ui, "of", &mut self.of, &figures);
        text_row(ui, "figure file", "a new .svg or .png file", &mut self.figure);
        self.choose_ui(ui, Field::Figure, source);
        let is_over_samples = matches!(self.of, Figure::ForceTime | Figure::ForceDepth);
        if let Some([from, until]) = self.span.filter(|_| is_over_samples) {
            let words = format!("only {from:.3} to {until:.3} s");
            tick_box(ui, &mut self.is_of_span, &words);
        }
        let verdict = path_verdict(&self.figure, &["svg", "png"]);
        if task_ui(ui, "Write figure", &self.figures, &verdict) {
            let span = self.span.filter(|_| self.is_of_span && is_over_samples);
            let window = span.map_or(Window::WHOLE, |[from, until]| Window { from, until });
            let one = Paper::Figure(report_source(source), self.of, window);
            let to = PathBuf::from(self.figure.trim());
            self.figures.start("figure", ui.ctx(), move |progress| paper(&one, &to, progress));
        }
        done_ui(ui, &self.figures);
    }

    fn choose_ui(&mut self, ui: &mut Ui, field: Field, source: &Looked) {
        let (words, title, ending) = match field {
            Field::Report => ("Report...", "Report", "html"),
            Field::Figure => ("Figure...", "Figure", "svg"),
        };
        if ui.button(words).clicked() && !self.dialog.is_open() {
            self.asked = Some(field);
            let name = format!("{}.{ending}", name_of(&source.session));
            let pick = move |dialog: FileDialog| {
                let dialog = dialog.set_title(title).set_file_name(name);
                dialog.add_filter(ending, &[ending]).save_file()
            };
            // Without a dialog the path is typed.
            if self.dialog.open(ui.ctx(), pick).is_err() {
                self.asked = None;
            }
        }
    }
}

/// Whether a path can be that of a new file; whether it is there already is found out when it is written.
fn path_verdict(path: &str, endings: &[&str]) -> Result<(), String> {
    let path = path.trim();
    let is_known = |ending: &&str| {
        let ending = format!(".{ending}");
        path.len() > ending.len() && path.to_ascii_lowercase().ends_with(&ending)
    };
    match (path, endings.iter().any(is_known)) {
        ("", _) => Err("type the name of a new file, or choose one".to_owned()),
        (_, true) => Ok(()),
        (_, false) => Err(format!("the file name must end in .{}", endings.join(" or ."))),
    }
}

/// A session as reports and fits take it.
pub(super) fn report_source(one: &Looked) -> Wanted {
    Wanted { session: one.session.clone(), analysis: one.analysis.clone() }
}

/// The last answer of work that has ended.
pub(super) fn done_ui(ui: &mut Ui, task: &BackgroundTask<Done>) {
    match task.answer().filter(|_| !task.is_busy()) {
        None => {}
        Some(Ok(done)) => quiet_ui(ui, &done.sentence),
        Some(Err(reason)) => alarm_ui(ui, reason),
    }
}
