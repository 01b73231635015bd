//! A table of short texts: headings, aligned columns, a marked row; only rows in sight are laid out.

use super::text::tokens_of;
use crate::theme::Tokens;
use eframe::egui::text::LayoutJob;
use eframe::egui::{
    Align, Color32, Label, Layout, Rect, RichText, ScrollArea, Sense, Ui, UiBuilder, Vec2, pos2,
    vec2,
};

/// Height of a row in points.
pub(super) const ROW: f32 = 26.0;
/// Widths of columns are given for text of 13.5 points.
const TEXT_SCALE: f32 = 15.0 / 13.5;
/// Space between columns in points.
pub(super) const GAP: f32 = 10.0;

/// One column; its heading includes the unit.
#[derive(Clone, Debug)]
pub struct Column {
    pub head: String,
    /// In points, scaled to the text.
    pub width: f32,
    /// Numbers stand on the right.
    pub is_number: bool,
    /// The heading as in print, where that is more than its text.
    pub print: Option<LayoutJob>,
}

impl Column {
    #[must_use]
    pub fn words(head: &str, width: f32) -> Self {
        Self { head: head.to_owned(), width: width * TEXT_SCALE, is_number: false, print: None }
    }

    #[must_use]
    pub fn numbers(head: &str, width: f32) -> Self {
        Self { head: head.to_owned(), width: width * TEXT_SCALE, is_number: true, print: None }
    }
}

/// How a row or a cell stands out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Emphasis {
    #[default]
    Plain,
    /// The one to look at.
    Marked,
    /// Of less use.
    Quiet,
    /// Wrong.
    Alarm,
    /// On a ground of this colour.
    Tinted(Color32),
}

impl Emphasis {
    pub(super) fn ink(self, tokens: &Tokens) -> Color32 {
        match self {
            Self::Plain | Self::Marked | Self::Tinted(_) => tokens.text,
            Self::Quiet => tokens.text_quiet,
            Self::Alarm => tokens.alarm_text,
        }
    }
}

/// One row: a text for each column.
#[derive(Clone, Debug, Default)]
pub struct TableRow {
    pub cells: Vec<String>,
    pub emphasis: Emphasis,
    /// Shown under the pointer.
    pub hint: Option<String>,
}

/// Draws the table in the space there is; scrolls both ways, and to the marked row when another is marked.
pub fn table_ui(ui: &mut Ui, name: &str, columns: &[Column], rows: &[TableRow]) {
    let tokens = tokens_of(ui);
    let width = width_of(columns);
    ScrollArea::horizontal().id_salt((name, "across")).auto_shrink(false).show(ui, |ui| {
        ui.set_min_width(width);
        ui.spacing_mut().item_spacing = Vec2::ZERO;
        row_ui(ui, columns, width, |ui, _, column| {
            let text = RichText::new(&column.head).color(tokens.text_quiet).small();
            ui.add(Label::new(text).truncate());
        });
        ui.separator();
        let mut area = ScrollArea::vertical().id_salt((name, "rows")).auto_shrink(false);
        let marked = rows.iter().position(|row| row.emphasis == Emphasis::Marked);
        let known = ui.scope_id().with((name, "marked"));
        let before = ui.data(|data| data.get_temp::<Option<usize>>(known));
        if let Some(at) = marked.filter(|_| before != Some(marked)) {
            let above = 0.5 * (ui.available_height() - ROW);
            area = area.vertical_scroll_offset((at as f32 * ROW - above).max(0.0));
        }
        ui.data_mut(|data| data.insert_temp(known, marked));
        area.show_rows(ui, ROW, rows.len(), |ui, shown| {
            for row in &rows[shown] {
                let ink = row.emphasis.ink(tokens);
                let rect = row_ui(ui, columns, width, |ui, index, _| {
                    let Some(cell) = row.cells.get(index) else { return };
                    let mut text = RichText::new(cell).color(ink);
                    if row.emphasis == Emphasis::Marked {
                        text = text.strong();
                    }
                    ui.add(Label::new(text).truncate());
                });
                if row.emphasis == Emphasis::Marked {
                    let mark = Rect::from_min_size(rect.min, vec2(3.0, ROW));
                    ui.painter().rect_filled(mark, 0.0, tokens.text);
                }
                if let Some(hint) = &row.hint {
                    let id = ui.scope_id().with((name, &row.cells));
                    ui.interact(rect, id, Sense::hover()).on_hover_text(hint);
                }
            }
        });
    });
}

/// Width in points of all columns with the space between them.
#[must_use]
pub fn width_of(columns: &[Column]) -> f32 {
    columns.iter().map(|column| column.width + GAP).sum()
}

/// One line of cells; returns where it stands.
pub(super) fn row_ui(
    ui: &mut Ui,
    columns: &[Column],
    width: f32,
    mut cell_ui: impl FnMut(&mut Ui, usize, &Column),
) -> Rect {
    let (rect, _) = ui.allocate_exact_size(vec2(width, ROW), Sense::hover());
    let mut left = rect.left() + GAP * 0.5;
    for (index, column) in columns.iter().enumerate() {
        let cell = Rect::from_min_size(pos2(left, rect.top()), vec2(column.width, ROW));
        let layout = match column.is_number {
            true => Layout::right_to_left(Align::Center),
            false => Layout::left_to_right(Align::Center),
        };
        // A child of its own: the row has its space already, whatever the cell takes of it.
        let mut cell = ui.new_child(UiBuilder::new().max_rect(cell).layout(layout));
        cell_ui(&mut cell, index, column);
        left += column.width + GAP;
    }
    rect
}
