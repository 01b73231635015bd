//! A long table whose rows can be chosen, by pointer and by keys: only rows in sight are made and laid out.

use super::glyph::{GLYPH_RADIUS, GLYPH_WIDTH, Glyph, glyph_at};
use super::table::{Column, Emphasis, GAP, ROW, row_ui, width_of};
use super::text::tokens_of;
use eframe::egui::text::{LayoutJob, TextFormat, TextWrapping};
use eframe::egui::{
    Align2, Button, Event, EventFilter, Id, InputState, Key, Label, Popup, Rect, RichText, Role,
    ScrollArea, Sense, Stroke, StrokeKind, TextStyle, Ui, Vec2, WidgetInfo, WidgetText, pos2, vec2,
};
use std::ops::Range;

/// One cell, with a glyph before its text where it has one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableCell {
    pub glyph: Option<Glyph>,
    pub text: String,
    pub emphasis: Emphasis,
}

impl TableCell {
    #[must_use]
    pub fn text(text: impl Into<String>) -> Self {
        Self { text: text.into(), ..Self::default() }
    }

    #[must_use]
    pub fn marked(glyph: Glyph, text: impl Into<String>, emphasis: Emphasis) -> Self {
        Self { glyph: Some(glyph), text: text.into(), emphasis }
    }
}

/// One row: a cell for each column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableLine {
    /// Read aloud in the place of the cells.
    pub name: String,
    pub cells: Vec<TableCell>,
}

/// How far a table is scrolled.
#[derive(Clone, Copy, Debug, Default)]
pub struct ScrollPosition {
    offset: f32,
    height: f32,
    target: Option<f32>,
}

/// How a row is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SelectionMode {
    Only,
    /// Adds the row, or takes it away.
    Toggle,
    /// All rows from the one that was chosen first.
    Extend,
}

/// What was done with the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableAction {
    Choose(usize, SelectionMode),
    ChooseAll,
    /// Opens the rows that are chosen.
    Open,
    /// Sorts by the column of this number.
    Sort(usize),
}

/// A table of which a row is made when it is drawn.
pub struct ChoiceTable<'a> {
    pub name: &'a str,
    pub columns: &'a [Column],
    /// Whether the heading of a column sorts.
    pub can_sort: &'a dyn Fn(usize) -> bool,
    /// Column that the rows are sorted by, and whether in reverse.
    pub sorted: Option<(usize, bool)>,
    pub count: usize,
    /// The row from which keys move.
    pub at: Option<usize>,
    pub line: &'a dyn Fn(usize) -> TableLine,
    pub is_chosen: &'a dyn Fn(usize) -> bool,
}

impl ChoiceTable<'_> {
    /// Draws the table in the space there is; tells what was done and which rows are in sight.
    pub fn ui(
        &self,
        ui: &mut Ui,
        scrolled: &mut ScrollPosition,
    ) -> (Vec<TableAction>, Range<usize>) {
        let (mut acts, mut shown) = (Vec::new(), 0..0);
        let width = width_of(self.columns);
        let id = ui.make_persistent_id((self.name, "table"));
        ScrollArea::horizontal().id_salt((self.name, "across")).auto_shrink(false).show(ui, |ui| {
            let width = width.max(ui.available_width());
            ui.set_min_width(width);
            ui.spacing_mut().item_spacing = Vec2::ZERO;
            self.heads_ui(ui, width, &mut acts);
            ui.separator();
            let body =
                ui.interact(ui.available_rect_before_wrap(), id, Sense::focusable_noninteractive());
            body.widget_info(|| WidgetInfo::labeled(Role::ListBox, true, self.name));
            if body.has_focus() {
                let tokens = tokens_of(ui);
                let stroke = Stroke::new(1.0, tokens.focus);
                ui.painter().rect_stroke(body.rect, 0.0, stroke, StrokeKind::Inside);
                // Up and down are the table's, not the way to another control.
                let filter = EventFilter { vertical_arrows: true, ..EventFilter::default() };
                ui.memory_mut(|memory| memory.set_focus_lock_filter(id, filter));
            }
            shown = self.body_ui(ui, width, id, scrolled, &mut acts);
            // After the rows: a click on one gives the table the focus, and a key of the same frame comes after it.
            let focused = ui.memory(|memory| memory.focused());
            if focused.is_none_or(|one| one == id) && !Popup::is_any_open(ui.ctx()) {
                self.keys(ui, scrolled, &mut acts);
            }
        });
        (acts, shown)
    }

    fn heads_ui(&self, ui: &mut Ui, width: f32, acts: &mut Vec<TableAction>) {
        let tokens = tokens_of(ui);
        row_ui(ui, self.columns, width, |ui, index, column| {
            let text = match &column.print {
                Some(print) => WidgetText::from(print.clone()),
                None => RichText::new(&column.head).color(tokens.text_quiet).small().into(),
            };
            if !(self.can_sort)(index) {
                ui.add(Label::new(text).truncate());
                return;
            }
            ui.spacing_mut().button_padding.x = 0.0;
            let head = ui.add(Button::new(text).frame(false));
            if let Some((_, is_reversed)) = self.sorted.filter(|(by, _)| *by == index) {
                let glyph = if is_reversed { Glyph::Up } else { Glyph::Down };
                let place = head.rect.right_center() + vec2(8.0, 0.0);
                glyph_at(ui.painter(), glyph, place, GLYPH_RADIUS, tokens.text_quiet);
            }
            let head = head.accessible_name(format!("sort by {}", column.head));
            if head.on_hover_text("click to sort; click again to reverse").clicked() {
                acts.push(TableAction::Sort(index));
            }
        });
    }

    fn body_ui(
        &self,
        ui: &mut Ui,
        width: f32,
        id: Id,
        scrolled: &mut ScrollPosition,
        acts: &mut Vec<TableAction>,
    ) -> Range<usize> {
        let mut area = ScrollArea::vertical().id_salt((self.name, "rows")).auto_shrink(false);
        if let Some(offset) = scrolled.target.take() {
            area = area.vertical_scroll_offset(offset);
        }
        let drawn = area.show_rows(ui, ROW, self.count, |ui, rows| {
            for index in rows.clone() {
                self.line_ui(ui, width, id, index, acts);
            }
            rows
        });
        scrolled.offset = drawn.state.clamped_offset().y;
        scrolled.height = drawn.inner_rect.height();
        drawn.inner
    }

    fn line_ui(&self, ui: &mut Ui, width: f32, id: Id, index: usize, acts: &mut Vec<TableAction>) {
        let tokens = tokens_of(ui);
        let (line, is_chosen) = ((self.line)(index), (self.is_chosen)(index));
        let (rect, _) = ui.allocate_exact_size(vec2(width, ROW), Sense::hover());
        // Not to be walked through by Tab: the table has the focus, and keys choose in it.
        let in_sight = rect.intersect(ui.clip_rect());
        if !in_sight.is_positive() {
            return;
        }
        let row = ui.interact(in_sight, id.with(index), Sense::CLICK);
        row.widget_info(|| WidgetInfo::selected(Role::ListBoxOption, true, is_chosen, &line.name));
        if is_chosen {
            ui.painter().rect_filled(rect, 0.0, tokens.selection);
        }
        if self.at == Some(index) {
            let mark = Rect::from_min_size(rect.min, vec2(3.0, ROW));
            ui.painter().rect_filled(mark, 0.0, tokens.text);
        }
        let mut left = rect.left() + GAP * 0.5;
        for (cell, column) in line.cells.iter().zip(self.columns) {
            let place = Rect::from_min_size(pos2(left, rect.top()), vec2(column.width, ROW));
            cell_ui(ui, cell, place, column.is_number, is_chosen);
            left += column.width + GAP;
        }
        if row.double_clicked() {
            acts.extend([TableAction::Choose(index, SelectionMode::Only), TableAction::Open]);
        } else if row.clicked() {
            ui.memory_mut(|memory| memory.request_focus(id));
            let how = ui.input(|input| match input.modifiers {
                held if held.command => SelectionMode::Toggle,
                held if held.shift => SelectionMode::Extend,
                _ => SelectionMode::Only,
            });
            acts.push(TableAction::Choose(index, how));
        }
        if row.hovered() && line.cells.iter().any(|cell| cell.emphasis == Emphasis::Alarm) {
            row.on_hover_text(&line.name);
        }
    }

    fn keys(&self, ui: &Ui, scrolled: &mut ScrollPosition, acts: &mut Vec<TableAction>) {
        if self.count == 0 {
            return;
        }
        let page = ((scrolled.height / ROW) as usize).max(1);
        let (mut went, mut how) = (None, SelectionMode::Only);
        ui.input(|input| {
            went = self.key_target(input, page);
            if input.modifiers.shift {
                how = SelectionMode::Extend;
            }
            // The modifiers are the event's own: those of the frame may have been let go already.
            let is_all = |event: &Event| matches!(event, Event::Key { key: Key::A, pressed: true, modifiers, .. } if modifiers.command);
            if input.events.iter().any(is_all) {
                acts.push(TableAction::ChooseAll);
            }
            if let Some(at) = self.at.filter(|_| input.key_pressed(Key::Space)) {
                acts.push(TableAction::Choose(at, SelectionMode::Toggle));
            }
            if input.key_pressed(Key::Enter) {
                acts.push(TableAction::Open);
            }
        });
        if let Some(to) = went {
            acts.push(TableAction::Choose(to, how));
            let (top, bottom) = (to as f32 * ROW, (to + 1) as f32 * ROW);
            if top < scrolled.offset {
                scrolled.target = Some(top);
            } else if bottom > scrolled.offset + scrolled.height {
                scrolled.target = Some(bottom - scrolled.height);
            }
        }
    }

    /// The row that keys lead to.
    fn key_target(&self, input: &InputState, page: usize) -> Option<usize> {
        let last = self.count - 1;
        let from = |step: isize| match self.at {
            Some(at) => at.saturating_add_signed(step).min(last),
            None => 0,
        };
        let page = isize::try_from(page).unwrap_or(1);
        [
            (Key::ArrowDown, from(1)),
            (Key::ArrowUp, from(-1)),
            (Key::PageDown, from(page)),
            (Key::PageUp, from(-page)),
            (Key::Home, 0),
            (Key::End, last),
        ]
        .into_iter()
        .find_map(|(key, to)| input.key_pressed(key).then_some(to))
    }
}

fn cell_ui(ui: &Ui, cell: &TableCell, place: Rect, is_number: bool, is_chosen: bool) {
    let tokens = tokens_of(ui);
    // The ground of a chosen row is darker: only full ink is readable on it.
    let has_own_ground = matches!(cell.emphasis, Emphasis::Tinted(_));
    let emphasis = if is_chosen && !has_own_ground { Emphasis::Plain } else { cell.emphasis };
    let ink = emphasis.ink(tokens);
    if let Emphasis::Tinted(ground) = emphasis {
        ui.painter().rect_filled(place.expand2(vec2(0.5 * GAP - 1.0, -1.0)), 2.0, ground);
    }
    let mut left = place.left();
    if let Some(glyph) = cell.glyph {
        let center = pos2(left + GLYPH_WIDTH * 0.4, place.center().y);
        glyph_at(ui.painter(), glyph, center, GLYPH_RADIUS, ink);
        left += GLYPH_WIDTH;
    }
    let font = TextStyle::Body.resolve(ui.style());
    let mut job = LayoutJob::single_section(cell.text.clone(), TextFormat::simple(font, ink));
    job.wrap = TextWrapping::truncate_at_width(place.right() - left);
    let galley = ui.fonts_mut(|fonts| fonts.layout_job(job));
    let (align, x) = match is_number {
        true => (Align2::RIGHT_CENTER, place.right()),
        false => (Align2::LEFT_CENTER, left),
    };
    let text = align.anchor_size(pos2(x, place.center().y), galley.size());
    ui.painter().galley(text.min, galley, ink);
}
