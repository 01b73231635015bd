//! The parameters of every session's fit in one table, with their intervals.

use super::ReviewScreen;
use super::middle::head_ui;
use super::subject::ReviewSubject;
use crate::widgets::{Column, TableRow, alarm_ui, quiet_ui, table_ui};
use eframe::egui::Ui;
use palpate_analysis::report::text;

/// The sessions, those of one specimen together, in the order in which they stand.
fn by_specimen(subjects: &[ReviewSubject]) -> Vec<(&ReviewSubject, String)> {
    let specimen = |subject: &ReviewSubject| {
        let head = subject.recording.head.as_ref();
        head.map_or(String::new(), |head| head.manifest.specimen.trim().to_owned())
    };
    let mut all: Vec<(&ReviewSubject, String)> =
        subjects.iter().map(|one| (one, specimen(one))).collect();
    all.sort_by(|a, b| a.1.cmp(&b.1));
    all
}

impl ReviewScreen {
    pub(super) fn parameters_ui(&self, ui: &mut Ui) {
        let words = "value with its statistical and its total 95 % interval from each session's fit; sessions of one specimen are grouped";
        head_ui(ui, "Parameters", words);
        let sorted = by_specimen(&self.subjects);
        let first = sorted.iter().find_map(|(subject, _)| subject.fitted());
        let Some(first) = first else {
            quiet_ui(
                ui,
                "none of the sessions shown is fitted yet; press 'Fit the sessions shown'",
            );
            refusals_ui(ui, &self.subjects);
            return;
        };
        let mut columns = vec![Column::words("specimen", 90.0), Column::words("session", 270.0)];
        for parameter in &first.report.parameters {
            columns.push(Column::numbers(&text::parameter_head(parameter), 310.0));
        }
        columns.push(Column::numbers("rmse (mN)", 80.0));
        let rows: Vec<TableRow> = sorted
            .iter()
            .filter_map(|(subject, specimen)| {
                let report = &subject.fitted()?.report;
                let mut cells = vec![specimen.clone(), subject.name.clone()];
                let names = first.report.parameters.iter().map(|one| &one.name);
                let found = names.map(|name| report.parameter(name));
                cells.extend(found.map(|one| one.map_or(String::new(), text::cell)));
                cells.push(format!("{:.3}", report.rmse_n * 1e3));
                Some(TableRow { cells, ..TableRow::default() })
            })
            .collect();
        refusals_ui(ui, &self.subjects);
        table_ui(ui, "review_parameters", &columns, &rows);
    }
}

fn refusals_ui(ui: &mut Ui, subjects: &[ReviewSubject]) {
    for subject in subjects {
        if let Some(Err(reason)) = &subject.fit {
            alarm_ui(ui, format!("{}: no fit: {reason}", subject.name));
        }
    }
}
