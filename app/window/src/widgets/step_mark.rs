//! One line of the list of steps: done, now or next, as mark and word.

use crate::theme::Tokens;
use eframe::egui::{
    Align2, Color32, FontId, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2,
};

palpate_model::named! {
    /// Where a step stands.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum StepState {
        /// Finished.
        Done = "done",
        /// In progress.
        Now = "now",
        /// To come.
        Next = "next",
        /// Was in progress when the run ended early, or never came.
        Skipped = "not done",
    }
}

impl StepState {
    /// Where step `index` stands when `current` is in progress, or was when the run ended.
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

/// Draws one step with its expected duration.
pub fn step_ui(ui: &mut Ui, name: &str, seconds: f64, state: StepState) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let size = vec2(ui.available_width(), 19.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| {
        WidgetInfo::labeled(Role::Label, true, format!("Step {name}: {}", state.name()))
    });
    let painter = ui.painter();
    let ink = if state == StepState::Now { tokens.text } else { tokens.text_quiet };
    let y = rect.center().y;
    mark(ui, state, rect.left() + 8.0, y, ink);
    let font = FontId::proportional(13.5);
    painter.text(pos2(rect.left() + 24.0, y), Align2::LEFT_CENTER, name, font.clone(), ink);
    painter.text(pos2(rect.left() + 110.0, y), Align2::LEFT_CENTER, state.name(), font, ink);
    painter.text(
        pos2(rect.right() - 2.0, y),
        Align2::RIGHT_CENTER,
        format!("{seconds:.1} s"),
        FontId::monospace(12.5),
        ink,
    );
}

fn mark(ui: &Ui, state: StepState, x: f32, y: f32, ink: Color32) {
    let painter = ui.painter();
    let center = pos2(x, y);
    match state {
        StepState::Done => {
            let tick = vec![pos2(x - 5.0, y), pos2(x - 1.5, y + 4.0), pos2(x + 5.0, y - 4.5)];
            painter.add(Shape::line(tick, Stroke::new(2.0, ink)));
        }
        StepState::Now => {
            let corners = vec![pos2(x - 4.0, y - 5.5), pos2(x + 6.0, y), pos2(x - 4.0, y + 5.5)];
            painter.add(Shape::convex_polygon(corners, ink, Stroke::NONE));
        }
        StepState::Next => {
            painter.circle_stroke(center, 4.0, Stroke::new(1.5, ink));
        }
        StepState::Skipped => {
            painter.hline(x - 5.0..=x + 5.0, y, Stroke::new(2.0, ink));
        }
    }
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
