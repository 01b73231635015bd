//! Small shapes that stand before a word, so that a state is more than a colour.

use eframe::egui::{
    Align2, Color32, CornerRadius, FontId, Painter, Pos2, Rect, Shape, Stroke, vec2,
};

/// A shape of about ten points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Glyph {
    /// Good.
    Tick,
    /// Bad.
    Cross,
    /// Doubtful.
    Question,
    /// To be done again.
    Repeat,
    /// Damaged.
    Diamond,
    /// Whole.
    Disc,
    /// Not finished.
    Half,
    /// Nothing said.
    Dash,
    /// Sorted downwards.
    Down,
    /// Sorted upwards.
    Up,
}

/// Space that a mark takes, in points.
pub const WIDTH: f32 = 16.0;

/// Draws the mark around its centre.
pub fn glyph_at(painter: &Painter, mark: Glyph, center: Pos2, ink: Color32) {
    let r = 4.0;
    let at = |x: f32, y: f32| center + vec2(x * r, y * r);
    let stroke = Stroke::new(1.8, ink);
    let line = |points: &[(f32, f32)]| {
        Shape::line(points.iter().map(|&(x, y)| at(x, y)).collect(), stroke)
    };
    let area = |points: &[(f32, f32)]| {
        let points = points.iter().map(|&(x, y)| at(x, y)).collect();
        Shape::convex_polygon(points, ink, Stroke::NONE)
    };
    match mark {
        Glyph::Tick => {
            painter.add(line(&[(-1.1, 0.1), (-0.3, 0.9), (1.1, -0.9)]));
        }
        Glyph::Cross => {
            painter.add(line(&[(-0.9, -0.9), (0.9, 0.9)]));
            painter.add(line(&[(-0.9, 0.9), (0.9, -0.9)]));
        }
        Glyph::Question => {
            let font = FontId::proportional(14.0);
            painter.text(center, Align2::CENTER_CENTER, "?", font, ink);
        }
        Glyph::Repeat => {
            painter.add(line(&[(-0.9, -0.3), (-0.9, 0.9), (0.9, 0.9), (0.9, -0.5), (0.0, -0.5)]));
            painter.add(area(&[(0.2, -1.2), (0.2, 0.2), (-0.7, -0.5)]));
        }
        Glyph::Diamond => {
            painter.add(area(&[(-1.2, 0.0), (0.0, -1.2), (1.2, 0.0), (0.0, 1.2)]));
        }
        Glyph::Disc => {
            painter.circle_filled(center, r, ink);
        }
        Glyph::Half => {
            painter.circle_stroke(center, r, Stroke::new(1.4, ink));
            let half = Rect::from_min_max(at(-0.9, 0.0), at(0.9, 0.9));
            painter.rect_filled(half, CornerRadius::same(3), ink);
        }
        Glyph::Dash => {
            painter.add(line(&[(-0.9, 0.0), (0.9, 0.0)]));
        }
        Glyph::Down => {
            painter.add(area(&[(-1.0, -0.6), (1.0, -0.6), (0.0, 0.8)]));
        }
        Glyph::Up => {
            painter.add(area(&[(-1.0, 0.6), (1.0, 0.6), (0.0, -0.8)]));
        }
    }
}
