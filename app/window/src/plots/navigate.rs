//! The part of an axis that is shown, moved by pointer, wheel, keys and buttons.

use eframe::egui::{Response, Ui};

/// Factor by which a key or a button zooms.
pub const ZOOM_STEP: f64 = 2.0;
/// Share of what is shown by which a key or a button moves.
pub const PAN_STEP: f64 = 0.25;
/// Points of scrolling that zoom by a factor of e.
const SCROLL_POINTS: f64 = 200.0;
/// Least share of the whole that can be shown, far below one sample of a day.
const LEAST_SHARE: f64 = 1e-9;

/// A stretch of an axis and the whole it is a part of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisRange {
    whole: [f64; 2],
    /// The part shown; none while that is the whole.
    part: Option<[f64; 2]>,
}

impl Default for AxisRange {
    fn default() -> Self {
        Self { whole: [0.0, 1.0], part: None }
    }
}

impl AxisRange {
    /// Sets the whole; the part that is shown stays.
    pub fn set_whole(&mut self, [low, high]: [f64; 2]) {
        if low.is_finite() && high.is_finite() {
            self.whole = [low, if high > low { high } else { low + 1.0 }];
        }
    }

    pub fn shown(&self) -> [f64; 2] {
        self.part.unwrap_or(self.whole)
    }

    pub fn show_all(&mut self) {
        self.part = None;
    }

    /// Shows a stretch; one without length is not shown.
    pub fn show(&mut self, part: [f64; 2]) {
        let length = self.whole[1] - self.whole[0];
        let own = part[1] - part[0];
        if part.iter().all(|end| end.is_finite()) && own >= LEAST_SHARE * length {
            // Something of the whole stays in sight.
            let back = (part[0] - self.whole[1] + 0.05 * own).max(0.0)
                + (part[1] - self.whole[0] - 0.05 * own).min(0.0);
            self.part = Some(part.map(|end| end - back));
        }
    }

    /// Shows `factor` times less of it around a place; not less than a share of the whole, nor twice of it.
    pub fn zoom(&mut self, factor: f64, about: f64) {
        let [low, high] = self.shown();
        let length = self.whole[1] - self.whole[0];
        let own = ((high - low) / factor).clamp(LEAST_SHARE * length, 2.0 * length);
        let factor = (high - low) / own;
        self.show([low, high].map(|end| about + (end - about) / factor));
    }

    /// Moves by a share of what is shown.
    pub fn pan(&mut self, share: f64) {
        let [low, high] = self.shown();
        let by = share * (high - low);
        self.show([low + by, high + by]);
    }

    /// Zooms and moves as the pointer did along an axis of a plot: 0 across, 1 up. A double click shows all.
    pub fn follow(&mut self, gesture: &Gesture, axis: usize) {
        if gesture.pan[axis] != 0.0 {
            self.pan(gesture.pan[axis]);
        }
        if gesture.zoom != 1.0 && gesture.zoom > 0.0 {
            self.zoom(gesture.zoom, self.at(gesture.at[axis]));
        }
        if gesture.is_double {
            self.show_all();
        }
    }

    /// The place at a share of what is shown.
    pub fn at(&self, share: f64) -> f64 {
        let [low, high] = self.shown();
        low + share * (high - low)
    }
}

/// What the pointer did in a plot, as shares of its width and height, up and to the right.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gesture {
    pub pan: [f64; 2],
    pub zoom: f64,
    /// Where the pointer was.
    pub at: [f64; 2],
    /// A click, with Shift or without.
    pub click: Option<bool>,
    pub is_double: bool,
}

/// Reads drag, wheel, pinch and clicks in a plot.
#[must_use]
pub fn gesture(ui: &Ui, response: &Response) -> Gesture {
    let rect = response.rect;
    let size = [rect.width(), rect.height()].map(|side| f64::from(side.max(1.0)));
    let mut found = Gesture { zoom: 1.0, ..Gesture::default() };
    let place = response.hover_pos().or(response.interact_pointer_pos());
    if let Some(place) = place {
        let from = [place.x - rect.left(), rect.bottom() - place.y];
        found.at = [f64::from(from[0]) / size[0], f64::from(from[1]) / size[1]];
    }
    if response.dragged() {
        let by = response.drag_delta();
        found.pan = [-f64::from(by.x) / size[0], f64::from(by.y) / size[1]];
    }
    if response.hovered() {
        let (wheel, pinch) = ui.input(|input| (input.smooth_scroll_delta(), input.zoom_delta()));
        found.pan[0] -= f64::from(wheel.x) / size[0];
        found.zoom = (f64::from(wheel.y) / SCROLL_POINTS).exp() * f64::from(pinch);
    }
    if response.clicked() {
        found.click = Some(ui.input(|input| input.modifiers.shift));
    }
    found.is_double = response.double_clicked();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_place_under_the_pointer_stays_where_it_is() {
        let mut span = AxisRange::default();
        span.set_whole([0.0, 100.0]);
        assert_eq!(span.shown(), [0.0, 100.0]);
        span.zoom(4.0, 20.0);
        assert_eq!(span.shown(), [15.0, 40.0]);
        span.pan(1.0);
        assert_eq!(span.shown(), [40.0, 65.0]);
        // More of the session arrives: what is looked at stays.
        span.set_whole([0.0, 500.0]);
        assert_eq!(span.shown(), [40.0, 65.0]);
        span.show_all();
        assert_eq!(span.shown(), [0.0, 500.0]);
        assert!((span.at(0.5) - 250.0).abs() < 1e-9);
    }

    #[test]
    fn nothing_is_lost_out_of_sight() {
        let mut span = AxisRange::default();
        span.set_whole([10.0, 20.0]);
        for _ in 0..200 {
            span.pan(0.7);
        }
        assert!(span.shown()[0] < 20.0, "{:?}", span.shown());
        for _ in 0..400 {
            span.pan(-0.7);
        }
        assert!(span.shown()[1] > 10.0, "{:?}", span.shown());
        for _ in 0..200 {
            span.zoom(0.1, 15.0);
        }
        let [low, high] = span.shown();
        assert!(high - low <= 20.0 + 1e-9);
        for _ in 0..200 {
            span.zoom(10.0, 15.0);
        }
        let [low, high] = span.shown();
        assert!(high > low && high - low < 1e-6);
        let before = span;
        span.show([f64::NAN, 3.0]);
        span.set_whole([f64::NAN, f64::NAN]);
        assert_eq!(span, before);
        span.set_whole([7.0, 7.0]);
        span.show_all();
        assert_eq!(span.shown(), [7.0, 8.0]);
    }
}
