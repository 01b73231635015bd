//! A property, drawn: plots and tables in the middle, its numbers and all they rest on at the right.

use crate::plots::figure::{PlacedPlot, PlotLook, legend_ui};
use crate::widgets::{
    Column, TableRow, alarm_ui, fact_ui, heading_ui, placeholder_ui, quiet_ui, section_ui,
    sentence_ui, table_ui,
};
use eframe::egui::{Label, RichText, Ui, vec2};
use palpate_analysis::property::{PropertyReport, PropertyRequest};
use palpate_analysis::report::property::{NumberInPrint, NumberLine, PropertySections, sections};
use palpate_analysis::report::property_plot::property_plots;
use palpate_analysis::session_actions::MaterialToStore;
use palpate_figures::uncertain::significant;

/// Shares of the height that the upper plot gets: residuals need less than what they are of.
const UPPER_SHARE: f32 = 0.64;
const UPPER_SHARE_WITH_TABLES: f32 = 0.54;
/// Height in points of a line of a table; of all of them, the share of the page that they get at most.
const TABLE_LINE: f32 = 30.0;
const TABLES_SHARE_MAX: f32 = 0.4;

/// Width in points of a letter of a cell.
const LETTER: f32 = 6.6;

/// A property with its plots, whose points are placed once.
pub struct FittedMaterial {
    pub report: PropertyReport,
    pub sections: PropertySections,
    plots: [PlacedPlot; 2],
    /// Of numbers that share their lines.
    tables: Vec<NumberTable>,
    pub(super) to_store: MaterialToStore,
}

/// Lines of numbers of the same names.
struct NumberTable {
    columns: Vec<Column>,
    rows: Vec<TableRow>,
}

impl FittedMaterial {
    pub(super) fn of(request: &PropertyRequest, report: PropertyReport) -> Self {
        let sections = sections(&report);
        Self {
            plots: property_plots(&report).map(PlacedPlot::from),
            tables: number_tables(&sections.numbers),
            to_store: MaterialToStore::of(request, &report),
            sections,
            report,
        }
    }
}

fn number_tables(lines: &[NumberLine]) -> Vec<NumberTable> {
    let heads = |line: &&NumberLine| -> Vec<String> {
        line.numbers.iter().map(NumberInPrint::head).collect()
    };
    let several: Vec<&NumberLine> = lines.iter().filter(|line| line.numbers.len() > 1).collect();
    let table = |lines: &[&NumberLine]| {
        let cells = |line: &&NumberLine| {
            let numbers = line.numbers.iter().map(NumberInPrint::cell);
            let cells = [line.name.clone()].into_iter().chain(numbers).collect();
            TableRow { cells, ..TableRow::default() }
        };
        let rows: Vec<TableRow> = lines.iter().map(cells).collect();
        let column = |(index, head): (usize, String)| {
            let cells = rows.iter().filter_map(|row| row.cells.get(index));
            let letters = cells.chain([&head]).map(|text| text.chars().count()).max();
            let width = LETTER * letters.unwrap_or(0) as f32;
            if index == 0 { Column::words(&head, width) } else { Column::numbers(&head, width) }
        };
        let heads = lines.first().map(heads).unwrap_or_default();
        let heads = [String::new()].into_iter().chain(heads);
        NumberTable { columns: heads.enumerate().map(column).collect(), rows }
    };
    several.chunk_by(|a, b| heads(a) == heads(b)).map(table).collect()
}

/// Draws the plots beneath each other on the same abscissa, then the tables.
pub(super) fn plots_ui(ui: &mut Ui, fitted: &FittedMaterial) {
    let [upper, lower] = &fitted.plots;
    let all = ui.available_height();
    let lines: usize = fitted.tables.iter().map(|table| table.rows.len() + 1).sum();
    let scale = (TABLES_SHARE_MAX * all / (TABLE_LINE * lines as f32)).min(1.0);
    let tables = if lines > 0 { scale * TABLE_LINE * lines as f32 } else { 0.0 };
    let share = if lines > 0 { UPPER_SHARE_WITH_TABLES } else { UPPER_SHARE };
    // Bounds along the abscissa are remembered by this name.
    let look = PlotLook { link: Some(fitted.sections.title), ..PlotLook::default() };
    ui.allocate_ui(vec2(ui.available_width(), share * (all - tables)), |ui| {
        heading_ui(ui, &upper.plot.title);
        legend_ui(ui, &[&upper.plot]);
        upper.ui(ui, &upper.plot.title, look);
    });
    let rest = vec2(ui.available_width(), ui.available_height() - tables);
    ui.allocate_ui(rest, |ui| {
        quiet_ui(ui, &lower.plot.title);
        lower.ui(ui, &lower.plot.title, look);
    });
    for table in &fitted.tables {
        let height = scale * TABLE_LINE * (table.rows.len() + 1) as f32;
        ui.allocate_ui(vec2(ui.available_width(), height), |ui| {
            let name = &table.columns.last().map_or("", |column| &column.head);
            table_ui(ui, name, &table.columns, &table.rows);
        });
    }
}

/// Draws the numbers, beside them what they assume, how far the law holds, and the budget.
pub(super) fn numbers_ui(ui: &mut Ui, fitted: &FittedMaterial) {
    let sections = &fitted.sections;
    section_ui(ui, sections.title);
    for line in &sections.numbers {
        let [number] = line.numbers.as_slice() else { continue };
        if line.name != sections.title {
            quiet_ui(ui, &line.name);
        }
        ui.add(Label::new(RichText::new(number.words()).heading().strong()).wrap());
        sentence_ui(ui, number.interval_words());
    }
    if !fitted.tables.is_empty() {
        quiet_ui(ui, "in the tables: numbers with their 95 % intervals");
    }
    for (name, words) in &sections.warnings {
        alarm_ui(ui, format!("{name}: {words}"));
    }
    section_ui(ui, "Assumptions");
    for (name, words) in &sections.assumptions {
        fact_ui(ui, name, words);
    }
    sections.remarks.iter().for_each(|remark| sentence_ui(ui, *remark));
    section_ui(ui, "How far the law holds");
    for row in &sections.validity {
        let value = significant(row.value, 3);
        let share = significant(100.0 * row.value / row.max, 2);
        sentence_ui(ui, format!("{} {value}, {share} % of the limit {}", row.ratio, row.max));
    }
    section_ui(ui, "Uncertainty budget");
    quiet_ui(ui, "standard uncertainty from each source, the largest first");
    for row in &sections.budget {
        let (source, parts) = row.split_first().map_or(("", &[][..]), |(one, rest)| (one, rest));
        sentence_ui(ui, format!("{source}: {}", parts.join(", ")));
    }
    if sections.not_included.is_empty() {
        placeholder_ui(ui, "all known sources are included");
    } else {
        sentence_ui(ui, format!("not included: {}", sections.not_included.join(", ")));
    }
    fitted.report.notes().iter().for_each(|note| quiet_ui(ui, note));
}
