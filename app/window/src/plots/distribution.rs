//! Values of one parameter as dots with their intervals, a lane for each group and in it a line for each value, so that
//! no dot covers another.

use crate::widgets::{in_print, tokens_of};
use eframe::egui::{
    Align2, Color32, Id, Rect, Role, Sense, Stroke, TextStyle, Ui, WidgetInfo, pos2, vec2,
};
use palpate_figures::drawing::round_up;

/// Least and usual height of a value's line, and of what a lane has around its values, in points.
const LINE: [f32; 2] = [5.5, 9.0];
const LANE_ROOM: f32 = 9.0;
/// Height of the numbers below.
const NUMBERS: f32 = 20.0;
/// Usual distance of two numbers, the least gap between them, and room around the dots at the edges.
const NUMBER: f32 = 30.0;
const GAP: f32 = 6.0;
const EDGE: f32 = 8.0;
const RADIUS: f32 = 3.5;
const ARROW: f32 = 3.0;
/// Part of the width of all values that an interval may add on either side; wider ones are cut.
const INTERVAL_SHARE: f64 = 2.5;

/// A value.
pub struct DistributionDot {
    pub value: f64,
    /// Its interval, if it has one.
    pub ends: Option<[f64; 2]>,
    pub color: Color32,
    pub is_front: bool,
    /// Beyond what the others of its lane suggest.
    pub is_outlier: bool,
    /// Read aloud and shown under the pointer.
    pub words: String,
}

/// The values of a group and their median.
#[derive(Default)]
pub struct DistributionLane {
    pub dots: Vec<DistributionDot>,
    pub median: Option<f64>,
}

/// Height of a lane of so many values, whose lines have a height.
#[must_use]
pub fn lane_height(count: usize, line: f32) -> f32 {
    count.max(1) as f32 * line + LANE_ROOM
}

/// Height of lanes of so many values with the numbers below.
#[must_use]
pub fn height(counts: impl Iterator<Item = usize>, line: f32) -> f32 {
    counts.map(|count| lane_height(count, line)).sum::<f32>() + NUMBERS
}

/// Height of a line with which lanes fit into a room, as far as dots stay distinct.
#[must_use]
pub fn line_height(counts: impl Iterator<Item = usize> + Clone, room: f32) -> f32 {
    let lines: usize = counts.clone().map(|count| count.max(1)).sum();
    let own = (room - height(counts, 0.0)) / lines.max(1) as f32;
    own.clamp(LINE[0], LINE[1])
}

/// Lower and upper end of all values, with their intervals where these are not much wider.
fn span(lanes: &[DistributionLane]) -> Option<[f64; 2]> {
    let dots = || lanes.iter().flat_map(|lane| &lane.dots);
    let ends = |values: &mut dyn Iterator<Item = f64>| {
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], one| {
            [low.min(one), high.max(one)]
        })
    };
    let [low, high] = ends(&mut dots().map(|dot| dot.value));
    if !(low.is_finite() && high.is_finite()) {
        return None;
    }
    let wide = ends(&mut dots().filter_map(|dot| dot.ends).flatten().filter(|end| end.is_finite()));
    let width = (high - low).max(1e-3 * low.abs().max(high.abs())).max(1e-12);
    let room = INTERVAL_SHARE * width;
    Some([
        wide[0].clamp(low - room, low - 0.04 * width),
        wide[1].clamp(high + 0.04 * width, high + room),
    ])
}

/// Draws the lanes of a parameter into a place; returns the lane and the number of a dot that was clicked.
pub fn distribution_ui(
    ui: &mut Ui,
    id: Id,
    place: Rect,
    line: f32,
    lanes: &[DistributionLane],
) -> Option<[usize; 2]> {
    let tokens = tokens_of(ui);
    let [low, high] = span(lanes)?;
    let inner = place.shrink2(vec2(EDGE, 0.0));
    let across = |value: f64| {
        let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
        inner.left() + share as f32 * inner.width()
    };
    let ground = Rect::from_min_max(place.min, pos2(place.right(), place.bottom() - NUMBERS));
    ui.painter().rect_filled(ground, 2.0, tokens.panel);
    numbers_ui(ui, [low, high], ground, &across);
    let (mut top, mut clicked) = (ground.top(), None);
    for (number, lane) in lanes.iter().enumerate() {
        let below = top + lane_height(lane.dots.len(), line);
        if number > 0 {
            ui.painter().hline(ground.x_range(), top, Stroke::new(1.0, tokens.line));
        }
        if let Some(median) = lane.median {
            let stroke = Stroke::new(1.5, tokens.text_quiet);
            ui.painter().vline(across(median), top + 2.0..=below - 2.0, stroke);
        }
        for (index, dot) in lane.dots.iter().enumerate() {
            if !dot.value.is_finite() {
                continue;
            }
            let y = top + 0.5 * LANE_ROOM + (index as f32 + 0.5) * line;
            let at = pos2(across(dot.value), y);
            let own = Rect::from_center_size(at, vec2(3.0 * RADIUS, line));
            let response = ui.interact(own, id.with((number, index)), Sense::CLICK);
            response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &dot.words));
            if let Some([from, to]) = dot.ends {
                let stroke = Stroke::new(if dot.is_front { 2.5 } else { 1.5 }, dot.color);
                ui.painter().hline(across(from)..=across(to), y, stroke);
                // An interval that goes on beyond the strip ends in an arrow.
                let beyond = [(from < low, inner.left(), -1.0), (to > high, inner.right(), 1.0)];
                for (_, x, way) in beyond.into_iter().filter(|(is_beyond, ..)| *is_beyond) {
                    let tip = pos2(x + way * (EDGE - 2.0), y);
                    for side in [-ARROW, ARROW] {
                        let end = tip - vec2(way * ARROW, side);
                        ui.painter().line_segment([tip, end], stroke);
                    }
                    ui.painter().hline(x..=tip.x, y, stroke);
                }
            }
            let radius = RADIUS.min(0.5 * line + 0.5);
            let radius = if response.hovered() { radius + 1.5 } else { radius };
            ui.painter().circle_filled(at, radius, dot.color);
            if dot.is_outlier || dot.is_front {
                let ink = if dot.is_outlier { tokens.alarm_text } else { tokens.text };
                ui.painter().circle_stroke(at, radius + 1.5, Stroke::new(1.5, ink));
            }
            if response.on_hover_text(&dot.words).clicked() {
                clicked = Some([number, index]);
            }
        }
        top = below;
    }
    clicked
}

/// Draws round numbers along the lower edge and lines up from them.
fn numbers_ui(ui: &Ui, [low, high]: [f64; 2], ground: Rect, across: &dyn Fn(f64) -> f32) {
    let tokens = tokens_of(ui);
    let font = TextStyle::Small.resolve(ui.style());
    let marks = |count: f64| {
        let step = round_up((high - low) / count);
        let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
        let mark = |mark: i64| {
            let value = mark as f64 * step;
            let text = in_print(&number_text(value, step));
            let galley = ui.painter().layout_no_wrap(text, font.clone(), tokens.text_quiet);
            let at = pos2(across(value), ground.bottom() + 2.0);
            let mut own = Align2::CENTER_TOP.anchor_size(at, galley.size());
            // A number at an edge moves inwards.
            let over =
                (own.right() - ground.right()).max(0.0) - (ground.left() - own.left()).max(0.0);
            own = own.translate(vec2(-over, 0.0));
            (at.x, own, galley)
        };
        (first..=last).map(mark).collect::<Vec<_>>()
    };
    let has_room = |marks: &[(f32, Rect, _)]| {
        marks.windows(2).all(|two| two[0].1.right() + GAP < two[1].1.left())
    };
    // The finest step whose numbers stand apart; without two such, the first and the last of a coarse one.
    let most = (ground.width() / NUMBER).ceil().clamp(2.0, 6.0) as u32;
    let mut counts = (2..=most).rev().map(|count| marks(f64::from(count)));
    let found = counts.find(|marks| marks.len() > 1 && has_room(marks));
    let coarse = || (2..=most).map(|count| marks(f64::from(count))).find(|marks| marks.len() > 1);
    let found = found.or_else(coarse).unwrap_or_else(|| marks(1.0));
    let last = found.len().saturating_sub(1);
    let is_tight = !has_room(&found);
    for (number, (x, own, galley)) in found.into_iter().enumerate() {
        ui.painter().vline(x, ground.y_range(), Stroke::new(1.0, tokens.line));
        if !is_tight || number == 0 || number == last {
            ui.painter().galley(own.min, galley, tokens.text_quiet);
        }
    }
}

/// A multiple of a step with as many digits as tell it from the next.
fn number_text(value: f64, step: f64) -> String {
    let place = |one: f64| (one.abs().log10() + 1e-9).floor();
    let decimals = (-place(step)).max(0.0) as usize;
    if decimals <= 4 || value == 0.0 {
        return format!("{value:.*}", decimals.min(4));
    }
    format!("{value:.*e}", (place(value) - place(step)).max(0.0) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::theme::Tokens;

    #[test]
    fn neighbouring_numbers_differ() {
        let of = |marks: [i32; 3], step: f64| marks.map(|n| number_text(f64::from(n) * step, step));
        assert_eq!(of([6, 7, 8], 5e-5), ["3.0e-4", "3.5e-4", "4.0e-4"]);
        assert_eq!(of([-1, 0, 1], 1e-5), ["-1e-5", "0.0000", "1e-5"]);
        assert_eq!(of([19, 20, 21], 0.05), ["0.95", "1.00", "1.05"]);
        assert_eq!(of([1, 2, 3], 10.0), ["10", "20", "30"]);
    }

    fn dot(value: f64, ends: Option<[f64; 2]>) -> DistributionDot {
        let color = Tokens::of(false).series;
        let words = String::new();
        DistributionDot { value, ends, color, is_front: false, is_outlier: false, words }
    }

    #[test]
    fn lines_become_lower_where_there_is_little_room_and_stay_apart() {
        let counts = [8, 5].into_iter();
        let line = line_height(counts.clone(), 120.0);
        assert!((height(counts.clone(), line) - 120.0).abs() < 1e-3 && line > LINE[0]);
        assert_eq!(line_height(counts.clone(), 1e3), LINE[1]);
        assert_eq!(line_height(counts, 10.0), LINE[0]);
    }

    #[test]
    fn intervals_are_in_the_picture_unless_they_would_flatten_the_values() {
        let lane = |dots| DistributionLane { dots, median: None };
        let near = lane(vec![dot(1.0, Some([0.9, 1.1])), dot(2.0, Some([1.9, 2.2]))]);
        assert_eq!(span(&[near]), Some([0.9, 2.2]));
        let wide = lane(vec![dot(1.0, Some([-1e9, 1e9])), dot(2.0, None)]);
        assert_eq!(span(&[wide]), Some([1.0 - INTERVAL_SHARE, 2.0 + INTERVAL_SHARE]));
        assert_eq!(span(&[lane(vec![dot(f64::NAN, None)])]), None);
        let [low, high] = span(&[lane(vec![dot(5.0, None)])]).unwrap();
        assert!(low < 5.0 && high > 5.0);
    }
}
