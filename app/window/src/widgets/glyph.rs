//! Small shapes that stand before a word, so that a state is more than a colour; the state badge and the list of steps.

use super::text::{announce, tokens_of};
use crate::shell::activity::{Activity, StateTone};
use eframe::egui::accesskit::Live;
use eframe::egui::{
    Align2, Color32, CornerRadius, FontId, Painter, Pos2, Rect, Role, Sense, Shape, Stroke,
    StrokeKind, Ui, Vec2, WidgetInfo, pos2, vec2,
};

/// A shape that is drawn without a font.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Glyph {
    Bars,
    Cross,
    Dash,
    Diamond,
    Disc,
    Down,
    Half,
    Question,
    Repeat,
    Ring,
    Square,
    Tick,
    Triangle,
    Up,
}

/// Space in points that a glyph takes before a word.
pub const GLYPH_WIDTH: f32 = 16.0;
/// Radius in points of a glyph before a word.
pub const GLYPH_RADIUS: f32 = 4.0;

/// Corners in radii from the centre, x to the right and y down.
type Corners<'a> = &'a [(f32, f32)];

/// Draws a glyph around its centre.
pub fn glyph_at(painter: &Painter, glyph: Glyph, center: Pos2, r: f32, ink: Color32) {
    let (lines, areas): (&[Corners<'_>], &[Corners<'_>]) = match glyph {
        Glyph::Bars => (
            &[],
            &[
                &[(-0.85, -0.9), (-0.25, -0.9), (-0.25, 0.9), (-0.85, 0.9)],
                &[(0.25, -0.9), (0.85, -0.9), (0.85, 0.9), (0.25, 0.9)],
            ],
        ),
        Glyph::Cross => (&[&[(-0.9, -0.9), (0.9, 0.9)], &[(-0.9, 0.9), (0.9, -0.9)]], &[]),
        Glyph::Dash => (&[&[(-0.9, 0.0), (0.9, 0.0)]], &[]),
        Glyph::Diamond => (&[], &[&[(-1.2, 0.0), (0.0, -1.2), (1.2, 0.0), (0.0, 1.2)]]),
        Glyph::Down => (&[], &[&[(-1.0, -0.6), (1.0, -0.6), (0.0, 0.8)]]),
        Glyph::Repeat => (
            &[&[(-0.9, -0.3), (-0.9, 0.9), (0.9, 0.9), (0.9, -0.5), (0.0, -0.5)]],
            &[&[(0.2, -1.2), (0.2, 0.2), (-0.7, -0.5)]],
        ),
        Glyph::Square => (&[], &[&[(-0.85, -0.85), (0.85, -0.85), (0.85, 0.85), (-0.85, 0.85)]]),
        Glyph::Tick => (&[&[(-1.1, 0.1), (-0.3, 0.9), (1.1, -0.9)]], &[]),
        Glyph::Triangle => (&[], &[&[(-0.8, -1.0), (1.0, 0.0), (-0.8, 1.0)]]),
        Glyph::Up => (&[], &[&[(-1.0, 0.6), (1.0, 0.6), (0.0, -0.8)]]),
        Glyph::Disc | Glyph::Half | Glyph::Question | Glyph::Ring => (&[], &[]),
    };
    let stroke = Stroke::new(1.8, ink);
    let placed =
        |corners: Corners<'_>| corners.iter().map(|&(x, y)| center + vec2(x * r, y * r)).collect();
    painter.extend(lines.iter().map(|line| Shape::line(placed(line), stroke)));
    painter.extend(areas.iter().map(|area| Shape::convex_polygon(placed(area), ink, Stroke::NONE)));
    match glyph {
        Glyph::Disc => {
            painter.circle_filled(center, r, ink);
        }
        Glyph::Half => {
            painter.circle_stroke(center, r, stroke);
            let half = Rect::from_min_max(center - vec2(0.9 * r, 0.0), center + vec2(0.9, 0.9) * r);
            painter.rect_filled(half, CornerRadius::same(3), ink);
        }
        Glyph::Question => {
            let font = FontId::proportional(2.0 * r + 6.0);
            painter.text(center, Align2::CENTER_CENTER, "?", font, ink);
        }
        Glyph::Ring => {
            painter.circle_stroke(center, 0.9 * r, stroke);
        }
        _ => {}
    }
}

/// Draws the state as word, glyph and colour in one box of a size in points.
pub fn badge_ui(ui: &mut Ui, activity: &Activity, size: Vec2) {
    let tokens = tokens_of(ui);
    let (fill, ink) = match activity.tone {
        StateTone::Quiet => (tokens.control, tokens.text),
        StateTone::Active => (tokens.active_fill, tokens.on_active),
        StateTone::Notice => (tokens.notice_fill, tokens.on_notice),
        StateTone::Alarm => (tokens.alarm_fill, tokens.on_alarm),
    };
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let name = format!("State: {}", activity.word);
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &name));
    announce(&response, Live::Assertive);
    let (painter, border) = (ui.painter(), Stroke::new(1.0, tokens.line));
    painter.rect(rect, CornerRadius::same(4), fill, border, StrokeKind::Inside);
    let left = rect.left_center();
    glyph_at(painter, activity.glyph, left + vec2(22.0, 0.0), 8.0, ink);
    let font = FontId::proportional(16.0);
    painter.text(left + vec2(40.0, 0.0), Align2::LEFT_CENTER, &activity.word, font, ink);
}

palpate_model::named! {
    /// How far a step of the run is.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum StepState {
        Done = "done",
        Now = "now",
        Next = "next",
        /// In progress when the run ended early, or never begun.
        Skipped = "not done",
    }
}

impl StepState {
    /// The state of step `index` when `current` is in progress, or was when the run ended.
    #[must_use]
    pub fn of(index: usize, current: usize, is_running: bool, is_complete: bool) -> Self {
        match index.cmp(&current) {
            _ if is_complete => Self::Done,
            std::cmp::Ordering::Less => Self::Done,
            std::cmp::Ordering::Equal if is_running => Self::Now,
            std::cmp::Ordering::Greater if is_running => Self::Next,
            _ => Self::Skipped,
        }
    }
}

/// Height of a step's row in points.
pub const STEP_HEIGHT: f32 = 19.0;

/// Draws one step with its state and expected duration.
pub fn step_ui(ui: &mut Ui, name: &str, seconds: f64, state: StepState) {
    let tokens = tokens_of(ui);
    let size = vec2(ui.available_width(), STEP_HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let label = format!("Step {name}: {}", state.name());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &label));
    let painter = ui.painter();
    let ink = if state == StepState::Now { tokens.text } else { tokens.text_quiet };
    let glyph = match state {
        StepState::Done => Glyph::Tick,
        StepState::Now => Glyph::Triangle,
        StepState::Next => Glyph::Ring,
        StepState::Skipped => Glyph::Dash,
    };
    let at = |x: f32| pos2(rect.left() + x, rect.center().y);
    glyph_at(painter, glyph, at(8.0), 5.0, ink);
    let font = FontId::proportional(15.0);
    painter.text(at(24.0), Align2::LEFT_CENTER, name, font.clone(), ink);
    painter.text(at(110.0), Align2::LEFT_CENTER, state.name(), font, ink);
    let (end, duration) = (at(rect.width() - 2.0), format!("{seconds:.1} s"));
    painter.text(end, Align2::RIGHT_CENTER, duration, FontId::monospace(14.0), ink);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_step_has_one_state() {
        for (index, current, is_running, is_complete, state) in [
            (0, 2, true, false, StepState::Done),
            (2, 2, true, false, StepState::Now),
            (3, 2, true, false, StepState::Next),
            (0, 2, false, false, StepState::Done),
            (2, 2, false, false, StepState::Skipped),
            (3, 2, false, false, StepState::Skipped),
            (6, 6, false, true, StepState::Done),
        ] {
            assert_eq!(StepState::of(index, current, is_running, is_complete), state);
        }
    }
}
