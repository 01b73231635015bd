//! A comparison of models, drawn.

use crate::plots::log_scatter::{Mark, Scatter, log_scatter_ui};
use crate::theme::Tokens;
use crate::widgets::fact_row::{fact_ui, section_ui};
use crate::widgets::table::{Column, Row, RowLook, table_ui};
use crate::workers::select::Selected;
use eframe::egui::{Label, RichText, Ui, vec2};
use palpate_model::select::{Candidate, Selection, Step};

/// Share of the height that the plot gets.
const PLOT_SHARE: f32 = 0.46;

const COLUMNS: [Column; 9] = [
    Column::words("family", 96.0),
    Column::numbers("numbers", 58.0),
    Column::numbers("rms (mN)", 76.0),
    Column::numbers("worst (mN)", 78.0),
    Column::numbers("predicted (mN)", 96.0),
    Column::numbers("BIC above", 76.0),
    Column::numbers("AICc above", 78.0),
    Column::numbers("operations", 76.0),
    Column::words("within", 64.0),
];

/// The error that decides: of prediction where something was held out.
fn error(selection: &Selection, one: &Candidate) -> Option<f64> {
    if selection.is_predicted {
        one.prediction.as_ref().map(|prediction| prediction.rms_n)
    } else {
        Some(one.rms_n)
    }
}

/// Draws every family over its cost, and the table beneath.
pub(super) fn families_ui(ui: &mut Ui, selection: &Selection) {
    let title = if selection.is_predicted {
        "Error of prediction over cost"
    } else {
        "Error of the fit over cost"
    };
    ui.label(RichText::new(title).heading().strong());
    let drawn: Vec<(&Candidate, f64)> = selection
        .candidates
        .iter()
        .filter_map(|one| Some((one, error(selection, one)?)))
        .collect();
    let marks: Vec<Mark> = drawn
        .iter()
        .map(|(one, error)| Mark {
            at: [one.cost.operations as f64, 1e3 * error],
            name: format!(
                "{}\n{:.3} mN\n{} operations",
                one.family,
                1e3 * error,
                one.cost.operations
            ),
        })
        .collect();
    let chosen = selection.verdict.family.as_ref();
    let scatter = Scatter {
        axes: ["operations an evaluation", "error, rms (mN)"],
        marks: &marks,
        front: &front(&marks),
        chosen: drawn
            .iter()
            .position(|(one, _)| Some(&one.family) == chosen),
        level: selection.tolerance_n.map(|tolerance| 1e3 * tolerance),
    };
    let height = ui.available_height() * PLOT_SHARE;
    ui.allocate_ui(vec2(ui.available_width(), height), |ui| {
        log_scatter_ui(ui, "families", &scatter);
    });
    ui.add_space(4.0);
    ui.label(RichText::new("Families").heading().strong());
    let mut rows: Vec<Row> = selection
        .candidates
        .iter()
        .map(|one| row(selection, one))
        .collect();
    rows.extend(selection.refused.iter().map(|one| Row {
        cells: vec![one.family.clone(), "refused".into()],
        look: RowLook::Quiet,
        hint: Some(one.reason.clone()),
    }));
    table_ui(ui, "families_table", &COLUMNS, &rows);
}

/// Points that no other undercuts in both, by cost.
fn front(marks: &[Mark]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..marks.len()).collect();
    order.sort_by(|&a, &b| {
        let ([ax, ay], [bx, by]) = (marks[a].at, marks[b].at);
        ax.total_cmp(&bx).then(ay.total_cmp(&by))
    });
    let mut least = f64::INFINITY;
    order.retain(|&index| {
        let is_lower = marks[index].at[1] < least;
        least = least.min(marks[index].at[1]);
        is_lower
    });
    order
}

fn row(selection: &Selection, one: &Candidate) -> Row {
    let mn = |value: f64| format!("{:.2}", 1e3 * value);
    let dash = || "-".to_owned();
    let hint: Vec<String> = std::iter::once(one.name.clone())
        .chain(one.warnings.iter().cloned())
        .chain(one.prediction_refused.clone())
        .collect();
    Row {
        cells: vec![
            one.family.clone(),
            one.free.to_string(),
            mn(one.rms_n),
            mn(one.worst_n),
            one.prediction
                .as_ref()
                .map_or_else(dash, |known| mn(known.rms_n)),
            format!("{:.1}", one.bic_above),
            one.aicc_above
                .map_or_else(dash, |above| format!("{above:.1}")),
            one.cost.operations.to_string(),
            match one.is_within {
                Some(true) => "yes".into(),
                Some(false) => "no".into(),
                None => dash(),
            },
        ],
        look: match (&selection.verdict.family, one.is_within) {
            (Some(chosen), _) if *chosen == one.family => RowLook::Marked,
            (_, Some(false)) => RowLook::Quiet,
            _ => RowLook::Plain,
        },
        hint: Some(hint.join("\n")),
    }
}

/// Draws the choice in words, what each term buys, and the recordings.
pub(super) fn choice_ui(ui: &mut Ui, selected: &Selected) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let selection = &selected.selection;
    section_ui(ui, "Choice");
    for (index, sentence) in selection.verdict.sentences.iter().enumerate() {
        let mut text = RichText::new(sentence);
        if index == 0 {
            text = text.strong();
        }
        ui.add(Label::new(text).wrap());
        ui.add_space(4.0);
    }
    if let Some(chosen) = &selection.verdict.family
        && let Some(one) = selection
            .candidates
            .iter()
            .find(|one| one.family == *chosen)
        && let Ok(parameters) = one.model.parameters()
    {
        section_ui(ui, "Parameters");
        for parameter in parameters {
            let value = format!("{:.5} {}", parameter.value, parameter.unit);
            fact_ui(ui, &parameter.name, value.trim().to_owned());
        }
    }
    section_ui(ui, "What each term buys");
    if selection.steps.is_empty() {
        ui.label(RichText::new("no two families of one kind").color(tokens.text_quiet));
    }
    for step in &selection.steps {
        ui.add(Label::new(RichText::new(step_text(step)).small()).wrap());
    }
    section_ui(ui, "Recordings");
    for record in &selection.records {
        let text = format!(
            "{}: {} samples, {:.2} mm at {:.3} mm/s, peak {:.3} N",
            record.record, record.samples, record.depth_mm, record.speed_mm_per_s, record.peak_n
        );
        ui.add(Label::new(RichText::new(text).small()).wrap());
    }
    let counts = format!(
        "{} samples worth {:.0} independent ones",
        selection.samples, selection.effective_samples
    );
    ui.label(RichText::new(counts).color(tokens.text_quiet).small());
    for note in &selected.notes {
        ui.add(Label::new(RichText::new(note).color(tokens.text_quiet).small()).wrap());
    }
}

/// One extra term: what is added, what it buys, what it costs.
fn step_text(step: &Step) -> String {
    let [before, after] = step.prediction_rms_n.unwrap_or(step.rms_n);
    let what = if step.prediction_rms_n.is_some() {
        "prediction"
    } else {
        "fit"
    };
    format!(
        "{} to {}, {}: {what} {:.2} to {:.2} mN, BIC {:+.1}, {} to {} operations",
        step.from,
        step.to,
        step.adds,
        1e3 * before,
        1e3 * after,
        step.bic_change,
        step.cost[0].operations,
        step.cost[1].operations
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_holds_what_nothing_undercuts() {
        let mark = |x: f64, y: f64| Mark {
            at: [x, y],
            name: String::new(),
        };
        let marks = [
            mark(4.0, 1.0),
            mark(1.0, 9.0),
            mark(2.0, 9.5),
            mark(3.0, 2.0),
            mark(4.0, 0.5),
        ];
        assert_eq!(front(&marks), [1, 3, 4]);
    }
}
