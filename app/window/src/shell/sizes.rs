//! How wide the panels beside the middle are and how high the event log: dragged at their edges, or by name.

use crate::widgets::tokens_of;
use eframe::egui::{CursorIcon, Id, Panel, Rect, Response, Sense, Stroke, Ui};

palpate_model::named! {
    /// A panel whose size can be changed.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum PanelEdge {
        Left = "left panel",
        Right = "right panel",
        Log = "event log",
    }
}

impl PanelEdge {
    /// Smallest, usual and largest size in points: the rows of the forms are made for the usual one, what is smaller
    /// cuts them, and the plots of the smallest window are to stay wider than a panel.
    const fn sizes(self) -> [f32; 3] {
        match self {
            Self::Left => [300.0, 330.0, 480.0],
            Self::Right => [300.0, 340.0, 480.0],
            Self::Log => [70.0, 134.0, 320.0],
        }
    }
}

/// By how much a command by name changes a size, in points.
pub const STEP: f32 = 40.0;

/// Half the width in points of what can be dragged.
const GRIP: f32 = 3.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes([f32; 3]);

impl Default for Sizes {
    fn default() -> Self {
        Self(PanelEdge::ALL.map(|edge| edge.sizes()[1]))
    }
}

impl Sizes {
    /// The usual sizes where there is none.
    #[must_use]
    pub fn from_changes(sizes: [Option<f32>; 3]) -> Self {
        let mut all = Self::default();
        for (edge, size) in PanelEdge::ALL.into_iter().zip(sizes) {
            all.set(edge, size.unwrap_or(f32::NAN));
        }
        all
    }

    /// Size of one in points.
    pub fn get(&self, edge: PanelEdge) -> f32 {
        self.0[edge as usize]
    }

    fn set(&mut self, edge: PanelEdge, size: f32) {
        let [least, usual, most] = edge.sizes();
        let size = if size.is_finite() { size } else { usual };
        self.0[edge as usize] = size.clamp(least, most);
    }

    /// Makes one larger by so many points, or smaller.
    pub fn grow(&mut self, edge: PanelEdge, by: f32) {
        self.set(edge, self.get(edge) + by);
    }

    /// Sizes in points; none for the usual ones.
    pub fn changes(&self) -> [Option<f32>; 3] {
        PanelEdge::ALL.map(|edge| Some(self.get(edge)).filter(|size| *size != edge.sizes()[1]))
    }

    /// A panel of this size.
    pub fn of(&self, edge: PanelEdge, panel: Panel) -> Panel {
        panel.exact_size(self.get(edge)).resizable(false)
    }

    /// Lets the edge towards the middle be dragged; a double click makes the size the usual one.
    pub fn drag(&mut self, ui: &Ui, edge: PanelEdge, panel: Rect) {
        let id = Id::unique(("panel edge", edge.name()));
        let near = match edge {
            PanelEdge::Left => Rect::from_x_y_ranges(around(panel.right()), panel.y_range()),
            PanelEdge::Right => Rect::from_x_y_ranges(around(panel.left()), panel.y_range()),
            PanelEdge::Log => Rect::from_x_y_ranges(panel.x_range(), around(panel.top())),
        };
        let grip = ui.interact(near, id, Sense::click_and_drag());
        let moved = grip.drag_delta();
        match edge {
            PanelEdge::Left => self.grow(edge, moved.x),
            PanelEdge::Right => self.grow(edge, -moved.x),
            PanelEdge::Log => self.grow(edge, -moved.y),
        }
        if grip.double_clicked() {
            self.set(edge, f32::NAN);
        }
        shown(ui, edge, near, &grip);
    }
}

fn around(place: f32) -> std::ops::RangeInclusive<f32> {
    place - GRIP..=place + GRIP
}

/// Shows that an edge can be dragged while the pointer is there.
fn shown(ui: &Ui, edge: PanelEdge, near: Rect, grip: &Response) {
    if !(grip.hovered() || grip.dragged()) {
        return;
    }
    let (icon, line) = match edge {
        PanelEdge::Log => (CursorIcon::ResizeVertical, [near.left_center(), near.right_center()]),
        _ => (CursorIcon::ResizeHorizontal, [near.center_top(), near.center_bottom()]),
    };
    ui.ctx().set_cursor_icon(icon);
    let tokens = tokens_of(ui);
    ui.painter().line_segment(line, Stroke::new(2.0, tokens.text_quiet));
}

#[cfg(test)]
mod tests {
    use super::{PanelEdge, STEP, Sizes};

    #[test]
    fn sizes_stay_within_their_bounds_and_the_usual_ones_are_not_changes() {
        let mut sizes = Sizes::from_changes([None, Some(1.0), Some(f32::NAN)]);
        assert_eq!(sizes.changes(), [None, Some(300.0), None]);
        sizes.grow(PanelEdge::Left, 1e9);
        sizes.grow(PanelEdge::Log, -1e9);
        assert_eq!(sizes.changes(), [Some(480.0), Some(300.0), Some(70.0)]);
        sizes.grow(PanelEdge::Left, -STEP);
        assert_eq!(Sizes::from_changes(sizes.changes()), sizes);
    }
}
