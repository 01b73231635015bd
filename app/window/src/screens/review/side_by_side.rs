//! A small plot of every session, all with the same axes and one cursor.

use super::ReviewScreen;
use super::groups::{SessionGroup, groups};
use super::session_list::color_of;
use super::subject::{LINE_MODELLED, ReviewSubject};
use crate::plots::over_depth::{DepthLine, DepthLineKey, DepthLines};
use crate::plots::small::{HEAD, SmallGrid, SmallPlot, SmallResponse, small_plot_ui};
use crate::plots::stretches::{AREA, FIT_WIDTH, WIDTH};
use crate::theme::Tokens;
use crate::widgets::{NamedControl, quiet_ui, tokens_of};
use crate::workers::review::Quantity;
use crate::workers::review::fit::MODELLED;
use eframe::egui::text::{LayoutJob, TextFormat, TextWrapping};
use eframe::egui::{
    Align2, Color32, Id, Label, Pos2, Rect, RichText, Role, ScrollArea, Sense, Stroke, StrokeKind,
    TextStyle, Ui, UiBuilder, Vec2, WidgetInfo, pos2, vec2,
};
use egui_plot::PlotPoint;
use std::collections::BTreeMap;

/// Height of the heading of a group in points.
const HEADING: f32 = 30.0;
/// Points of a fit over depth: far closer than a small plot can show.
const FIT_POINTS: usize = 400;
/// Searches for lines over depth that go on at once: the two cores of a small computer.
const SEARCHES_MAX: usize = 2;

/// What the view keeps from frame to frame.
#[derive(Default)]
pub(super) struct SideBySide {
    pub is_over_depth: bool,
    /// By the number of the session.
    depth_lines: BTreeMap<u64, DepthLines>,
    /// What the axes took when they were drawn last.
    axes: Option<Vec2>,
}

impl SideBySide {
    pub fn is_busy(&self) -> bool {
        self.depth_lines.values().any(DepthLines::is_busy)
    }
}

/// A plot that was drawn, with what stands above it.
struct DrawnCell {
    index: usize,
    title: String,
    head: Rect,
    response: SmallResponse,
}

/// Where the cursor of all plots stands.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SharedCursor {
    Time(f64),
    Depth(f64),
}

/// Depth and force of a session at the cursor, and its time from the chosen zero.
#[derive(Clone, Copy, Debug, PartialEq)]
struct CursorValue {
    t: f64,
    depth: Option<f64>,
    force: Option<f64>,
}

fn value_at(subject: &ReviewSubject, cursor: SharedCursor, shift: f64) -> Option<CursorValue> {
    // What is read is what the line shows: the mean of a column.
    let column = match cursor {
        SharedCursor::Time(_) => subject.column(&[Quantity::Force]),
        SharedCursor::Depth(_) => subject.loop_means.column,
    };
    let track = &subject.recording.track;
    let t = match cursor {
        SharedCursor::Time(t) => t + shift,
        SharedCursor::Depth(depth) => track.time_of(first_reaching(subject, depth)?)?,
    };
    let [first, last] = track.span()?;
    let place = track.place(t).filter(|_| (first..=last).contains(&t))?;
    let value = |quantity: Quantity| track.column_mean(quantity as usize, place, column);
    Some(CursorValue {
        t: place.t - shift,
        depth: value(Quantity::Depth),
        force: value(Quantity::Force),
    })
}

/// The first sample that is so deep; `None` if none is.
fn first_reaching(subject: &ReviewSubject, depth: f64) -> Option<usize> {
    let track = &subject.recording.track;
    let reaches = |count: usize| {
        let found = track.extremes(Quantity::Depth as usize, 0, count);
        found.is_some_and(|[_, deepest]| deepest >= depth)
    };
    // The deepest of the first so many samples never gets less, so halving finds the first one.
    let (mut low, mut high) = (0, track.len());
    if !reaches(high) {
        return None;
    }
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if reaches(middle) { high = middle } else { low = middle }
    }
    Some(high - 1)
}

/// Place of the colour of sessions that is too close to the usual ink of fits.
pub(super) const LIKE_TEXT: usize = 5;

/// The ink of a fit over the line of a session.
pub(super) fn fitted_ink(tokens: &Tokens, own: Color32) -> Color32 {
    if own == tokens.sessions[LIKE_TEXT] { tokens.limit } else { tokens.text }
}

/// The fit of a session over depth.
pub(super) fn fitted_over_depth(subject: &ReviewSubject) -> Vec<PlotPoint> {
    let Some(fit) = subject.fitted() else { return Vec::new() };
    let count = fit.track.len();
    let track = &subject.recording.track;
    let point = |index: usize| {
        let t = fit.track.time_of(index)?;
        let depth = track.value(Quantity::Depth as usize, track.place(t)?)?;
        let force = fit.track.value(MODELLED, fit.track.place(t)?)?;
        Some(PlotPoint::new(depth, force))
    };
    (0..count).step_by(count.div_ceil(FIT_POINTS).max(1)).filter_map(point).collect()
}

impl ReviewScreen {
    pub(super) fn side_by_side_ui(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            ui.label("force over:");
            for (is_over_depth, word) in [(false, "time"), (true, "depth")] {
                let name = format!("Force over {word}");
                let choice = ui.selectable_value(&mut self.side.is_over_depth, is_over_depth, word);
                choice.accessible_name(&name).named(&name);
            }
        });
        let groups = groups(&self.subjects, self.grouping);
        // What the cursor says is known only after the plots.
        let (line, _) = ui.allocate_exact_size(vec2(ui.available_width(), 20.0), Sense::hover());
        let cursor = self.grid_ui(ui, &groups);
        self.cursor_line_ui(ui, line, cursor);
    }

    fn cursor_line_ui(&self, ui: &mut Ui, place: Rect, cursor: Option<SharedCursor>) {
        let from = self.time_origin.name();
        let words = match cursor {
            Some(SharedCursor::Time(t)) => {
                format!("cursor at {t:.3} s from {from}; a click brings the session to the front")
            }
            Some(SharedCursor::Depth(depth)) => {
                format!("cursor at {depth:.3} mm, where each session first reaches it; a click brings the session to the front")
            }
            None => "point at a plot to read all of them at one place; A sets a cursor without the pointer".into(),
        };
        let fits = self.subjects.iter().filter(|one| one.fitted().is_some()).count();
        let words = match fits {
            0 => words,
            fits => format!("thin: fits of {fits}; {words}"),
        };
        let mut line = ui.new_child(UiBuilder::new().max_rect(place));
        let words = RichText::new(words).color(tokens_of(ui).text_quiet).small();
        line.add(Label::new(words).truncate());
    }

    /// Draws the plots; returns where the cursor stands.
    fn grid_ui(&mut self, ui: &mut Ui, groups: &[SessionGroup]) -> Option<SharedCursor> {
        let heading = if groups.iter().any(|group| !group.name.is_empty()) { HEADING } else { 0.0 };
        let counts: Vec<usize> = groups.iter().map(|group| group.members.len()).collect();
        let axes = self.side.axes.unwrap_or(vec2(66.0, 40.0));
        let space = ui.available_size() - vec2(ui.spacing().scroll.allocated_width(), 4.0);
        let grid = SmallGrid::new(space, &counts, heading, axes);
        self.side.depth_lines.retain(|id, _| self.subjects.iter().any(|one| one.id == *id));
        // Those out of sight too: a search that has ended makes room for the next.
        self.side.depth_lines.values_mut().for_each(|lines| lines.poll(ui.ctx()));
        let mut cells = Vec::new();
        ScrollArea::vertical()
            .id_salt("side_by_side")
            .auto_shrink(false)
            .show(ui, |ui| {
                let rows: usize = counts.iter().map(|count| count.div_ceil(grid.columns)).sum();
                let height = groups.len() as f32 * heading + rows as f32 * grid.row() + grid.axes.y;
                let size = vec2(space.x, height);
                let (whole, _) = ui.allocate_exact_size(size, Sense::hover());
                // A plot with none below it in its column has the axis across.
                let lowest: Vec<Option<usize>> = (0..grid.columns)
                    .map(|column| counts.iter().rposition(|count| *count > column))
                    .collect();
                let mut top = whole.top();
                for (number, group) in groups.iter().enumerate() {
                    if heading > 0.0 {
                        heading_ui(ui, pos2(whole.left(), top), whole.width(), group);
                        top += heading;
                    }
                    let titles = group.short_names(&self.subjects);
                    for (place, (index, title)) in group.members.iter().zip(titles).enumerate() {
                        let (row, column) = (place / grid.columns, place % grid.columns);
                        let corner = vec2(whole.left(), top + row as f32 * grid.row());
                        let cell = grid.cell(column).translate(corner);
                        let is_lowest = lowest[column] == Some(number)
                            && place + grid.columns >= group.members.len();
                        let written = [is_lowest, column == 0];
                        if ui.is_rect_visible(cell.expand2(grid.axes)) {
                            let response = self.cell_ui(ui, *index, cell, grid.axes, written);
                            let head = Rect::from_min_size(cell.min, vec2(cell.width(), HEAD));
                            let title = title.trim_end_matches(" UTC").to_owned();
                            cells.push(DrawnCell { index: *index, title, head, response });
                        }
                    }
                    top += group.members.len().div_ceil(grid.columns) as f32 * grid.row();
                }
                self.overlay_ui(ui, &cells)
            })
            .inner
    }

    /// Draws the plot of a session.
    fn cell_ui(
        &mut self,
        ui: &mut Ui,
        index: usize,
        cell: Rect,
        axes: Vec2,
        [has_x, has_y]: [bool; 2],
    ) -> SmallResponse {
        let tokens = tokens_of(ui);
        let place = Rect::from_min_max(pos2(cell.left(), cell.top() + HEAD), cell.max);
        let (x_axis, x_name) = match self.side.is_over_depth {
            true => (&self.depth, "depth (mm)".to_owned()),
            false => (&self.time, format!("time from {} (s)", self.time_origin.name())),
        };
        let plot = SmallPlot {
            id: Id::unique(("side by side", self.subjects[index].id)),
            shown: [x_axis.shown(), self.force.shown()],
            names: [has_x.then_some(x_name.as_str()), has_y.then_some("force (N)")],
        };
        let color = color_of(tokens, &self.subjects[index]);
        let fitted = fitted_ink(tokens, color);
        let response = if self.side.is_over_depth {
            let busy = self.side.depth_lines.values().filter(|one| one.is_busy()).count();
            let sharing = self.subjects.len();
            let subject = &self.subjects[index];
            let track = &subject.recording.track;
            let key = DepthLineKey {
                id: subject.id,
                version: subject.fifths(),
                rows: [0, track.len()],
                color: color.gamma_multiply(AREA),
            };
            let over = [fitted_over_depth(subject)];
            let line = DepthLine {
                name: &subject.name,
                track,
                key,
                over: [(&subject.loop_means.stretches, color, WIDTH), (&over, fitted, FIT_WIDTH)],
                cursors: [None; 2],
            };
            let lines = self.side.depth_lines.entry(subject.id).or_default();
            lines.sharing = sharing;
            if lines.is_busy() || busy < SEARCHES_MAX {
                lines.update(ui.ctx(), &[line], [&self.depth, &self.force]);
            } else {
                ui.ctx().request_repaint_after(std::time::Duration::from_millis(30));
            }
            let drawn = &*lines;
            let response = small_plot_ui(ui, plot, place, axes, |plot_ui| {
                drawn.paint(plot_ui, &[line]);
            });
            lines.measure(ui, response.rect);
            response
        } else {
            let pixels = f64::from(place.width() * ui.ctx().pixels_per_point()).round();
            let subject = &mut self.subjects[index];
            let window = subject.line_window(plot.shown[0], pixels, self.time_origin);
            subject.update(Quantity::Force, window);
            subject.update_fit(window);
            let subject = &self.subjects[index];
            small_plot_ui(ui, plot, place, axes, move |plot_ui| {
                let mut layers = vec![(Quantity::Force as usize, (color, WIDTH))];
                layers.extend(subject.fitted().map(|_| (LINE_MODELLED, (fitted, FIT_WIDTH))));
                for (layer, look) in layers {
                    subject.lines[layer].paint(plot_ui, &subject.name, layer, look);
                }
            })
        };
        let taken = vec2(
            response.rect.left() - (place.left() - axes.x),
            place.bottom() + axes.y - response.rect.bottom(),
        );
        let known = self.side.axes.unwrap_or(axes);
        let measured =
            vec2(if has_y { taken.x } else { known.x }, if has_x { taken.y } else { known.y });
        if (measured - known).abs().max_elem() > 0.5 || self.side.axes.is_none() {
            // A plot measures its axes while it is drawn: what was drawn with others is not shown.
            ui.ctx().request_discard("the axes of small plots were measured");
            ui.ctx().request_repaint();
        }
        self.side.axes = Some(measured);
        response
    }

    /// Draws the cursor in all plots and what it reads above each; follows what the pointer did.
    fn overlay_ui(&mut self, ui: &mut Ui, cells: &[DrawnCell]) -> Option<SharedCursor> {
        let tokens = tokens_of(ui);
        let is_over_depth = self.side.is_over_depth;
        let x_axis = if is_over_depth { self.depth } else { self.time };
        let pointed = cells.iter().find(|cell| cell.response.is_hovered);
        let pointed = pointed.map(|cell| x_axis.at(cell.response.gesture.at[0]));
        let cursor = match (pointed, is_over_depth) {
            (Some(depth), true) => Some(SharedCursor::Depth(depth)),
            (Some(t), false) => Some(SharedCursor::Time(t)),
            (None, _) => self.cursors[0].map(SharedCursor::Time),
        };
        let front = self.front().map(|one| one.id);
        for cell in cells {
            let subject = &self.subjects[cell.index];
            let is_front = front == Some(subject.id);
            let value = cursor
                .and_then(|cursor| value_at(subject, cursor, subject.shift(self.time_origin)));
            let read = value.and_then(|value| value.force).map(|force| format!("{force:.3} N"));
            head_ui(
                ui,
                cell,
                color_of(tokens, subject),
                [&subject.name, read.as_deref().unwrap_or("")],
                is_front,
            );
            if is_front {
                let frame = Stroke::new(1.5, tokens.text);
                ui.painter().rect_stroke(cell.response.rect, 0.0, frame, StrokeKind::Inside);
            }
            let x = match (cursor, value) {
                (Some(SharedCursor::Depth(depth)), _) => Some(depth),
                (Some(SharedCursor::Time(_)), Some(value)) if is_over_depth => value.depth,
                (Some(SharedCursor::Time(t)), _) => (!is_over_depth).then_some(t),
                (None, _) => None,
            };
            let rect = cell.response.rect;
            let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
            let across = |x: f64| share(x, x_axis.shown()) as f32 * rect.width() + rect.left();
            if let Some(x) = x {
                let line = Stroke::new(1.0, tokens.text_quiet);
                painter.vline(across(x), rect.y_range(), line);
            }
            let point = value.and_then(|value| {
                Some([if is_over_depth { value.depth? } else { value.t }, value.force?])
            });
            if let Some([x, force]) = point {
                let y = rect.bottom() - share(force, self.force.shown()) as f32 * rect.height();
                painter.circle_filled(pos2(across(x), y), 3.5, tokens.text);
            }
        }
        for cell in cells {
            let gesture = &cell.response.gesture;
            match is_over_depth {
                true => self.follow_over_depth(gesture),
                false => self.time.follow(gesture, 0),
            }
        }
        let is_clicked = |cell: &&DrawnCell| {
            let gesture = &cell.response.gesture;
            gesture.click.is_some() && !gesture.is_double
        };
        if let Some(cell) = cells.iter().find(is_clicked) {
            self.bring_to_front(cell.index);
        }
        cursor
    }
}

/// Place on an axis of a part that is shown, 0 to 1 within it.
fn share(value: f64, [low, high]: [f64; 2]) -> f64 {
    (value - low) / (high - low)
}

/// Draws the heading of a group and a line from it to the right.
fn heading_ui(ui: &mut Ui, at: Pos2, width: f32, group: &SessionGroup) {
    let tokens = tokens_of(ui);
    let place = Rect::from_min_size(at, vec2(width, HEADING));
    let mut line = ui.new_child(UiBuilder::new().max_rect(place));
    line.horizontal_centered(|ui| {
        let name = if group.name.is_empty() { "not known yet" } else { &group.name };
        crate::widgets::heading_ui(ui, name);
        let count = group.members.len();
        quiet_ui(ui, if count == 1 { "1 session".to_owned() } else { format!("{count} sessions") });
        let left = ui.cursor().left() + 6.0;
        let stroke = Stroke::new(1.0, tokens.line);
        ui.painter().hline(left..=place.right(), place.center().y, stroke);
    });
}

/// Draws colour and short name of a session, and on the right what the cursor reads.
fn head_ui(ui: &mut Ui, cell: &DrawnCell, color: Color32, [name, read]: [&str; 2], is_front: bool) {
    let tokens = tokens_of(ui);
    let place = cell.head;
    let head = ui.interact(place, Id::unique(("side by side head", name)), Sense::hover());
    let words = if read.is_empty() { name.to_owned() } else { format!("{name}: {read}") };
    head.widget_info(|| WidgetInfo::labeled(Role::Label, true, &words));
    head.on_hover_text(name);
    let painter = ui.painter();
    let middle = place.center().y;
    let swatch = Rect::from_center_size(pos2(place.left() + 5.0, middle), vec2(10.0, 12.0));
    painter.rect_filled(swatch, 2.0, color);
    let mono = TextStyle::Monospace.resolve(ui.style());
    let right = painter.text(place.right_center(), Align2::RIGHT_CENTER, read, mono, tokens.text);
    let font = TextStyle::Small.resolve(ui.style());
    let ink = if is_front { tokens.text } else { tokens.text_quiet };
    let mut job = LayoutJob::single_section(cell.title.clone(), TextFormat::simple(font, ink));
    let left = place.left() + 16.0;
    job.wrap = TextWrapping::truncate_at_width((right.left() - left - 6.0).max(0.0));
    let galley = ui.fonts_mut(|fonts| fonts.layout_job(job));
    let text = Align2::LEFT_CENTER.anchor_size(pos2(left, middle), galley.size());
    ui.painter().galley(text.min, galley, ink);
}
