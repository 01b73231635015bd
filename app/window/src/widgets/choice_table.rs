//! A long table whose rows can be chosen, by pointer and by keys: only rows in sight are made and laid out.

use super::glyph::{self, Glyph, glyph_at};
use super::table::{Column, GAP, ROW, row_ui};
use crate::theme::Tokens;
use eframe::egui::text::{LayoutJob, TextFormat, TextWrapping};
use eframe::egui::{
    Align2, Button, Color32, EventFilter, InputState, Key, Popup, Rect, Role, ScrollArea, Sense,
    Stroke, StrokeKind, TextStyle, Ui, Vec2, WidgetInfo, pos2, vec2,
};
use std::ops::Range;

/// How a text stands out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextTone {
    /// As the others.
    #[default]
    Plain,
    /// Of less use.
    Quiet,
    /// Wrong.
    Alarm,
}

/// One cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableCell {
    /// Shape before the text.
    pub mark: Option<Glyph>,
    /// The text.
    pub text: String,
    /// How it stands out.
    pub tone: TextTone,
}

impl TableCell {
    /// A plain text.
    #[must_use]
    pub fn text(text: impl Into<String>) -> Self {
        Self { text: text.into(), ..Self::default() }
    }

    /// A shape and its word.
    #[must_use]
    pub fn marked(mark: Glyph, text: impl Into<String>, tone: TextTone) -> Self {
        Self { mark: Some(mark), text: text.into(), tone }
    }
}

/// One row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableLine {
    /// What it is called where it is not seen.
    pub name: String,
    /// A cell for each column.
    pub cells: Vec<TableCell>,
}

/// A column that rows may be sorted by.
#[derive(Clone, Debug)]
pub struct SortableColumn {
    /// The column.
    pub column: Column,
    /// Whether its head sorts.
    pub can_sort: bool,
}

/// Where the table is scrolled to.
#[derive(Clone, Copy, Debug, Default)]
pub struct ScrollPosition {
    offset: f32,
    height: f32,
    wanted: Option<f32>,
}

/// How a row is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SelectionMode {
    /// That one alone.
    Only,
    /// That one too, or that one no more.
    Toggle,
    /// All from where it began.
    Extend,
}

/// What was done with the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableAction {
    /// A row was chosen.
    Choose(usize, SelectionMode),
    /// All were chosen.
    All,
    /// Those chosen are wanted.
    Open,
    /// A head was pressed.
    Sort(usize),
}

/// What a table shows.
pub struct ChoiceTable<'a> {
    /// What it is called.
    pub name: &'a str,
    /// Its columns.
    pub heads: &'a [SortableColumn],
    /// Column that the rows are sorted by, and whether the other way round.
    pub sorted: Option<(usize, bool)>,
    /// Rows in all.
    pub count: usize,
    /// The row that keys go from.
    pub at: Option<usize>,
    /// Makes a row.
    pub line: &'a dyn Fn(usize) -> TableLine,
    /// Whether a row is chosen.
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
        let columns: Vec<&Column> = self.heads.iter().map(|head| &head.column).collect();
        let width = columns.iter().map(|column| column.width + GAP).sum::<f32>();
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
                let tokens = Tokens::of(ui.visuals().dark_mode);
                let stroke = Stroke::new(1.0, tokens.focus);
                ui.painter().rect_stroke(body.rect, 0.0, stroke, StrokeKind::Inside);
                // Up and down are the table's, not the way to another control.
                let filter = EventFilter { vertical_arrows: true, ..EventFilter::default() };
                ui.memory_mut(|memory| memory.set_focus_lock_filter(id, filter));
            }
            let is_free = ui.memory(|memory| memory.focused().is_none());
            if (body.has_focus() || is_free) && !Popup::is_any_open(ui.ctx()) {
                self.keys(ui, scrolled, &mut acts);
            }
            shown = self.body_ui(ui, width, id, scrolled, &mut acts);
        });
        (acts, shown)
    }

    fn heads_ui(&self, ui: &mut Ui, width: f32, acts: &mut Vec<TableAction>) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        let columns: Vec<&Column> = self.heads.iter().map(|head| &head.column).collect();
        row_ui(ui, &columns, width, |ui, index, column| {
            let text = eframe::egui::RichText::new(&column.head).color(tokens.text_quiet).small();
            if !self.heads[index].can_sort {
                ui.add(eframe::egui::Label::new(text).truncate());
                return;
            }
            ui.spacing_mut().button_padding.x = 0.0;
            let head = ui.add(Button::new(text).frame(false));
            if let Some((_, is_reversed)) = self.sorted.filter(|(by, _)| *by == index) {
                let mark = if is_reversed { Glyph::Up } else { Glyph::Down };
                let place = head.rect.right_center() + vec2(8.0, 0.0);
                glyph_at(ui.painter(), mark, place, tokens.text_quiet);
            }
            let head = head.accessible_name(format!("sort by {}", column.head));
            if head.on_hover_text("sort; once more for the other way round").clicked() {
                acts.push(TableAction::Sort(index));
            }
        });
    }

    fn body_ui(
        &self,
        ui: &mut Ui,
        width: f32,
        id: eframe::egui::Id,
        scrolled: &mut ScrollPosition,
        acts: &mut Vec<TableAction>,
    ) -> Range<usize> {
        let mut area = ScrollArea::vertical().id_salt((self.name, "rows")).auto_shrink(false);
        if let Some(offset) = scrolled.wanted.take() {
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

    fn line_ui(
        &self,
        ui: &mut Ui,
        width: f32,
        id: eframe::egui::Id,
        index: usize,
        acts: &mut Vec<TableAction>,
    ) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
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
        for (cell, head) in line.cells.iter().zip(self.heads) {
            let place = Rect::from_min_size(pos2(left, rect.top()), vec2(head.column.width, ROW));
            cell_ui(ui, cell, place, head.column.is_number, is_chosen);
            left += head.column.width + GAP;
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
        if row.hovered() && line.cells.iter().any(|cell| cell.tone == TextTone::Alarm) {
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
            went = self.gone_to(input, page);
            if input.modifiers.shift {
                how = SelectionMode::Extend;
            }
            if input.modifiers.command && input.key_pressed(Key::A) {
                acts.push(TableAction::All);
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
                scrolled.wanted = Some(top);
            } else if bottom > scrolled.offset + scrolled.height {
                scrolled.wanted = Some(bottom - scrolled.height);
            }
        }
    }

    /// The row that keys lead to.
    fn gone_to(&self, input: &InputState, page: usize) -> Option<usize> {
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
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let ink: Color32 = match cell.tone {
        // A chosen row's ground is darker: only full ink is readable on it.
        _ if is_chosen => tokens.text,
        TextTone::Plain => tokens.text,
        TextTone::Quiet => tokens.text_quiet,
        TextTone::Alarm => tokens.alarm_text,
    };
    let mut left = place.left();
    if let Some(mark) = cell.mark {
        let center = pos2(left + glyph::WIDTH * 0.4, place.center().y);
        glyph_at(ui.painter(), mark, center, ink);
        left += glyph::WIDTH;
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
