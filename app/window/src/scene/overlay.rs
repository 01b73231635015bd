//! What is painted above the picture: the contact point, the force with its size in words, the legend.

use super::camera::{Lens, along};
use super::view::ScenePicture;
use crate::theme::Tokens;
use eframe::egui::epaint::Mesh;
use eframe::egui::{Align2, FontId, Painter, Pos2, Rect, Shape, Stroke, pos2, vec2};
use palpate_figures::tokens::viridis;
use palpate_tissue_view::Legend;

/// The force whose arrow is as long as a quarter of the scene, in N: what an Omni-class device gives at most.
const ARROW_NEWTONS: f64 = 3.3;
/// Forces below this have no arrow, in N.
const ARROW_MIN: f64 = 0.005;
/// Radius of the contact point in lengths of the scene.
const CONTACT: f64 = 0.012;
/// Size of the colour bar, and its distance from the edges.
const BAR: [f32; 2] = [12.0, 160.0];
const EDGE: f32 = 12.0;
/// Room for the numbers beside the bar.
const NUMBERS: f32 = 40.0;

/// Paints with the colours and the letters of the window.
pub struct OverlayPainter<'a> {
    pub painter: &'a Painter,
    pub tokens: &'a Tokens,
    pub font: FontId,
}

impl OverlayPainter<'_> {
    /// The contact point on the surface at rest as a ring, and the force from there. `side_mm`: of the scene.
    pub fn touch(&self, lens: &Lens, shown: &ScenePicture, side_mm: f64) {
        if let Some(seen) = shown.contact.and_then(|contact| lens.see(contact)) {
            let radius = (CONTACT * side_mm * lens.points_per_mm(seen.distance)).max(3.0) as f32;
            // A light line on a dark one is seen before any colour.
            for (width, ink) in [(4.0, self.tokens.text), (1.5, self.tokens.canvas)] {
                self.painter.circle_stroke(seen.at, radius, Stroke::new(width, ink));
            }
        }
        let [x, y, z] = shown.force;
        let newtons = x.hypot(y).hypot(z);
        if newtons.is_nan() || newtons < ARROW_MIN {
            return;
        }
        let from = shown.contact.unwrap_or(shown.device);
        let to = along(from, shown.force, side_mm / 4.0 / ARROW_NEWTONS);
        if let (Some(from), Some(to)) = (lens.see(from), lens.see(to)) {
            self.painter.arrow(from.at, to.at - from.at, Stroke::new(3.0, self.tokens.limit));
            self.label(to.at + vec2(8.0, 0.0), &format!("{newtons:.2} N"));
        }
    }

    /// Words on a ground of their own, so that they are readable before anything.
    fn label(&self, at: Pos2, words: &str) {
        let ink = self.tokens.text;
        let text = self.painter.layout_no_wrap(words.to_owned(), self.font.clone(), ink);
        let rect = Align2::LEFT_CENTER.anchor_size(at, text.size());
        self.painter.rect_filled(rect.expand(3.0), 2.0, self.tokens.canvas);
        self.painter.galley(rect.min, text, ink);
    }

    /// The colours and what they stand for, the least at the top as depth goes down.
    pub fn legend(&self, rect: Rect, legend: &Legend) {
        let [wide, high] = [BAR[0], BAR[1].min(rect.height() - 4.0 * EDGE)];
        let top = pos2(rect.right() - EDGE - wide - NUMBERS, rect.top() + 2.5 * EDGE);
        let mut mesh = Mesh::default();
        const STEPS: u32 = 64;
        for step in 0..=STEPS {
            let share = step as f32 / STEPS as f32;
            let y = top.y + share * high;
            mesh.colored_vertex(pos2(top.x, y), viridis(share));
            mesh.colored_vertex(pos2(top.x + wide, y), viridis(share));
            if step > 0 {
                let first = 2 * (step - 1);
                mesh.add_triangle(first, first + 1, first + 2);
                mesh.add_triangle(first + 1, first + 3, first + 2);
            }
        }
        self.painter.add(Shape::mesh(mesh));
        let text = |at: Pos2, align: Align2, words: &str| {
            self.painter.text(at, align, words, self.font.clone(), self.tokens.text_quiet);
        };
        text(pos2(rect.right() - EDGE, rect.top() + EDGE), Align2::RIGHT_CENTER, &legend.title);
        for tick in &legend.ticks {
            let at = pos2(top.x + wide + 6.0, top.y + tick.share as f32 * high);
            text(at, Align2::LEFT_CENTER, &tick.text);
        }
    }
}
