//! The plots: over time above each other, over depth, and the tables.

use super::keys::ViewMove;
use super::left::color_of;
use super::subject::{LINE_MODELLED, LINE_RESIDUAL, ReviewSubject};
use super::{ReviewScreen, View};
use crate::plots::navigate::Gesture;
use crate::plots::over_depth::{DepthLayer, DepthSource, over_depth_ui};
use crate::plots::over_time::{TimeBackdrop, TimeLayer, TimeMark, TimePanel, over_time_ui};
use crate::theme::Tokens;
use crate::widgets::remark::quiet_ui;
use crate::workers::review::{Quantity, ReviewRecording};
use eframe::egui::{Button, Label, RichText, Ui, vec2};

/// Points that the axes beside and below a plot take of it.
const AXIS_WIDTH: f32 = 58.0;
const AXIS_HEIGHT: f32 = 34.0;
/// Sessions that are drawn with two points a pixel each; of more than that, each has fewer.
const FULL_LINES: usize = 6;

impl ReviewScreen {
    pub fn draw_middle(&mut self, ui: &mut Ui) {
        self.read_keys(ui.ctx());
        ui.horizontal_wrapped(|ui| self.views_ui(ui));
        if self.subjects.is_empty() {
            quiet_ui(ui, "no session is shown; choose some in the library");
            return;
        }
        match self.view {
            View::OverTime => {
                self.moves_ui(ui);
                self.readout_ui(ui);
                self.over_time_ui(ui);
            }
            View::OverDepth => {
                self.moves_ui(ui);
                self.readout_ui(ui);
                self.over_depth_ui(ui);
            }
            View::Cycles => self.cycles_ui(ui),
            View::Parameters => self.parameters_ui(ui),
            View::Prediction => self.prediction_ui(ui),
        }
    }

    /// Buttons for what the pointer and the keys can do.
    pub(super) fn moves_ui(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            let mut asked = None;
            for (text, key, to) in [
                ("Zoom in", "+", ViewMove::ZoomIn),
                ("Zoom out", "-", ViewMove::ZoomOut),
                ("Back", "left arrow", ViewMove::Back),
                ("On", "right arrow", ViewMove::On),
                ("Everything", "Home", ViewMove::All),
                ("Cursor A", "A, or a click", ViewMove::Cursor(0)),
                ("Cursor B", "B, or a click with Shift", ViewMove::Cursor(1)),
                ("No cursors", "Delete", ViewMove::NoCursors),
            ] {
                let is_of_time = matches!(to, ViewMove::Cursor(_) | ViewMove::NoCursors);
                if is_of_time && self.view == View::Cycles {
                    continue;
                }
                if ui.add(Button::new(text)).on_hover_text(key).clicked() {
                    asked = Some(to);
                }
            }
            if let Some(to) = asked {
                self.go(to);
            }
        });
        self.remarks_ui(ui);
    }

    /// What a reader of the plots must know.
    fn remarks_ui(&self, ui: &mut Ui) {
        for subject in &self.subjects {
            if subject.recording.is_reading() {
                let share = 100.0 * subject.recording.share();
                quiet_ui(ui, &format!("{}: still reading {share:.0} %", subject.name));
            }
        }
        let words = match self.view {
            View::OverDepth | View::Cycles => {
                match (self.depth_lines.is_busy(), self.depth_lines.remark()) {
                    (true, _) => Some("finding the lines for this view".to_owned()),
                    (false, remark) => remark,
                }
            }
            _ if self.thinned > 1 => {
                Some(format!("thinned to min/max of {} samples", self.thinned))
            }
            _ => Some("every sample is drawn".to_owned()),
        };
        if let Some(words) = words {
            quiet_ui(ui, &words);
        }
    }

    /// The setting of the plots over time, as the session in front has it.
    fn setting(&self, front: &ReviewSubject) -> TimeBackdrop {
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
            quiet_ui(ui, "choose on the left what is shown");
            return;
        }
        let tokens = Tokens::of(ui.visuals().dark_mode);
        let width = ui.available_width();
        let scale = f64::from(ui.ctx().pixels_per_point());
        let pixels = (f64::from((width - AXIS_WIDTH).max(64.0)) * scale).round();
        // Many lines over each other share the points that a few have.
        let pixels = pixels / self.subjects.len().div_ceil(FULL_LINES) as f64;
        let window = self.time.shown();
        self.thinned = 1;
        for subject in &mut self.subjects {
            let wanted = subject.wanted(window, pixels, self.time_origin);
            for quantity in &self.quantities {
                subject.update(*quantity, wanted);
                let drawn = subject.lines[*quantity as usize].drawn();
                self.thinned = self.thinned.max(drawn.samples_per_column);
            }
            subject.update_fit(wanted);
        }
        let Some(front) = self.front() else {
            return;
        };
        let setting = self.setting(front);
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
                layers.push(TimeLayer {
                    name: &subject.name,
                    color: color_of(tokens, subject.id),
                    stretches: &subject.lines[place],
                });
            }
            if quantity == Some(Quantity::Force) && front.fitted().is_some() {
                layers.push(TimeLayer {
                    name: "fitted",
                    color: tokens.limit,
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
            self.follow(&gesture);
        }
    }

    /// Moves the time axis and the cursors as the pointer did.
    fn follow(&mut self, gesture: &Gesture) {
        if gesture.pan[0] != 0.0 {
            self.time.pan(gesture.pan[0]);
        }
        if gesture.zoom != 1.0 && gesture.zoom > 0.0 {
            self.time.zoom(gesture.zoom, self.time.at(gesture.at[0]));
        }
        if gesture.is_double {
            self.time.show_all();
        } else if let Some(is_shift) = gesture.click {
            self.cursors[usize::from(is_shift)] = Some(self.time.at(gesture.at[0]));
        }
    }

    fn over_depth_ui(&mut self, ui: &mut Ui) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        let sources: Vec<DepthSource<'_>> = self
            .subjects
            .iter()
            .map(|subject| DepthSource {
                track: &subject.recording.track,
                columns: [Quantity::Depth as usize, Quantity::Force as usize],
                rows: [0, subject.recording.track.len()],
                version: subject.fifths(),
                id: subject.id,
                color: color_of(tokens, subject.id),
            })
            .collect();
        let spans = [&self.depth, &self.force];
        self.depth_lines.update(ui.ctx(), &sources, spans, self.depth_pixels);
        let layers: Vec<DepthLayer<'_>> = self
            .subjects
            .iter()
            .rev()
            .map(|subject| DepthLayer {
                name: &subject.name,
                color: color_of(tokens, subject.id),
                id: subject.id,
                cursors: self.cursors.map(|cursor| {
                    let track = &subject.recording.track;
                    let place = track.place(cursor? + subject.shift(self.time_origin))?;
                    let value = |quantity: Quantity| track.value(quantity as usize, place);
                    Some([value(Quantity::Depth)?, value(Quantity::Force)?])
                }),
            })
            .collect();
        let drawn = over_depth_ui(ui, &self.depth_lines, &layers, spans);
        self.follow_over_depth(drawn);
    }

    /// Moves the axes of depth and force as the pointer did in a plot of so many pixels.
    pub(super) fn follow_over_depth(&mut self, (gesture, pixels): (Gesture, [f64; 2])) {
        self.depth_pixels = pixels;
        for (axis, span) in [&mut self.depth, &mut self.force].into_iter().enumerate() {
            if gesture.pan[axis] != 0.0 {
                span.pan(gesture.pan[axis]);
            }
            if gesture.zoom != 1.0 && gesture.zoom > 0.0 {
                span.zoom(gesture.zoom, span.at(gesture.at[axis]));
            }
            if gesture.is_double {
                span.show_all();
            }
        }
    }
}

/// A heading with a line of words below it.
pub(super) fn head_ui(ui: &mut Ui, title: &str, words: &str) {
    ui.label(RichText::new(title).heading().strong());
    if !words.is_empty() {
        ui.add(Label::new(words).wrap());
    }
}
