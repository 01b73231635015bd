//! The state as word, shape and colour in one box.

use crate::shell::activity::{Activity, Shape, StateTone};
use crate::theme::Tokens;
use eframe::egui::{
    Align2, Color32, CornerRadius, FontId, Painter, Pos2, Rect, Role, Sense, Shape as Ink, Stroke,
    StrokeKind, Ui, WidgetInfo, pos2, vec2,
};

/// Draws the badge at a size in points.
pub fn badge_ui(ui: &mut Ui, activity: &Activity, size: eframe::egui::Vec2) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let (fill, ink) = match activity.tone {
        StateTone::Quiet => (tokens.control, tokens.text),
        StateTone::Active => (tokens.active_fill, tokens.on_active),
        StateTone::Notice => (tokens.notice_fill, tokens.on_notice),
        StateTone::Alarm => (tokens.alarm_fill, tokens.on_alarm),
    };
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| {
        WidgetInfo::labeled(Role::Label, true, format!("State: {}", activity.word))
    });
    let painter = ui.painter();
    painter.rect(
        rect,
        CornerRadius::same(4),
        fill,
        Stroke::new(1.0, tokens.line),
        StrokeKind::Inside,
    );
    let center = pos2(rect.left() + 22.0, rect.center().y);
    shape_at(painter, activity.shape, center, ink);
    painter.text(
        pos2(rect.left() + 40.0, rect.center().y),
        Align2::LEFT_CENTER,
        &activity.word,
        FontId::proportional(16.0),
        ink,
    );
}

/// Draws a shape of about 16 points.
fn shape_at(painter: &Painter, shape: Shape, center: Pos2, ink: Color32) {
    let r = 8.0;
    let at = |x: f32, y: f32| center + vec2(x * r, y * r);
    match shape {
        Shape::Ring => {
            painter.circle_stroke(center, r - 1.0, Stroke::new(2.0, ink));
        }
        Shape::Square => {
            let rect = Rect::from_center_size(center, vec2(1.7 * r, 1.7 * r));
            painter.rect_filled(rect, CornerRadius::ZERO, ink);
        }
        Shape::Bars => {
            for x in [-0.85, 0.25] {
                let bar = Rect::from_min_max(at(x, -0.9), at(x + 0.6, 0.9));
                painter.rect_filled(bar, CornerRadius::ZERO, ink);
            }
        }
        Shape::Question => {
            let font = FontId::proportional(22.0);
            painter.text(center, Align2::CENTER_CENTER, "?", font, ink);
        }
        Shape::Triangle => {
            let corners = vec![at(-0.8, -1.0), at(1.0, 0.0), at(-0.8, 1.0)];
            painter.add(Ink::convex_polygon(corners, ink, Stroke::NONE));
        }
        Shape::Diamond => {
            let corners = vec![at(0.0, -1.1), at(1.1, 0.0), at(0.0, 1.1), at(-1.1, 0.0)];
            painter.add(Ink::convex_polygon(corners, ink, Stroke::NONE));
        }
    }
}
