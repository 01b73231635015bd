//! A comparison of models, drawn.

use crate::plots::figure::{PlotLook, plot_ui};
use crate::widgets::{
    Column, Emphasis, TableRow, fact_ui, heading_ui, placeholder_ui, quiet_ui, section_ui,
    sentences_ui, small_ui, table_ui, tokens_of,
};
use eframe::egui::{Label, RichText, Ui, vec2};
use palpate_analysis::report::selection;
use palpate_analysis::report::selection_plot::plot;
use palpate_analysis::select::SelectionReport;
use palpate_figures::uncertain::plain;
use palpate_rheology::select::{ModelCandidate, ModelSelection};

/// Share of the height that the plot gets.
const PLOT_SHARE: f32 = 0.46;

/// Columns of [`selection::table`] by their heads, what decides first, with widths in points.
const COLUMNS: [(&str, f32); 11] = [
    ("family", 92.0),
    ("predicted (mN)", 108.0),
    ("operations", 74.0),
    ("within", 46.0),
    ("rms (mN)", 68.0),
    ("dBIC", 78.0),
    ("fitted values", 86.0),
    ("worst (mN)", 78.0),
    ("state variables", 98.0),
    ("scaled (mN)", 84.0),
    ("dAICc", 78.0),
];

/// Draws every family over its cost, and the table beneath.
pub(super) fn families_ui(ui: &mut Ui, selection: &ModelSelection) {
    let plot = plot(selection);
    heading_ui(ui, &plot.title);
    let height = ui.available_height() * PLOT_SHARE;
    ui.allocate_ui(vec2(ui.available_width(), height), |ui| {
        plot_ui(ui, "families", &plot, PlotLook::default());
    });
    ui.add_space(4.0);
    heading_ui(ui, "Families");
    let mut table = selection::table(selection).into_iter();
    let heads = table.next().unwrap_or_default();
    let places: Vec<(usize, f32)> = COLUMNS
        .iter()
        .filter_map(|(head, width)| Some((heads.iter().position(|known| known == head)?, *width)))
        .collect();
    let columns: Vec<Column> =
        places.iter().map(|&(place, width)| column(&heads[place], width)).collect();
    let mut rows: Vec<TableRow> = selection
        .candidates
        .iter()
        .zip(table)
        .map(|(one, cells)| TableRow {
            cells: places.iter().map(|&(place, _)| cells[place].clone()).collect(),
            emphasis: emphasis(selection, one),
            hint: Some(hint(one)),
        })
        .collect();
    rows.extend(selection.refused.iter().map(|one| TableRow {
        cells: vec![one.family.clone(), "refused".into()],
        emphasis: Emphasis::Quiet,
        hint: Some(one.reason.clone()),
    }));
    table_ui(ui, "families_table", &columns, &rows);
}

fn column(head: &str, width: f32) -> Column {
    match head {
        "family" | "within" => Column::words(head, width),
        _ => Column::numbers(head, width),
    }
}

fn emphasis(selection: &ModelSelection, one: &ModelCandidate) -> Emphasis {
    match (&selection.verdict.family, one.is_within) {
        (Some(chosen), _) if *chosen == one.family => Emphasis::Marked,
        (_, Some(false)) => Emphasis::Quiet,
        _ => Emphasis::Plain,
    }
}

/// The family in words and what to know of its fit.
fn hint(one: &ModelCandidate) -> String {
    let lines = std::iter::once(&one.name).chain(&one.warnings).chain(&one.prediction_refused);
    lines.cloned().collect::<Vec<_>>().join("\n")
}

/// Draws the choice in words, what each term buys, and the recordings.
pub(super) fn choice_ui(ui: &mut Ui, selected: &SelectionReport) {
    let tokens = tokens_of(ui);
    let selection = &selected.selection;
    section_ui(ui, "Choice");
    sentences_ui(ui, &selection.verdict.sentences);
    if let Some(chosen) = &selection.verdict.family
        && let Some(one) = selection.candidates.iter().find(|one| one.family == *chosen)
        && let Ok(parameters) = one.model.parameters()
    {
        section_ui(ui, "Parameters");
        for parameter in parameters {
            let value = format!("{} {}", plain(parameter.value), parameter.unit);
            fact_ui(ui, &parameter.name, value.trim().to_owned());
        }
    }
    section_ui(ui, "Gain of each term");
    let ladder = selection::ladder(selection);
    let steps = ladder.get(1..).unwrap_or_default();
    if steps.is_empty() {
        placeholder_ui(
            ui,
            "add a second family of the same kind, such as prony-2 beside prony-1, to see what one more term improves",
        );
    }
    for step in steps {
        let line = |words: RichText| Label::new(words.small()).wrap();
        ui.add(line(RichText::new(format!("{}: {}", step[0], step[1]))));
        let numbers = ladder[0].iter().zip(step).skip(2);
        // "rms (mN)" as the head of a column is "rms 5 > 3 mN" in a line.
        let number = |(head, cell): (&String, &String)| match head.split_once(" (") {
            Some((name, unit)) => format!("{name} {cell} {}", unit.trim_end_matches(')')),
            None => format!("{head} {cell}"),
        };
        let numbers: Vec<String> = numbers.map(number).collect();
        ui.add(line(RichText::new(numbers.join(", ")).color(tokens.text_quiet)));
    }
    section_ui(ui, "Recordings");
    for text in [selection::records(selection), selection::tested(selection)] {
        small_ui(ui, text);
    }
    for note in &selected.notes {
        quiet_ui(ui, note);
    }
}
