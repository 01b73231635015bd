//! Buttons that say why they cannot be pressed, and keep their identity while lines come and go above them.

use super::places::NamedControl;
use super::text::quiet_ui;
use eframe::egui::{AsIdSalt, Button, Ui, UiBuilder, Vec2};

/// Nothing where a condition holds, otherwise the reason why something cannot be done.
pub fn require(condition: bool, reason: impl Into<String>) -> Result<(), String> {
    if condition { Ok(()) } else { Err(reason.into()) }
}

/// Draws the button; `verdict` both enables it and gives the reason. True when pressed.
pub fn reason_button(
    ui: &mut Ui,
    text: &str,
    min_size: Vec2,
    verdict: &Result<(), String>,
) -> bool {
    let is_pressed = steady(ui, text, |ui| {
        ui.add_enabled(verdict.is_ok(), Button::new(text).min_size(min_size)).named(text).clicked()
    });
    if let Err(reason) = verdict {
        quiet_ui(ui, reason);
    }
    is_pressed
}

/// Draws a control whose identity is its name and not its place among its neighbours.
///
/// A place counted from above changes when an answer or a line of a list appears there; the press under way would be
/// lost, and the keyboard's place with it. The name is to be the only one of its kind in this part of the panel.
pub fn steady<R>(ui: &mut Ui, name: impl AsIdSalt, control: impl FnOnce(&mut Ui) -> R) -> R {
    let own = ui.scope_id().with(("steady", name));
    ui.scope_builder(UiBuilder::new().scope_id(own), control).inner
}

#[cfg(test)]
mod tests {
    use super::steady;
    use eframe::egui::{Context, Id, RawInput};

    /// The identity of a button behind so many lines.
    fn behind(lines: usize, is_steady: bool) -> Id {
        let mut id = None;
        let mut output = Context::default().run_ui(RawInput::default(), |ui| {
            for _ in 0..lines {
                ui.label("a line");
            }
            id = Some(match is_steady {
                true => steady(ui, "press", |ui| ui.button("press").id),
                false => ui.button("press").id,
            });
        });
        // Nothing is painted.
        output.textures_delta.clear();
        id.unwrap()
    }

    #[test]
    fn a_control_is_the_same_one_behind_more_lines() {
        assert_eq!(behind(0, true), behind(3, true));
        // Otherwise this helper is of no use any more.
        assert_ne!(behind(0, false), behind(3, false));
    }
}
