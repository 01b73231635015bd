//! The plots: over time above each other, over depth, and the tables.

use super::keys::ViewMove;
use super::session_list::{CommonParts, color_of};
use super::side_by_side::{fitted_ink, fitted_over_depth};
use super::subject::{LINE_MODELLED, LINE_RESIDUAL, ReviewSubject};
use super::tiles::ViewTiles;
use super::{ReviewScreen, View};
use crate::plots::navigate::Gesture;
use crate::plots::over_depth::{DepthLine, DepthLineKey};
use crate::plots::over_time::{TimeBackdrop, TimeLayer, TimeMark, TimePanel, over_time_ui};
use crate::plots::stretches::{AREA, FIT_WIDTH, FRONT_WIDTH, WIDTH};
use crate::plots::style::AXIS_WIDTH;
use crate::theme::icon_text;
use crate::widgets::{NamedControl, heading_ui, quiet_ui, sentence_ui, tokens_of};
use crate::workers::review::{Quantity, ReviewRecording};
use eframe::egui::{Button, RichText, Ui, Vec2, WidgetText, vec2};
use egui_plot::PlotPoint;
use lucide_icons::Icon;
use palpate_model::signal::track::SignalTrack;

/// Least size of a tool's button in points.
const TOOL: Vec2 = vec2(34.0, 30.0);
/// Points that the axis below a plot takes of it.
const AXIS_HEIGHT: f32 = 34.0;
/// Sessions that are drawn with two points a pixel each; of more than that, each has fewer.
const FULL_LINES: usize = 13;

impl ReviewScreen {
    pub fn draw_middle(&mut self, ui: &mut Ui) {
        // In the view of parameters, keys choose in the table.
        self.read_keys(ui.ctx(), self.view != View::Parameters);
        if self.subjects.is_empty() {
            quiet_ui(ui, "no session is shown; choose some in the library");
            return;
        }
        ui.horizontal_wrapped(|ui| self.tools_ui(ui));
        self.tiles_ui(ui);
    }

    pub(super) fn view_ui(&mut self, ui: &mut Ui, view: View) {
        match view {
            View::OverTime | View::OverDepth => {
                self.remarks_ui(ui, view);
                let column = match view {
                    View::OverTime => {
                        self.front().map_or(1, |front| front.column(&self.quantities))
                    }
                    _ => self.front().map_or(1, |front| front.loop_means.column),
                };
                self.readout_ui(ui, column);
                match view {
                    View::OverTime => self.over_time_ui(ui),
                    _ => self.over_depth_ui(ui),
                }
            }
            View::SideBySide => self.side_by_side_ui(ui),
            View::Cycles => self.cycles_ui(ui),
            View::Parameters => self.parameters_ui(ui),
            View::Prediction => self.prediction_ui(ui),
        }
    }

    /// What the pointer and the keys can do in the plots that are seen.
    fn tools_ui(&mut self, ui: &mut Ui) {
        ui.spacing_mut().item_spacing.x = 2.0;
        // The tabs below stay where they are in views without tools.
        ui.set_min_height(TOOL.y);
        if tool_ui(ui, icon_text(Icon::UnfoldHorizontal), "Whole width", "W") {
            self.is_wide = !self.is_wide;
        }
        let hint = "all views behind their tabs again";
        if self.tiles.is_split() && tool_ui(ui, icon_text(Icon::Square), "One view", hint) {
            self.tiles = ViewTiles::default();
            self.tiles.bring(self.view);
        }
        let seen = std::iter::once(self.view).chain(self.tiles.seen());
        if let Some(view) = seen.into_iter().find(|view| view.has_axes()) {
            self.moves_ui(ui, view);
        }
        let figured = [View::OverTime, View::OverDepth, View::SideBySide];
        if figured.contains(&self.view) {
            ui.separator();
            self.figure_ui(ui);
        }
    }

    fn moves_ui(&mut self, ui: &mut Ui, view: View) {
        ui.separator();
        let word = |text: &str| RichText::new(text);
        for (text, name, key, to) in [
            (icon_text(Icon::ZoomIn), "Zoom in", "+", ViewMove::ZoomIn),
            (icon_text(Icon::ZoomOut), "Zoom out", "-", ViewMove::ZoomOut),
            (icon_text(Icon::ChevronLeft), "Pan left", "left arrow", ViewMove::PanLeft),
            (icon_text(Icon::ChevronRight), "Pan right", "right arrow", ViewMove::PanRight),
            (icon_text(Icon::Maximize), "Reset view", "Home", ViewMove::Reset),
            (word("Cursor A"), "Cursor A", "A, or a click", ViewMove::Cursor(0)),
            (word("Cursor B"), "Cursor B", "B, or a click with Shift", ViewMove::Cursor(1)),
            (icon_text(Icon::X), "Clear cursors", "Delete", ViewMove::ClearCursors),
        ] {
            // Cursors stand in time, which the view of cycles does not have.
            let is_cursor = matches!(to, ViewMove::Cursor(_) | ViewMove::ClearCursors);
            if is_cursor && view == View::Cycles {
                continue;
            }
            if to == ViewMove::Cursor(0) {
                ui.separator();
            }
            if tool_ui(ui, text, name, key) {
                self.view = view;
                self.go(to);
            }
        }
    }

    /// What a reader of the plots must know.
    pub(super) fn remarks_ui(&self, ui: &mut Ui, view: View) {
        for subject in self.subjects.iter().filter(|one| one.recording.is_reading()) {
            let share = 100.0 * subject.recording.share();
            quiet_ui(ui, format!("{}: still reading {share:.0} %", subject.name));
        }
        let lines = if view == View::Cycles { &self.loop_lines } else { &self.depth_lines };
        let words = match view {
            View::OverDepth | View::Cycles if lines.is_busy() => {
                Some("computing the lines of this view".to_owned())
            }
            View::OverDepth | View::Cycles => lines.remark(),
            _ if self.thinned > 1 => {
                Some(format!("line: mean of {} samples; area: lowest to highest", self.thinned))
            }
            _ => Some("every sample is drawn".to_owned()),
        };
        let front = self.front().filter(|_| self.subjects.len() > 1 && view == View::OverTime);
        let front = front.map(|front| {
            let fit = if front.fitted().is_some() { ", events and fit" } else { " and events" };
            let common = CommonParts::of(self.subjects.iter());
            format!("phases{fit}: {}", common.short_name(front))
        });
        let words: Vec<String> = words.into_iter().chain(front).collect();
        if !words.is_empty() {
            quiet_ui(ui, words.join("; "));
        }
    }

    /// Phases, events and cursors of the session in front.
    fn backdrop(&self, front: &ReviewSubject) -> TimeBackdrop {
        let shift = front.shift(self.time_origin);
        let recording = &front.recording;
        let end = recording.track.span().map_or(0.0, |span| span[1]);
        let phases = ReviewRecording::ended(&recording.phases, end);
        let mut setting = TimeBackdrop {
            phases: phases.map(|(from, to, phase)| (from - shift, to - shift, phase)).collect(),
            cursors: self.cursors,
            ..TimeBackdrop::default()
        };
        if let Some(facts) = &recording.facts {
            let left_out = facts.left_out_s.iter();
            setting.left_out = left_out.map(|ends| ends.map(|end| end - shift)).collect();
            let moments = facts.events.iter().filter_map(|event| {
                Some(TimeMark {
                    t: recording.track.time_of(event.after_sample)? - shift,
                    is_alarm: event.is_alarm,
                    is_note: event.is_note,
                })
            });
            setting.moments = moments.collect();
        }
        setting
    }

    fn over_time_ui(&mut self, ui: &mut Ui) {
        let has_residuals =
            self.has_residuals && self.subjects.iter().any(|one| one.fitted().is_some());
        let count = self.quantities.len() + usize::from(has_residuals);
        if count == 0 {
            quiet_ui(ui, "choose quantities on the left");
            return;
        }
        let tokens = tokens_of(ui);
        let width = ui.available_width();
        let scale = f64::from(ui.ctx().pixels_per_point());
        let pixels = (f64::from((width - AXIS_WIDTH).max(64.0)) * scale).round();
        // Many lines over each other share the points that a few have.
        let pixels = pixels / self.subjects.len().div_ceil(FULL_LINES) as f64;
        let window = self.time.shown();
        self.thinned = 1;
        for subject in &mut self.subjects {
            let line_window = subject.line_window(window, pixels, self.time_origin);
            for quantity in &self.quantities {
                subject.update(*quantity, line_window);
                let line = &subject.lines[*quantity as usize];
                self.thinned = self.thinned.max(line.samples_per_column());
            }
            subject.update_fit(line_window);
        }
        let Some(front) = self.front() else { return };
        let setting = self.backdrop(front);
        let time_axis = format!("time from {} (s)", self.time_origin.name());
        let height = ((ui.available_height() - AXIS_HEIGHT) / count as f32).max(40.0);
        let mut gestures = Vec::new();
        for number in 0..count {
            let quantity = self.quantities.get(number).copied();
            let mut layers = Vec::new();
            // The session in front is drawn last.
            for subject in self.subjects.iter().rev() {
                let place = quantity.map_or(LINE_RESIDUAL, |one| one as usize);
                if quantity.is_none() && subject.fitted().is_none() {
                    continue;
                }
                let is_front = subject.id == front.id && self.subjects.len() > 1;
                layers.push(TimeLayer {
                    name: &subject.name,
                    color: color_of(tokens, subject),
                    width: if is_front { FRONT_WIDTH } else { WIDTH },
                    stretches: &subject.lines[place],
                });
            }
            if quantity == Some(Quantity::Force) && front.fitted().is_some() {
                layers.push(TimeLayer {
                    name: "fitted",
                    color: fitted_ink(tokens, color_of(tokens, front)),
                    width: FIT_WIDTH,
                    stretches: &front.lines[LINE_MODELLED],
                });
            }
            let panel = TimePanel {
                id: quantity.map_or("Residual", Quantity::name),
                axis: quantity.map_or("residual (mN)", Quantity::axis),
                layers,
                has_zero: quantity.is_none(),
            };
            let is_last = number + 1 == count;
            let own = height + if is_last { AXIS_HEIGHT } else { 0.0 };
            ui.allocate_ui(vec2(width, own.min(ui.available_height())), |ui| {
                let axis = is_last.then_some(time_axis.as_str());
                gestures.push(over_time_ui(ui, &panel, &self.time, &setting, axis));
            });
        }
        for gesture in gestures {
            self.time.follow(&gesture, 0);
            if let Some(is_shift) = gesture.click.filter(|_| !gesture.is_double) {
                self.cursors[usize::from(is_shift)] = Some(self.time.at(gesture.at[0]));
            }
        }
    }

    fn over_depth_ui(&mut self, ui: &mut Ui) {
        let tokens = tokens_of(ui);
        let cursors = |track: &SignalTrack, shift: f64, column: usize| {
            self.cursors.map(|cursor| {
                let place = track.place(cursor? + shift)?;
                let value =
                    |quantity: Quantity| track.column_mean(quantity as usize, place, column);
                Some([value(Quantity::Depth)?, value(Quantity::Force)?])
            })
        };
        let fits: Vec<[Vec<PlotPoint>; 1]> = (self.subjects.iter().enumerate())
            .map(|(index, one)| [if index == 0 { fitted_over_depth(one) } else { Vec::new() }])
            .collect();
        let width = if self.subjects.len() > 1 { [FRONT_WIDTH, WIDTH] } else { [WIDTH; 2] };
        let line = |subject: &'_ ReviewSubject| DepthLineKey {
            id: subject.id,
            version: subject.fifths(),
            rows: [0, subject.recording.track.len()],
            color: color_of(tokens, subject).gamma_multiply(AREA),
        };
        let lines: Vec<DepthLine<'_>> = self
            .subjects
            .iter()
            .zip(&fits)
            .enumerate()
            .map(|(index, (subject, fit))| DepthLine {
                name: &subject.name,
                track: &subject.recording.track,
                key: line(subject),
                over: {
                    let color = color_of(tokens, subject);
                    let means =
                        (subject.loop_means.stretches.as_slice(), color, width[index.min(1)]);
                    [means, (fit, fitted_ink(tokens, color), FIT_WIDTH)]
                },
                cursors: cursors(
                    &subject.recording.track,
                    subject.shift(self.time_origin),
                    subject.loop_means.column,
                ),
            })
            .collect();
        let gesture = self.depth_lines.ui(ui, &lines, [&self.depth, &self.force]);
        self.follow_over_depth(&gesture);
    }

    /// Moves the axes of depth and force as the pointer did.
    pub(super) fn follow_over_depth(&mut self, gesture: &Gesture) {
        self.depth.follow(gesture, 0);
        self.force.follow(gesture, 1);
    }
}

/// Draws a small button with a name that is read aloud and a key; returns whether it was pressed.
pub(super) fn tool_ui(ui: &mut Ui, text: impl Into<WidgetText>, name: &str, key: &str) -> bool {
    let button = ui.add(Button::new(text.into()).min_size(TOOL));
    let button = button.accessible_name(name).named(name);
    button.on_hover_text(format!("{name}: {key}")).clicked()
}

/// A heading with a line of words below it.
pub(super) fn head_ui(ui: &mut Ui, title: &str, words: &str) {
    heading_ui(ui, title);
    if !words.is_empty() {
        sentence_ui(ui, words);
    }
}
