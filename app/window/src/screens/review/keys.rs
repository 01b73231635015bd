//! Keys of the review screen, read while no text is typed and no control has the focus.

use super::{ReviewScreen, View};
use crate::plots::navigate::{PAN_STEP, ZOOM_STEP};
use eframe::egui::{Context, Event, Key, Modifiers};

/// Cursor A at the left third and B at the right one, where no pointer says where.
const CURSOR_SHARES: [f64; 2] = [1.0 / 3.0, 2.0 / 3.0];
/// Share of what is shown by which a key moves a cursor.
const CURSOR_STEP: f64 = 1.0 / 400.0;

/// A change of what the plots show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewMove {
    ZoomIn,
    ZoomOut,
    PanLeft,
    PanRight,
    Reset,
    /// Sets cursor A (0) or B (1).
    Cursor(usize),
    ClearCursors,
}

impl ReviewScreen {
    /// Does what a button or a key asks for.
    pub(super) fn go(&mut self, to: ViewMove) {
        let spans = match self.view {
            View::SideBySide if !self.side.is_over_depth => vec![&mut self.time],
            View::OverDepth | View::SideBySide | View::Cycles => {
                vec![&mut self.depth, &mut self.force]
            }
            _ => vec![&mut self.time],
        };
        match to {
            ViewMove::ZoomIn | ViewMove::ZoomOut => {
                let factor = if to == ViewMove::ZoomIn { ZOOM_STEP } else { 1.0 / ZOOM_STEP };
                spans.into_iter().for_each(|span| span.zoom(factor, span.at(0.5)));
            }
            ViewMove::PanLeft | ViewMove::PanRight => {
                let share = if to == ViewMove::PanRight { PAN_STEP } else { -PAN_STEP };
                spans.into_iter().take(1).for_each(|span| span.pan(share));
            }
            ViewMove::Reset => spans.into_iter().for_each(|span| span.show_all()),
            ViewMove::Cursor(number) => {
                self.cursors[number] = Some(self.time.at(CURSOR_SHARES[number]));
            }
            ViewMove::ClearCursors => self.cursors = [None; 2],
        }
    }

    /// Reads them; those that move a view only where there is one.
    pub(super) fn read_keys(&mut self, ctx: &Context, has_moves: bool) {
        let is_typing = ctx.text_edit_focused();
        if !is_typing && ctx.input_mut(|input| input.consume_key(Modifiers::COMMAND, Key::Z)) {
            self.undo();
        }
        if ctx.egui_wants_keyboard_input() {
            return;
        }
        // The modifiers are the event's own: those of the frame may have been let go already.
        let pressed: Vec<(Key, Modifiers)> = ctx.input(|input| {
            let events = input.events.iter();
            events
                .filter_map(|event| match event {
                    Event::Key { key, pressed: true, modifiers, .. } => Some((*key, *modifiers)),
                    _ => None,
                })
                .collect()
        });
        for (key, modifiers) in pressed {
            match key_action(key, modifiers) {
                Some(KeyAction::Widen) => self.is_wide = !self.is_wide,
                Some(KeyAction::Go(to)) if has_moves => self.go(to),
                Some(KeyAction::Step(number, way)) if has_moves => self.step_cursor(number, way),
                _ => {}
            }
        }
    }

    /// Moves a cursor a little, one way or the other.
    fn step_cursor(&mut self, number: usize, way: f64) {
        let [low, high] = self.time.shown();
        let from = self.cursors[number].unwrap_or(self.time.at(CURSOR_SHARES[number]));
        self.cursors[number] = Some(from + way * CURSOR_STEP * (high - low));
    }
}

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum KeyAction {
    Go(ViewMove),
    /// A cursor moves: which, and to which side.
    Step(usize, f64),
    /// Plots have the whole width, or the panels beside them come back.
    Widen,
}

/// What a key asks for with the modifiers held; with Ctrl it belongs to the window.
fn key_action(key: Key, modifiers: Modifiers) -> Option<KeyAction> {
    if modifiers.command || modifiers.ctrl {
        return None;
    }
    Some(match (key, modifiers.alt, modifiers.shift) {
        (Key::ArrowLeft, true, _) => KeyAction::Step(0, -1.0),
        (Key::ArrowRight, true, _) => KeyAction::Step(0, 1.0),
        (Key::ArrowLeft, _, true) => KeyAction::Step(1, -1.0),
        (Key::ArrowRight, _, true) => KeyAction::Step(1, 1.0),
        (Key::ArrowLeft, ..) => KeyAction::Go(ViewMove::PanLeft),
        (Key::ArrowRight, ..) => KeyAction::Go(ViewMove::PanRight),
        // On many keyboards the plus is the shifted equals sign.
        (Key::Plus | Key::Equals, ..) => KeyAction::Go(ViewMove::ZoomIn),
        (Key::Minus, ..) => KeyAction::Go(ViewMove::ZoomOut),
        (Key::Home, ..) => KeyAction::Go(ViewMove::Reset),
        (Key::A, ..) => KeyAction::Go(ViewMove::Cursor(0)),
        (Key::B, ..) => KeyAction::Go(ViewMove::Cursor(1)),
        (Key::W, ..) => KeyAction::Widen,
        (Key::Delete, ..) => KeyAction::Go(ViewMove::ClearCursors),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrows_move_the_picture_and_with_alt_or_shift_a_cursor() {
        for (key, modifiers, wanted) in [
            (Key::ArrowLeft, Modifiers::NONE, Some(KeyAction::Go(ViewMove::PanLeft))),
            (Key::ArrowRight, Modifiers::ALT, Some(KeyAction::Step(0, 1.0))),
            (Key::ArrowLeft, Modifiers::SHIFT, Some(KeyAction::Step(1, -1.0))),
            (Key::Equals, Modifiers::SHIFT, Some(KeyAction::Go(ViewMove::ZoomIn))),
            (Key::Plus, Modifiers::COMMAND, None),
            (Key::F5, Modifiers::NONE, None),
        ] {
            assert_eq!(key_action(key, modifiers), wanted, "{key:?} {modifiers:?}");
        }
    }
}
