//! A comparison of models, drawn.

use crate::plots::log_scatter::{Mark, Scatter, log_scatter_ui};
use crate::report::selection;
use crate::theme::Tokens;
use crate::widgets::fact_row::{fact_ui, section_ui};
use crate::widgets::table::{Column, Row, RowLook, table_ui};
use crate::workers::select::Selected;
use eframe::egui::{Label, RichText, Ui, vec2};
use palpate_model::select::{Candidate, Selection};

/// Share of the height that the plot gets.
const PLOT_SHARE: f32 = 0.46;

/// Widths of the columns of [`selection::table`] by their heads, in points.
const WIDTHS: [(&str, f32); 4] = [
    ("family", 100.0),
    ("predicted mN", 110.0),
    ("free", 40.0),
    ("within", 50.0),
];
/// Width of the others.
const WIDTH: f32 = 72.0;

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
    let mut table = selection::table(selection).into_iter();
    let heads = table.next().unwrap_or_default();
    let columns: Vec<Column> = heads.into_iter().map(column).collect();
    let mut rows: Vec<Row> = selection
        .candidates
        .iter()
        .zip(table)
        .map(|(one, cells)| Row {
            cells,
            look: look(selection, one),
            hint: Some(hint(one)),
        })
        .collect();
    rows.extend(selection.refused.iter().map(|one| Row {
        cells: vec![one.family.clone(), "refused".into()],
        look: RowLook::Quiet,
        hint: Some(one.reason.clone()),
    }));
    table_ui(ui, "families_table", &columns, &rows);
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

fn column(head: String) -> Column {
    let width = WIDTHS.iter().find(|(known, _)| *known == head);
    Column {
        is_number: head != "family" && head != "within",
        width: width.map_or(WIDTH, |(_, width)| *width),
        head,
    }
}

fn look(selection: &Selection, one: &Candidate) -> RowLook {
    match (&selection.verdict.family, one.is_within) {
        (Some(chosen), _) if *chosen == one.family => RowLook::Marked,
        (_, Some(false)) => RowLook::Quiet,
        _ => RowLook::Plain,
    }
}

/// The family in words and what to know of its fit.
fn hint(one: &Candidate) -> String {
    let lines = std::iter::once(&one.name)
        .chain(&one.warnings)
        .chain(&one.prediction_refused);
    lines.cloned().collect::<Vec<_>>().join("\n")
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
    let ladder = selection::ladder(selection);
    let steps = ladder.get(1..).unwrap_or_default();
    if steps.is_empty() {
        ui.label(RichText::new("no two families of one kind").color(tokens.text_quiet));
    }
    for step in steps {
        let line = |words: RichText| Label::new(words.small()).wrap();
        ui.add(line(RichText::new(format!("{}: {}", step[0], step[1]))));
        let numbers = ladder[0].iter().zip(step).skip(2);
        let numbers: Vec<String> = numbers
            .map(|(head, cell)| format!("{head} {cell}"))
            .collect();
        ui.add(line(
            RichText::new(numbers.join(", ")).color(tokens.text_quiet),
        ));
    }
    section_ui(ui, "Recordings");
    for text in [selection::records(selection), selection::tested(selection)] {
        ui.add(Label::new(RichText::new(text).small()).wrap());
    }
    for note in &selected.notes {
        ui.add(Label::new(RichText::new(note).color(tokens.text_quiet).small()).wrap());
    }
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
